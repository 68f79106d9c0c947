// The reaching process: docs/reach.md.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/reach/babbling.h"
#include "nido/reach/settings.h"
#include "nido/speech/phrases.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::reach;  // NOLINT(google-build-using-namespace)

constexpr double kStatusPeriod_s = 0.2;
constexpr double kGazePeriod_s = 0.03;
constexpr double kRadPerDeg = static_cast<double>(EIGEN_PI) / 180.0;

Eigen::Vector3d to_eigen(const msgs::Point& p) { return {p.x(), p.y(), p.z()}; }
Eigen::Vector3d to_eigen(const msgs::Vector3& v) { return {v.x(), v.y(), v.z()}; }

msgs::JointCommand command_of(Time now, int first, int count, const Joints& q) {
  msgs::JointCommand command;
  command.header(header_at(now));
  command.mode("direct");
  for (int i = 0; i < count; ++i) {
    command.joint().push_back(i);
    command.value().push_back(q(first + i));
  }
  return command;
}

const char* name_of(ActionState state) {
  switch (state) {
    case ActionState::kIdle:
      return "idle";
    case ActionState::kRunning:
      return "running";
    case ActionState::kDone:
      return "done";
    case ActionState::kFailed:
      break;
  }
  return "failed";
}

// The process's ports.
struct Ports {
  std::unique_ptr<Input<msgs::ActionGoal>> goal;
  std::unique_ptr<Input<msgs::HandView>> hand;
  std::unique_ptr<Input<msgs::Percepts>> objects;
  std::unique_ptr<Input<msgs::Heard>> heard;
  std::unique_ptr<Input<msgs::JointState>> arm;
  std::unique_ptr<Input<msgs::JointState>> torso;
  std::unique_ptr<Output<msgs::JointCommand>> command;
  std::unique_ptr<Output<msgs::JointCommand>> torso_command;
  std::unique_ptr<Output<msgs::ActionStatus>> status;
  // babbling: the eyes are turned to where the body feels its hand, and the end is told
  std::unique_ptr<Output<msgs::GazeGoal>> gaze;
  std::unique_ptr<Output<msgs::StageEvent>> outcome;
};

// `prefix`: "/reach", or what else the ports are called by.
Result<Ports> open_ports(Node& node, const std::string& prefix, bool babbles) {
  Ports ports;
  Status opened = open_into(node, ports.hand, prefix + "/hand:i", Profile::kState);
  if (opened) opened = open_into(node, ports.arm, prefix + "/arm:i", Profile::kState);
  if (opened) opened = open_into(node, ports.torso, prefix + "/torso:i", Profile::kState);
  if (opened) opened = open_into(node, ports.command, prefix + "/command:o", Profile::kCommand);
  if (opened) opened = open_into(node, ports.torso_command, prefix + "/torso:o", Profile::kCommand);
  if (opened) opened = open_into(node, ports.status, prefix + "/status:o", Profile::kEvent);
  if (opened && babbles) opened = open_into(node, ports.gaze, prefix + "/gaze:o", Profile::kEvent);
  if (opened && babbles) opened = open_into(node, ports.outcome, prefix + "/outcome:o", Profile::kEvent);
  if (opened && !babbles) opened = open_into(node, ports.goal, prefix + "/goal:i", Profile::kEvent);
  if (opened && !babbles) opened = open_into(node, ports.objects, prefix + "/objects:i", Profile::kState);
  if (opened && !babbles) opened = open_into(node, ports.heard, prefix + "/heard:i", Profile::kEvent);
  if (!opened) return opened.error();
  return ports;
}

// Puts together the encoders of both boards.
class Encoders {
 public:
  std::optional<Joints> take(Ports& ports) {
    bool is_new = false;
    if (auto state = ports.arm->take_latest(); state && state->position().size() >= kArmJoints) {
      for (int i = 0; i < kArmJoints; ++i)
        q_(kTorsoJoints + i) = state->position()[static_cast<std::size_t>(i)];
      arm_known_ = is_new = true;
    }
    if (auto state = ports.torso->take_latest(); state && state->position().size() >= kTorsoJoints) {
      for (int i = 0; i < kTorsoJoints; ++i) q_(i) = state->position()[static_cast<std::size_t>(i)];
      torso_known_ = is_new = true;
    }
    return is_new && arm_known_ && torso_known_ ? std::optional(q_) : std::nullopt;
  }

 private:
  Joints q_ = Joints::Zero();
  bool arm_known_ = false;
  bool torso_known_ = false;
};

std::optional<HandSighting> take_hand(Ports& ports, const std::string& side) {
  std::optional<HandSighting> latest;
  while (const auto view = ports.hand->take()) {
    if (view->side() != side) continue;
    latest.reset();
    if (view->visible()) {
      latest = HandSighting{time_of(view->header()).seconds(), to_eigen(view->pose().position()),
                            view->confidence()};
    }
  }
  return latest;
}

// "a bit left": a person says how a reach should have been.
std::optional<std::string> take_correction(Ports& ports) {
  std::optional<std::string> direction;
  while (const auto heard = ports.heard->take()) {
    if (heard->accepted() && heard->text().starts_with(kCorrection))
      direction = heard->text().substr(std::string_view(kCorrection).size());
  }
  return direction;
}

Status send(Ports& ports, Time now, const Joints& q, bool with_torso = true) {
  if (auto sent = ports.command->write(command_of(now, kTorsoJoints, kArmJoints, q)); !sent) return sent;
  if (!with_torso) return {};
  return ports.torso_command->write(command_of(now, 0, kTorsoJoints, q));
}

Status act(Node& node, const SettingsPaths& paths, const std::string& side, const PlannerOptions& planner,
           bool paper_network_alone, bool home_at_start, const std::string& corrections_file) {
  const auto prefix =
      node.parameter<std::string>("ports", "/reach", {.about = "what the ports are called by"});
  if (!prefix) return prefix.error();
  const auto shares_torso = node.parameter<bool>(
      "shares_torso", false, {.about = "another arm moves the torso, too: it is left alone between actions"});
  if (!shares_torso) return shares_torso.error();
  auto core = make_reach_core(paths, side, paper_network_alone, planner);
  if (!core) return core.error();
  if (!corrections_file.empty() && std::filesystem::exists(corrections_file)) {
    auto corrections = CorrectionMemory::load(corrections_file);
    if (!corrections) return corrections.error();
    core->set_corrections(std::move(*corrections));
  }
  auto ports = open_ports(node, *prefix, false);
  if (!ports) return ports.error();
  node.set_ready();

  Encoders encoders;
  ReachStatus last;
  Time last_sent;
  bool go_home = home_at_start;
  return node.run([&](Time now) -> Status {
    ReachInput input;
    input.measured_rad = encoders.take(*ports);
    input.hand = take_hand(*ports, side);
    if (auto percepts = ports->objects->take_latest()) {
      input.objects.emplace();
      for (const auto& object : percepts->objects()) {
        input.objects->push_back({object.name(), to_eigen(object.position()), to_eigen(object.size())});
      }
    }
    if (auto goal = ports->goal->take()) {
      input.goal = ReachGoal{
          goal->id(), goal->action(), goal->object(), to_eigen(goal->position()), to_eigen(goal->size()),
          goal->yaw()};
      node.log_info(goal->action() + " " + goal->object());
      go_home = false;
    } else if (auto correction = take_correction(*ports); correction && last.state != ActionState::kRunning) {
      node.log_info(std::string(kCorrection) + *correction);
      input.goal.emplace();  // nobody asked by a number, so nobody waits for an answer
      input.goal->action = "correct";
      input.goal->object = *correction;
    } else if (go_home && input.measured_rad) {
      input.goal.emplace();
      input.goal->action = "home";
      go_home = false;
    }
    if (*shares_torso) core->follow_torso();
    const ReachOutput out = core->step(now.seconds(), input);
    if (out.command_rad) {
      const bool acts = last.state == ActionState::kRunning || out.status.state == ActionState::kRunning;
      if (auto sent = send(*ports, now, *out.command_rad, acts || !*shares_torso); !sent) return sent;
    }
    if (out.note) node.log_info(*out.note);
    if (out.corrected && !corrections_file.empty()) {
      if (auto saved = core->corrections().save(corrections_file); !saved)
        node.log_warning(saved.error().message);
    }
    const bool changed = out.status.id != last.id || out.status.state != last.state;
    if (changed && out.status.state == ActionState::kFailed) {
      node.log_warning(out.status.action + ": " + out.status.reason);
    }
    // repeated now and then, so that a listener that came late knows too
    const bool is_due = now.seconds() - last_sent.seconds() >= kStatusPeriod_s;
    if (out.status.id != 0 && (changed || is_due)) {
      last_sent = now;
      msgs::ActionStatus message;
      message.header(header_at(now));
      message.id(out.status.id);
      message.action(out.status.action);
      message.state(name_of(out.status.state));
      message.reason(out.status.reason);
      message.error_m(out.status.error_m);
      if (auto sent = ports->status->write(message); !sent) return sent;
    }
    last = out.status;
    return {};
  });
}

Status babble(Node& node, const SettingsPaths& paths, const std::string& side) {
  BabblingOptions options;
  options.seed = node.options().seed;
  auto samples = node.parameter<int>("samples", options.samples);
  if (!samples) return samples.error();
  auto whole_body = node.parameter<bool>("whole_body", options.whole_body);
  if (!whole_body) return whole_body.error();
  auto out = node.parameter<std::string>("samples_file", "reach_samples.txt");
  if (!out) return out.error();
  if (*samples < 1) {
    return Error{ErrorCode::kInvalidArgument,
                 "parameter samples is " + std::to_string(*samples) + "; expected 1 or more"};
  }
  options.samples = *samples;
  options.side = side;
  options.whole_body = *whole_body;
  // ten joints want wider steps than five to be gone through in as many samples
  if (options.whole_body) options.spacing_rad = 0.06;
  auto body = load_body(paths.urdf, paths.calibration, side);
  if (!body) return body.error();
  auto ports = open_ports(node, "/reach", true);
  if (!ports) return ports.error();
  node.set_ready();

  Babbling babbling(body->chain, options);
  Encoders encoders;
  bool written = false;
  std::size_t reported = 0;
  double last_status_s = -1.0;
  double last_gaze_s = -1.0;
  const auto save = [&]() -> Status {
    written = true;
    const std::string command_line =
        "nido experiment run reach-learning --seed " + std::to_string(options.seed);
    if (auto saved = save_samples(*out, babbling.samples(), command_line); !saved) return saved;
    node.log_info("babbling: " + std::to_string(babbling.samples().size()) + " samples in " + *out);
    return {};
  };
  const Status ended = node.run([&](Time now) -> Status {
    const auto measured = encoders.take(*ports);
    const auto hand = take_hand(*ports, side);
    const auto command = babbling.step(now.seconds(), measured, hand);
    if (command) {
      if (auto sent = send(*ports, now, *command); !sent) return sent;
    }
    if (babbling.samples().size() >= reported + 100) {
      reported = babbling.samples().size();
      node.log_info("babbling: " + std::to_string(reported) + " of " + std::to_string(options.samples) +
                    " samples");
    }
    if (babbling.complete() && !written) {
      if (auto saved = save(); !saved) return saved;
    }
    if (measured && now.seconds() - last_gaze_s >= kGazePeriod_s) {
      last_gaze_s = now.seconds();
      const Eigen::Vector3d hand_Root_m = body->chain.X_RootPalm(*measured) * body->p_PalmMark_m;
      msgs::GazeGoal gaze;
      gaze.header(header_at(now));
      gaze.mode("point");
      gaze.point().x(hand_Root_m.x());
      gaze.point().y(hand_Root_m.y());
      gaze.point().z(hand_Root_m.z());
      if (auto sent = ports->gaze->write(gaze); !sent) return sent;
    }
    if (now.seconds() - last_status_s >= 0.5) {
      last_status_s = now.seconds();
      msgs::ActionStatus message;
      message.header(header_at(now));
      message.action("babble");
      message.state(written ? "done" : "running");
      message.reason(std::to_string(babbling.samples().size()) + " of " + std::to_string(options.samples) +
                     " samples");
      if (auto sent = ports->status->write(message); !sent) return sent;
      if (written) {
        msgs::StageEvent outcome;
        outcome.header(header_at(now));
        outcome.stage("outcome");
        outcome.state("done");
        outcome.text(message.reason() + " in " + *out);
        if (auto sent = ports->outcome->write(outcome); !sent) return sent;
      }
    }
    return {};
  });
  // ended early: what was gathered is kept
  if (!written && !babbling.samples().empty()) {
    if (auto saved = save(); !saved) return saved;
  }
  return ended;
}

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  auto side = node.parameter<std::string>("side", "right",
                                          {.about = "the hand that acts", .choices = {"right", "left"}});
  if (!side) return side.error();
  SettingsPaths paths = shipped_paths(places->config, *side);
  for (const auto& [key, value] : std::initializer_list<std::pair<const char*, std::string*>>{
           {"urdf", &paths.urdf},
           {"calibration", &paths.calibration},
           {"postures", &paths.postures},
           {"posture_weights", &paths.posture_weights},
           {"hand_weights", &paths.hand_weights}}) {
    auto given = node.parameter<std::string>(key, *value);
    if (!given) return given.error();
    *value = *given;
  }
  auto mode = node.parameter<std::string>("mode", "act");
  if (!mode) return mode.error();
  if (*mode == "babble") return babble(node, paths, *side);
  if (*mode != "act") {
    return Error{ErrorCode::kInvalidArgument, "parameter mode is '" + *mode + "'; allowed: act, babble"};
  }
  PlannerOptions planner = default_planner_options();
  auto home = node.parameter<std::vector<double>>("home_deg", {});
  if (!home) return home.error();
  if (!home->empty()) {
    if (home->size() != kJoints) {
      return Error{ErrorCode::kInvalidArgument,
                   "parameter home_deg has " + std::to_string(home->size()) +
                       " angles; expected 10: torso yaw, roll, pitch and the arm's first 7"};
    }
    for (int i = 0; i < kJoints; ++i) planner.home(i) = (*home)[static_cast<std::size_t>(i)] * kRadPerDeg;
  }
  auto table = node.parameter<bool>("table", true);
  if (!table) return table.error();
  if (!*table) {  // nothing to keep clear of: a block deep under the floor
    planner.table_min_Root_m.z() = -20.0;
    planner.table_max_Root_m.z() = -10.0;
    planner.table_is_seen = false;
  }
  auto home_at_start = node.parameter<bool>("home_at_start", true);
  if (!home_at_start) return home_at_start.error();
  auto controller = node.parameter<std::string>("controller", "learned");
  if (!controller) return controller.error();
  if (*controller != "learned" && *controller != "network") {
    return Error{ErrorCode::kInvalidArgument,
                 "parameter controller is '" + *controller +
                     "'; allowed: learned, network (the paper's alone, for point)"};
  }
  auto corrections = node.parameter<std::string>("corrections", "");
  if (!corrections) return corrections.error();
  return act(node, paths, *side, planner, *controller == "network", *home_at_start, *corrections);
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "reach", run); }
