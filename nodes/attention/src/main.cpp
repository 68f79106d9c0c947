// nido-attention: keeps a surface at fixation, and says which pixels belong to it. docs/attention.md

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "nido/attention/attention_core.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/vision/eye_ports.h"

namespace nido {
namespace {

using attention::AttentionCore;
using attention::AttentionInputs;
using attention::AttentionOutputs;
using attention::Method;

constexpr std::size_t kPairsPerReport = 30;

struct Ports {
  vision::EyePorts eyes;
  std::unique_ptr<Input<msgs::GazeGoal>> fixate;
  std::unique_ptr<Output<msgs::Image>> segment;
  std::unique_ptr<Output<msgs::Image>> threshold;
  std::unique_ptr<Output<msgs::Percepts>> fixation;
  std::unique_ptr<Output<msgs::JointCommand>> command;
};

Status open_ports(Node& node, Ports& ports) {
  if (Status s = ports.eyes.open(node, "/attention"); !s) return s;
  if (Status s = open_into(node, ports.fixate, "/attention/fixate:i", Profile::kEvent, 16); !s) return s;
  if (Status s = open_into(node, ports.segment, "/attention/segment:o", Profile::kSensor); !s) return s;
  if (Status s = open_into(node, ports.threshold, "/attention/threshold:o", Profile::kSensor); !s) return s;
  if (Status s = open_into(node, ports.fixation, "/attention/fixation:o", Profile::kState); !s) return s;
  return open_into(node, ports.command, "/attention/command:o", Profile::kCommand);
}

AttentionInputs take_in(Ports& ports, std::vector<std::string>& warnings) {
  AttentionInputs in;
  ports.eyes.take_into(in);
  while (const auto message = ports.fixate->take()) {
    if (message->mode() == "point") {
      in.p_RootFixate_m = {message->point().x(), message->point().y(), message->point().z()};
    } else {
      warnings.push_back("gaze mode \"" + message->mode() + "\" is unknown to attention; it takes point");
    }
  }
  return in;
}

msgs::Image to_message(const cv::Mat& mask, Time stamp) {
  msgs::Image message;
  message.header(header_at(stamp, "left_eye"));
  message.width(static_cast<std::uint32_t>(mask.cols));
  message.height(static_cast<std::uint32_t>(mask.rows));
  message.step(static_cast<std::uint32_t>(mask.cols));
  message.encoding("mono8");
  message.data().assign(mask.datastart, mask.dataend);
  return message;
}

Status put_out(Ports& ports, const AttentionOutputs& out, Time now) {
  if (out.pictures_stamp) {
    msgs::Percepts fixation;
    fixation.header(header_at(*out.pictures_stamp, "root"));
    if (out.surface) {
      const attention::Surface& surface = *out.surface;
      if (Status s = ports.segment->write(to_message(surface.mask, surface.stamp)); !s) return s;
      if (Status s = ports.threshold->write(to_message(surface.threshold, surface.stamp)); !s) return s;
      msgs::Percept percept;
      percept.name("surface");
      percept.confidence(surface.confidence);
      percept.position().x(surface.p_Root_m.x());
      percept.position().y(surface.p_Root_m.y());
      percept.position().z(surface.p_Root_m.z());
      percept.left_box({surface.p_Left_px.x(), surface.p_Left_px.y(), 0, 0});
      percept.right_box({surface.p_Right_px.x(), surface.p_Right_px.y(), 0, 0});
      fixation.objects().push_back(percept);
    }
    if (Status s = ports.fixation->write(fixation); !s) return s;
  }
  if (out.command_rad) {
    msgs::JointCommand command;
    command.header(header_at(now));
    command.mode("direct");
    for (std::int32_t joint = 0; joint < 6; ++joint) {
      command.joint().push_back(joint);
      command.value().push_back((*out.command_rad)[static_cast<std::size_t>(joint)]);
    }
    return ports.command->write(command);
  }
  return {};
}

Result<Method> method_of(const std::string& name) {
  if (name == "field") return Method::kField;
  if (name == "threshold") return Method::kThreshold;
  if (name == "colour") return Method::kColour;
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("parameter method is \"{}\"; allowed are field, threshold, colour", name)};
}

Status save_times(const std::string& path, const std::vector<double>& work_s) {
  std::ofstream file(path);
  file << nlohmann::json{{"work_s", work_s}}.dump() << '\n';
  return file ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path}};
}

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto urdf = node.parameter<std::string>("urdf", (places->config / "robots" / "icub.urdf").string());
  if (!urdf) return urdf.error();
  const auto method_name = node.parameter<std::string>("method", "field");
  if (!method_name) return method_name.error();
  const auto method = method_of(*method_name);
  if (!method) return method.error();
  const auto times = node.parameter<std::string>("times", "");
  if (!times) return times.error();
  const auto model = RobotModel::load(*urdf);
  if (!model) return model.error();
  attention::AttentionSettings settings;
  settings.period_s = node.options().period_s;
  settings.surface.method = *method;
  auto core = AttentionCore::create(*model, settings);
  if (!core) return core.error();

  Ports ports;
  if (Status opened = open_ports(node, ports); !opened) return opened;
  node.set_ready();
  std::string last_warning;
  const auto warn_once = [&](const std::string& warning) {
    if (warning != last_warning)
      node.log_warning(warning);  // a repeated mistake is not worth a line each tick
    last_warning = warning;
  };
  std::vector<double> work_s;
  return node.run([&](Time now) -> Status {
    std::vector<std::string> refused;
    const AttentionOutputs out = (*core)->step(now, take_in(ports, refused));
    for (const std::string& warning : refused) warn_once(warning);
    for (const std::string& warning : out.warnings) warn_once(warning);
    if (out.work_s > 0) {
      work_s.push_back(out.work_s);
      if (!times->empty() && work_s.size() % kPairsPerReport == 0) {
        if (Status saved = save_times(*times, work_s); !saved) return saved;
      }
    }
    // a peer that is away for a while must not end this node
    if (const Status sent = put_out(ports, out, now); !sent) warn_once(sent.error().message);
    return {};
  });
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) { return nido::node_main(argc, argv, "attention", nido::run); }
