// nido-vision: sees the things on the table and the robot's own hand, and turns head and eyes. docs/vision.md
#include <fmt/format.h>

#include <filesystem>

#include "nido/kinematics/body_corrections.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/speech/phrases.h"
#include "nido/vision/eye_ports.h"
#include "nido/vision/vision_core.h"

namespace nido {
namespace {

using vision::VisionCore;
using vision::VisionInputs;
using vision::VisionOutputs;

struct Ports {
  vision::EyePorts eyes;
  std::unique_ptr<Input<msgs::GazeGoal>> gaze;
  std::unique_ptr<Input<msgs::Heard>> heard;
  std::unique_ptr<Output<msgs::Percepts>> objects;
  std::unique_ptr<Output<msgs::HandView>> hand;
  std::unique_ptr<Output<msgs::GazeStatus>> status;
  std::unique_ptr<Output<msgs::JointCommand>> command;
  std::unique_ptr<Output<msgs::StageEvent>> taught;
};

Status open_ports(Node& node, Ports& ports) {
  if (Status s = ports.eyes.open(node, "/vision"); !s) return s;
  if (Status s = open_into(node, ports.gaze, "/vision/gaze:i", Profile::kEvent, 16); !s) return s;
  if (Status s = open_into(node, ports.heard, "/vision/heard:i", Profile::kEvent, 16); !s) return s;
  if (Status s = open_into(node, ports.taught, "/vision/taught:o", Profile::kEvent); !s) return s;
  if (Status s = open_into(node, ports.objects, "/vision/objects:o", Profile::kState); !s) return s;
  if (Status s = open_into(node, ports.hand, "/vision/hand:o", Profile::kState); !s) return s;
  if (Status s = open_into(node, ports.status, "/vision/gaze/status:o", Profile::kState); !s) return s;
  return open_into(node, ports.command, "/vision/command:o", Profile::kCommand);
}

VisionInputs take_in(Ports& ports) {
  VisionInputs in;
  ports.eyes.take_into(in);
  while (const auto message = ports.gaze->take()) {
    in.gaze = vision::GazeGoal{message->mode(),
                               message->target(),
                               {message->point().x(), message->point().y(), message->point().z()}};
  }
  // a person shows a thing and says what it is
  while (const auto message = ports.heard->take()) {
    if (message->accepted() && message->text().starts_with(kNaming))
      in.called = message->text().substr(std::string_view(kNaming).size());
  }
  return in;
}

msgs::Percepts to_message(const std::vector<vision::SeenObject>& objects, Time stamp) {
  msgs::Percepts message;
  message.header(header_at(stamp, "root"));
  for (const vision::SeenObject& object : objects) {
    msgs::Percept percept;
    percept.name(object.name);
    percept.colour(object.colour);
    percept.shape(object.shape);
    percept.confidence(object.confidence);
    percept.position().x(object.p_RootObject_m.x());
    percept.position().y(object.p_RootObject_m.y());
    percept.position().z(object.p_RootObject_m.z());
    percept.size().x(object.size_m.x());
    percept.size().y(object.size_m.y());
    percept.size().z(object.size_m.z());
    percept.yaw(object.yaw_rad);
    percept.left_box(object.box[0]);
    percept.right_box(object.box[1]);
    message.objects().push_back(percept);
  }
  return message;
}

msgs::HandView to_message(const vision::SeenHand& hand, Time stamp) {
  msgs::HandView message;
  message.header(header_at(stamp, "root"));
  message.side(hand.side);
  message.visible(hand.visible);
  message.confidence(hand.confidence);
  message.pose().position().x(hand.p_RootKnuckle_m.x());
  message.pose().position().y(hand.p_RootKnuckle_m.y());
  message.pose().position().z(hand.p_RootKnuckle_m.z());
  message.pose().orientation().w(hand.q_RootHand.w());
  message.pose().orientation().x(hand.q_RootHand.x());
  message.pose().orientation().y(hand.q_RootHand.y());
  message.pose().orientation().z(hand.q_RootHand.z());
  message.has_orientation(hand.has_orientation);
  message.left_box(hand.box[0]);
  message.right_box(hand.box[1]);
  return message;
}

Status put_out(Ports& ports, const VisionOutputs& out, Time now, const std::string& side) {
  if (out.pictures_stamp) {
    if (Status s = ports.objects->write(to_message(out.objects, *out.pictures_stamp)); !s) return s;
    // the acting hand last: readers that keep one message keep that one
    for (const vision::SeenHand& hand : out.hands) {
      if (hand.side == side || !hand.visible) continue;
      if (Status s = ports.hand->write(to_message(hand, *out.pictures_stamp)); !s) return s;
    }
    for (const vision::SeenHand& hand : out.hands) {
      if (hand.side != side) continue;
      if (Status s = ports.hand->write(to_message(hand, *out.pictures_stamp)); !s) return s;
    }
  }
  if (out.taught) {
    msgs::StageEvent event;
    event.header(header_at(now, "root"));
    event.stage("taught");
    event.state(out.taught->learned ? "done" : "failed");
    event.object(out.taught->name);
    event.text(out.taught->text + ".");
    if (Status s = ports.taught->write(event); !s) return s;
  }
  if (out.gaze) {
    msgs::GazeStatus status;
    status.header(header_at(now, "root"));
    status.mode(out.gaze->status.mode);
    status.target(out.gaze->status.target);
    status.fixated(out.gaze->status.fixated);
    status.search_done(out.gaze->status.search_done);
    if (Status s = ports.status->write(status); !s) return s;
    msgs::JointCommand command;
    command.header(header_at(now, "root"));
    command.mode("direct");
    for (std::int32_t joint = 0; joint < 6; ++joint) {
      command.joint().push_back(joint);
      command.value().push_back(out.gaze->command_rad[static_cast<std::size_t>(joint)]);
    }
    if (Status s = ports.command->write(command); !s) return s;
  }
  return {};
}

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto robot = node.parameter<std::string>("urdf", (places->config / "robots" / "icub.urdf").string());
  if (!robot) return robot.error();
  const auto templates_path =
      node.parameter<std::string>("templates", (places->config / "objects" / "templates.yaml").string());
  if (!templates_path) return templates_path.error();
  const auto side = node.parameter<std::string>(
      "side", "right", {.about = "the hand that is looked for", .choices = {"left", "right"}});
  if (!side) return side.error();
  const auto calibration = node.parameter<std::string>(
      "calibration", "", {.about = "file of self-calibration; empty: the body is as the URDF says"});
  if (!calibration) return calibration.error();
  const auto model = load_corrected_model(*robot, std::filesystem::path(*calibration));
  if (!model) return model.error();
  auto templates = vision::TemplateSet::load(*templates_path);
  if (!templates) return templates.error();
  const auto taught_file = node.parameter<std::string>(
      "taught", "", {.about = "file that keeps what people teach; empty: it is forgotten at the end"});
  if (!taught_file) return taught_file.error();
  const std::size_t untaught = templates->objects.size();
  if (!taught_file->empty() && std::filesystem::exists(*taught_file)) {
    const auto taught = vision::TemplateSet::load(*taught_file);
    if (!taught) return taught.error();
    templates->add(*taught);
    node.log_info(fmt::format("{} things that I was taught, from {}", taught->objects.size(), *taught_file));
  }
  vision::VisionSettings settings;
  settings.period_s = node.options().period_s;
  // a hand that is seen alone is likelier the one that acts
  if (*side == "left") settings.hand.middle_y_m *= -1.0;
  auto core = VisionCore::create(*model, *templates, settings);
  if (!core) return core.error();

  Ports ports;
  if (Status opened = open_ports(node, ports); !opened) return opened;
  node.set_ready();
  std::string last_warning;
  return node.run([&](Time now) -> Status {
    const VisionOutputs out = (*core)->step(now, take_in(ports));
    if (out.taught) node.log_info(out.taught->text);
    if (out.taught && out.taught->learned && !taught_file->empty()) {
      if (const Status kept = (*core)->templates().from(untaught).save(*taught_file); !kept)
        node.log_warning(kept.error().message);
    }
    for (const std::string& warning : out.warnings) {
      if (warning != last_warning)
        node.log_warning(warning);  // a peer that repeats a mistake is not worth a line each tick
      last_warning = warning;
    }
    // a peer that is away for a while must not end this node
    if (const Status sent = put_out(ports, out, now, *side); !sent && sent.error().message != last_warning) {
      last_warning = sent.error().message;
      node.log_warning(last_warning);
    }
    return {};
  });
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) { return nido::node_main(argc, argv, "vision", nido::run); }
