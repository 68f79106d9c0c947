// nido-grasp-trials: the experimenter of the grasping experiment (docs/grasp.md).
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "trials_core.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::grasp;  // NOLINT(google-build-using-namespace)

constexpr double kCallTimeout_s = 5.0;

// root frame to the world port's frame (X left, Y up, Z forward, origin on the floor under the robot)
Eigen::Vector3d world_of_root(const Eigen::Vector3d& p_Root_m) {
  return {-p_Root_m.y(), p_Root_m.z() + 0.5976, -p_Root_m.x() - 0.026};
}

Result<std::string> ask(Node& node, const std::string& line) {
  auto answer = node.call("/icubSim/world", line, kCallTimeout_s);
  if (answer && answer->rfind("[fail]", 0) == 0) {
    return Error{ErrorCode::kFailed, "the world answered " + *answer + " to: " + line};
  }
  return answer;
}

Result<double> object_height_m(Node& node, const std::string& object) {
  auto answer = ask(node, "world where \"" + object + "\"");
  if (!answer) return answer.error();
  std::istringstream in(*answer);
  double x = 0;
  double y = 0;
  double z = 0;
  if (!(in >> x >> y >> z)) return Error{ErrorCode::kFailed, "no pose in the world's answer: " + *answer};
  return z;
}

msgs::ActionGoal goal_message(const TrialOutputs::Action& action, const std::string& object,
                              const Eigen::Vector3d& p_Root_m, Time now) {
  msgs::ActionGoal goal;
  goal.header(header_at(now, "root"));
  goal.id(action.id);
  goal.action(action.action);
  goal.object(object);
  goal.position().x(p_Root_m.x());
  goal.position().y(p_Root_m.y());
  goal.position().z(p_Root_m.z());
  return goal;
}

std::optional<TrialInputs::Done> newest(Input<msgs::ActionStatus>& port) {
  std::optional<TrialInputs::Done> done;
  while (auto status = port.take()) done = TrialInputs::Done{status->id(), status->state()};
  return done;
}

Status save(const std::vector<TrialResult>& results, const std::string& path) {
  nlohmann::json rows = nlohmann::json::array();
  for (const TrialResult& r : results) {
    rows.push_back({{"attempt", r.attempt},
                    {"object", r.object},
                    {"closed_on_it", r.closed_on_it},
                    {"steps_held", r.steps_held},
                    {"reward", r.reward}});
  }
  std::ofstream file(path);
  file << rows.dump(1) << '\n';
  return file ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path}};
}

Status run(Node& node) {
  TrialOptions options;
  auto attempts = node.parameter<int>("attempts", options.attempts);
  if (!attempts) return attempts.error();
  auto object = node.parameter<std::string>("object", options.object);
  if (!object) return object.error();
  auto results_path = node.parameter<std::string>("results", "trials.json");
  if (!results_path) return results_path.error();
  options.attempts = *attempts;
  options.object = *object;

  auto reach_in = node.open_input<msgs::ActionStatus>("/grasp_trials/reach_status:i", Profile::kEvent);
  if (!reach_in) return reach_in.error();
  auto grasp_in = node.open_input<msgs::ActionStatus>("/grasp_trials/grasp_status:i", Profile::kEvent);
  if (!grasp_in) return grasp_in.error();
  auto reach_out = node.open_output<msgs::ActionGoal>("/grasp_trials/reach:o", Profile::kEvent);
  if (!reach_out) return reach_out.error();
  auto grasp_out = node.open_output<msgs::ActionGoal>("/grasp_trials/grasp:o", Profile::kEvent);
  if (!grasp_out) return grasp_out.error();
  auto reward_out = node.open_output<msgs::Reward>("/grasp_trials/reward:o", Profile::kEvent);
  if (!reward_out) return reward_out.error();
  auto story_out = node.open_output<msgs::StageEvent>("/grasp_trials/outcome:o", Profile::kState);
  if (!story_out) return story_out.error();
  node.set_ready();

  TrialsCore core(options, node.options().seed);
  std::vector<TrialResult> results;
  bool finished = false;
  return node.run([&](Time now) -> Status {
    if (finished) return {};
    TrialInputs inputs;
    inputs.reach = newest(**reach_in);
    inputs.grasp = newest(**grasp_in);
    auto height = object_height_m(node, options.object);
    if (!height) return height.error();
    inputs.object_height_m = *height;
    const TrialOutputs out = core.step(node.options().period_s, inputs);
    if (out.put_object_Root_m) {
      const Eigen::Vector3d p = world_of_root(*out.put_object_Root_m);
      auto put = ask(node, fmt::format("world set \"{}\" {} {} {}", options.object, p.x(), p.y(), p.z()));
      if (!put) return put.error();
      auto turned = ask(node, fmt::format("world rot \"{}\" 0 0 0", options.object));
      if (!turned) return turned.error();
    }
    if (out.reach) {
      if (auto sent = (*reach_out)->write(goal_message(*out.reach, options.object, core.p_Root_m(), now));
          !sent)
        return sent;
    }
    if (out.grasp) {
      if (auto sent = (*grasp_out)->write(goal_message(*out.grasp, options.object, core.p_Root_m(), now));
          !sent)
        return sent;
    }
    if (out.result) {
      results.push_back(*out.result);
      node.log_info(fmt::format("attempt {}: held {} of {} steps, reward {:.2f}", out.result->attempt,
                                out.result->steps_held, options.test_steps, out.result->reward));
      msgs::Reward reward;
      reward.header(header_at(now));
      reward.value(out.result->reward);
      if (auto sent = (*reward_out)->write(reward); !sent) return sent;
      if (auto saved = save(results, *results_path); !saved) return saved;
    }
    if (out.finished) {
      finished = true;
      msgs::StageEvent end;
      end.header(header_at(now));
      end.stage("outcome");
      end.state("done");
      end.text(fmt::format("{} attempts made", results.size()));
      if (auto sent = (*story_out)->write(end); !sent) return sent;
    }
    return {};
  });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "grasp_trials", run); }
