// nido-goal-selection: chooses what to do about a phrase and has reach and grasp do it.
// docs/goal_selection.md

#include <fmt/format.h>

#include <filesystem>

#include "nido/goal_selection/goal_selection_core.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/msgs/types.h"

namespace nido {
namespace {

Result<GoalSelectionSettings> read_settings(Node& node) {
  GoalSelectionSettings settings;
  for (const auto& [key, value] : {std::pair{"side", &settings.side}, {"basket", &settings.basket}}) {
    const auto read = node.parameter<std::string>(key, *value);
    if (!read) return read.error();
    *value = *read;
  }
  const auto tries =
      node.parameter<int>("tries", settings.tries, {"how often a thing is grasped for", "", 1, 20, {}});
  if (!tries) return tries.error();
  settings.tries = *tries;
  struct Number {
    const char* key;
    double* value;
    ParameterAbout about;
  };
  const auto seconds = [](const char* about) { return ParameterAbout{about, "s", 0, 3600, {}}; };
  const auto metres = [](const char* about) { return ParameterAbout{about, "m", 0, 1, {}}; };
  for (const Number& number :
       {Number{"lowest_percept_confidence",
               &settings.lowest_percept_confidence,
               {"what vision is less sure of is not there", "", 0, 1, {}}},
        {"view_memory_s", &settings.view_memory_s, seconds("older views are not used")},
        {"fixation_wait_s", &settings.fixation_wait_s,
         seconds("then a thing is taken as it is seen, centred or not")},
        {"search_limit_s", &settings.search_limit_s, seconds("for finding a thing")},
        {"reach_limit_s", &settings.reach_limit_s, seconds("for one movement of the arm")},
        {"grasp_limit_s", &settings.grasp_limit_s, seconds("for closing or opening the hand")},
        {"job_limit_s", &settings.job_limit_s, seconds("for the whole order")},
        {"lost_touch_s", &settings.lost_touch_s, seconds("without touch, and a thing is lost")},
        {"lift_height_m", &settings.lift_height_m, metres("how high a thing is lifted")},
        {"rest_tolerance_m", &settings.rest_tolerance_m,
         metres("a thing this near to its old place was not lifted")},
        {"release_height_m", &settings.release_height_m, metres("above the basket, where the hand opens")},
        {"hold_s", &settings.hold_s, seconds("that a thing is held before \"grasp\" is done")},
        {"check_s", &settings.check_s, seconds("of looking whether a lift worked")},
        {"drop_check_s", &settings.drop_check_s, seconds("of looking whether it lies in the basket")}}) {
    const auto read = node.parameter<double>(number.key, *number.value, number.about);
    if (!read) return read.error();
    *number.value = *read;
  }
  return settings;
}

Eigen::Vector3d vector_of(const msgs::Point& point) { return {point.x(), point.y(), point.z()}; }
Eigen::Vector3d vector_of(const msgs::Vector3& vector) { return {vector.x(), vector.y(), vector.z()}; }

void stamp(msgs::Header& header, Time now) {
  header.stamp().sec(static_cast<std::int32_t>(now.ns / 1'000'000'000));
  header.stamp().nanosec(static_cast<std::uint32_t>(now.ns % 1'000'000'000));
  header.frame_id("root");
}

ActionState to_state(const msgs::ActionStatus& message) {
  return {message.id(), message.action(), message.state(), message.reason(), message.error_m()};
}

msgs::ActionGoal to_message(const ActionCommand& command, Time now) {
  msgs::ActionGoal message;
  stamp(message.header(), now);
  message.id(command.id);
  message.action(command.action);
  message.object(command.object);
  message.position().x(command.p_RootTarget_m.x());
  message.position().y(command.p_RootTarget_m.y());
  message.position().z(command.p_RootTarget_m.z());
  message.size().x(command.size_m.x());
  message.size().y(command.size_m.y());
  message.size().z(command.size_m.z());
  message.yaw(command.yaw_rad);
  return message;
}

// The ports of this node.
struct Ports {
  std::unique_ptr<Input<msgs::Heard>> heard;
  std::unique_ptr<Input<msgs::Percepts>> objects;
  std::unique_ptr<Input<msgs::GazeStatus>> gaze_status;
  std::unique_ptr<Input<msgs::ActionStatus>> reach_status;
  std::unique_ptr<Input<msgs::ActionStatus>> grasp_status;
  std::unique_ptr<Input<msgs::Touch>> touch;
  std::unique_ptr<Input<msgs::Touch>> left_touch;  // this and the others of the left hand: with side "nearer"
  std::unique_ptr<Output<msgs::GazeGoal>> gaze;
  std::unique_ptr<Output<msgs::ActionGoal>> reach;
  std::unique_ptr<Output<msgs::ActionGoal>> grasp;
  std::unique_ptr<Output<msgs::ActionGoal>> left_reach;
  std::unique_ptr<Output<msgs::ActionGoal>> left_grasp;
  std::unique_ptr<Output<msgs::StageEvent>> stage;
};

Status open_ports(Node& node, bool both_hands, Ports& ports) {
  if (both_hands) {
    if (Status s = open_into(node, ports.left_touch, "/goal_selection/left_touch:i", Profile::kSensor, 4); !s)
      return s;
    if (Status s = open_into(node, ports.left_reach, "/goal_selection/left_reach:o", Profile::kCommand); !s)
      return s;
    if (Status s = open_into(node, ports.left_grasp, "/goal_selection/left_grasp:o", Profile::kCommand); !s)
      return s;
  }
  if (Status s = open_into(node, ports.heard, "/goal_selection/heard:i", Profile::kEvent, 16); !s) return s;
  if (Status s = open_into(node, ports.objects, "/goal_selection/objects:i", Profile::kState, 16); !s)
    return s;
  if (Status s = open_into(node, ports.gaze_status, "/goal_selection/gaze_status:i", Profile::kState, 16); !s)
    return s;
  if (Status s = open_into(node, ports.reach_status, "/goal_selection/reach_status:i", Profile::kEvent, 64);
      !s)
    return s;
  if (Status s = open_into(node, ports.grasp_status, "/goal_selection/grasp_status:i", Profile::kEvent, 64);
      !s)
    return s;
  if (Status s = open_into(node, ports.touch, "/goal_selection/touch:i", Profile::kSensor, 4); !s) return s;
  if (Status s = open_into(node, ports.gaze, "/goal_selection/gaze:o", Profile::kState); !s) return s;
  if (Status s = open_into(node, ports.reach, "/goal_selection/reach:o", Profile::kCommand); !s) return s;
  if (Status s = open_into(node, ports.grasp, "/goal_selection/grasp:o", Profile::kCommand); !s) return s;
  return open_into(node, ports.stage, "/goal_selection/stage:o", Profile::kEvent, 64);
}

std::optional<std::array<bool, 6>> take_touch(Input<msgs::Touch>& port) {
  const auto message = port.take_latest();
  if (!message || message->on().size() < 6) return std::nullopt;
  std::array<bool, 6> on{};
  for (std::size_t i = 0; i < on.size(); ++i) on[i] = message->on()[i];
  return on;
}

GoalSelectionInputs take_in(Ports& ports) {
  GoalSelectionInputs in;
  while (const auto message = ports.heard->take()) {
    in.heard.push_back({message->text(), message->confidence(), message->accepted(), message->reason()});
  }
  if (const auto message = ports.objects->take_latest()) {
    in.objects.emplace();
    for (const msgs::Percept& percept : message->objects()) {
      in.objects->push_back({percept.name(), percept.colour(), percept.shape(), percept.confidence(),
                             vector_of(percept.position()), vector_of(percept.size()), percept.yaw()});
    }
  }
  if (const auto message = ports.gaze_status->take_latest()) {
    in.gaze = GazeState{message->mode(), message->target(), message->fixated(), message->search_done()};
  }
  while (const auto message = ports.reach_status->take()) in.reach.push_back(to_state(*message));
  while (const auto message = ports.grasp_status->take()) in.grasp.push_back(to_state(*message));
  in.touch_on = take_touch(*ports.touch);
  if (ports.left_touch) in.left_touch_on = take_touch(*ports.left_touch);
  return in;
}

Status put_out(Ports& ports, const GoalSelectionOutputs& out, Time now) {
  for (const GazeCommand& command : out.gaze) {
    msgs::GazeGoal message;
    stamp(message.header(), now);
    message.mode(command.mode);
    message.target(command.target);
    if (Status written = ports.gaze->write(message); !written) return written;
  }
  for (const ActionCommand& command : out.reach) {
    const auto& port = ports.left_reach && command.side == "left" ? ports.left_reach : ports.reach;
    if (Status written = port->write(to_message(command, now)); !written) return written;
  }
  for (const ActionCommand& command : out.grasp) {
    const auto& port = ports.left_grasp && command.side == "left" ? ports.left_grasp : ports.grasp;
    if (Status written = port->write(to_message(command, now)); !written) return written;
  }
  for (const StageLine& line : out.stages) {
    msgs::StageEvent message;
    stamp(message.header(), now);
    message.stage(line.stage);
    message.state(line.state);
    message.object(line.object);
    message.text(line.text);
    if (Status written = ports.stage->write(message); !written) return written;
  }
  return {};
}

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto phrases = node.parameter<std::string>("phrases", (places->config / "phrases.yaml").string());
  if (!phrases) return phrases.error();
  const auto weights =
      node.parameter<std::string>("weights", (places->config / "weights" / "goal_selection.txt").string());
  if (!weights) return weights.error();
  const auto book = PhraseBook::load(*phrases);
  if (!book) return book.error();
  auto network = GoalNetwork::load(*weights, *book);
  if (!network) return network.error();
  const auto settings = read_settings(node);
  if (!settings) return settings.error();
  auto core = GoalSelectionCore::create(*book, std::move(network).value(), *settings);
  if (!core) return core.error();

  const auto lessons_file = node.parameter<std::string>(
      "lessons", "",
      {.about = "file that keeps what people teach to do with things; empty: it is forgotten at the end"});
  if (!lessons_file) return lessons_file.error();
  if (!lessons_file->empty() && std::filesystem::exists(*lessons_file)) {
    const auto lessons = load_lessons(*lessons_file);
    if (!lessons) return lessons.error();
    for (const GoalLesson& lesson : *lessons) {
      if (const Status taught = core->teach(lesson); !taught) return taught;
    }
  }

  Ports ports;
  if (Status opened = open_ports(node, settings->side == "nearer", ports); !opened) return opened;
  node.set_ready();
  return node.run([&](Time now) -> Status {
    const GoalSelectionOutputs out = core->step(now.seconds(), take_in(ports));
    // a peer that is away for a while must not end this node: its own time limits notice
    if (const Status sent = put_out(ports, out, now); !sent) node.log_warning(sent.error().message);
    if (out.taught && !lessons_file->empty()) {
      if (const Status kept = save_lessons(core->lessons(), *lessons_file); !kept)
        node.log_warning(kept.error().message);
    }
    return {};
  });
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) { return nido::node_main(argc, argv, "goal_selection", nido::run); }
