// The grasping process: docs/grasp.md.
#include <cmath>
#include <memory>
#include <optional>

#include "nido/grasp/policies.h"
#include "nido/grasp/settings.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::grasp;  // NOLINT(google-build-using-namespace)

constexpr double kStatusPeriod_s = 0.2;

msgs::JointCommand command_of(const FingerPosture& posture, Time now) {
  msgs::JointCommand command;
  command.header(header_at(now));
  command.mode("direct");
  command.joint().push_back(kSpreadJoint);
  command.value().push_back(posture.spread_rad);
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    command.joint().push_back(kFingerJoint[i]);
    command.value().push_back(posture.joint_rad[i]);
  }
  return command;
}

msgs::ActionStatus status_message(const GraspStatus& status, Time now) {
  msgs::ActionStatus message;
  message.header(header_at(now));
  message.id(status.id);
  message.action(status.action);
  message.state(status.state);
  message.reason(status.reason);
  return message;
}

// What the process was told to do and with what.
struct Settings {
  std::string side, ports, urdf, postures, weights, mode, save, command;
};

Result<Settings> read_settings(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto shipped = [&](const char* folder, const char* file) {
    return (places->config / folder / file).string();
  };
  Settings settings;
  Status read;
  const auto take = [&](const char* key, std::string fallback, std::string& value) {
    if (!read) return;
    auto given = node.parameter<std::string>(key, fallback);
    if (given) {
      value = *given;
    } else {
      read = given.error();
    }
  };
  take("side", "right", settings.side);
  take("ports", "/grasp", settings.ports);  // what they are called by
  take("urdf", shipped("robots", "icub.urdf"), settings.urdf);
  take("postures", shipped("robots", "grasp_postures.yaml"), settings.postures);
  take("weights", shipped("weights", "grasp.txt"), settings.weights);
  take("mode", "act", settings.mode);
  take("save", "grasp.txt", settings.save);
  take("command", "nido launch grasp_learning --seed " + std::to_string(node.options().seed),
       settings.command);
  if (!read) return read.error();
  if (settings.mode != "act" && settings.mode != "learn" && settings.mode != "test") {
    return Error{ErrorCode::kInvalidArgument,
                 "parameter mode is \"" + settings.mode + "\"; allowed are act, learn and test"};
  }
  return settings;
}

Status run(Node& node) {
  auto settings = read_settings(node);
  if (!settings) return settings.error();
  auto options_result = load_grasp_options(settings->urdf, settings->postures, settings->side);
  if (!options_result) return options_result.error();
  // mode "act" uses what was learned; mode "learn" learns online from rewards and saves after each of them;
  // mode "test" uses what was learned, and is given rewards that it does not use
  std::unique_ptr<GraspLearner> learner;
  GraspCore::Policy policy;
  if (settings->mode == "learn") {
    learner = std::make_unique<GraspLearner>(GraspLearner::Options{}, node.options().seed);
    policy = learner->policy();
  } else {
    auto network_result = load_grasp_network(settings->weights);
    if (!network_result) return network_result.error();
    policy = learned_policy(*network_result);
  }
  GraspCore core(*options_result, policy);

  auto goal_in = node.open_input<msgs::ActionGoal>(settings->ports + "/goal:i", Profile::kEvent);
  if (!goal_in) return goal_in.error();
  auto touch_in = node.open_input<msgs::Touch>(settings->ports + "/touch:i", Profile::kSensor);
  if (!touch_in) return touch_in.error();
  auto arm_in = node.open_input<msgs::JointState>(settings->ports + "/arm:i", Profile::kState);
  if (!arm_in) return arm_in.error();
  std::unique_ptr<Input<msgs::Reward>> reward_in;
  if (settings->mode != "act") {
    auto reward_result = node.open_input<msgs::Reward>(settings->ports + "/reward:i", Profile::kEvent);
    if (!reward_result) return reward_result.error();
    reward_in = std::move(*reward_result);
  }
  auto command_out = node.open_output<msgs::JointCommand>(settings->ports + "/command:o", Profile::kCommand);
  if (!command_out) return command_out.error();
  auto status_out = node.open_output<msgs::ActionStatus>(settings->ports + "/status:o", Profile::kEvent);
  if (!status_out) return status_out.error();
  node.set_ready();

  GraspInputs inputs;
  bool arm_known = false;
  std::optional<Time> last;
  GraspStatus last_status;
  Time last_status_time;
  return node.run([&](Time now) -> Status {
    if (auto state = (*arm_in)->take_latest(); state && state->position().size() == 16) {
      inputs.measured = fingers_of_arm(state->position());
      arm_known = true;
    }
    if (auto touch = (*touch_in)->take_latest(); touch && touch->on().size() == kPadCount) {
      for (std::size_t i = 0; i < kPadCount; ++i) inputs.touch[i] = touch->on()[i];
    }
    const double dt_s = last ? now.seconds() - last->seconds() : node.options().period_s;
    last = now;
    if (learner) {
      if (auto reward = reward_in->take()) {
        learner->reward(reward->value());
        learning::WeightsFile file;
        file.command = settings->command;
        learner->network().write_to(file, "grasp");
        if (auto saved = file.save(settings->save); !saved) return saved;
      }
    }
    // without knowing where the fingers are nothing is commanded; goals wait
    if (!arm_known) return {};
    inputs.goal.reset();
    if (auto goal = (*goal_in)->take()) {
      inputs.goal = GraspGoal{goal->id(), goal->action(), goal->object()};
      node.log_info(goal->action() + " " + goal->object());
    }
    const GraspOutputs out = core.step(dt_s, inputs);
    if (out.active) {
      if (auto sent = (*command_out)->write(command_of(out.target, now)); !sent) return sent;
    }
    if (out.status) {
      last_status = *out.status;
      if (last_status.state == "failed") node.log_warning(last_status.action + ": " + last_status.reason);
    }
    // repeated now and then, so that a listener that came late knows too
    if (out.status ||
        (last_status.id != 0 && now.seconds() - last_status_time.seconds() >= kStatusPeriod_s)) {
      last_status_time = now;
      if (auto sent = (*status_out)->write(status_message(last_status, now)); !sent) return sent;
    }
    return {};
  });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "grasp", run); }
