// nido-grasp-trials: the experimenter of the grasping experiment (docs/grasp.md).
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>
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

// Height of an object's middle, root frame.
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

// Where things lie when they lie on the table.
struct Rest {
  double middle_Root_m = 0;  // height of the middle, root frame
  double frame_World_m = 0;  // height of the frame's origin, frame of the world port
};

Result<Rest> rest_of(Node& node, const std::string& object) {
  auto middle = object_height_m(node, object);
  if (!middle) return middle.error();
  auto answer = ask(node, "world get \"" + object + "\"");
  if (!answer) return answer.error();
  std::istringstream in(*answer);
  double x = 0;
  double y = 0;
  if (!(in >> x >> y)) return Error{ErrorCode::kFailed, "no position in the world's answer: " + *answer};
  return Rest{*middle, y};
}

Status put(Node& node, const TrialOutputs::Put& put, const Rest& rest) {
  const Eigen::Vector3d p = world_of_root({put.p_Root_m.x(), put.p_Root_m.y(), 0.0});
  // upright: its frame points up, which is y of the world port
  auto turned = ask(node, fmt::format("world rot \"{}\" -90 0 {}", put.object, put.yaw_rad * 180.0 / M_PI));
  if (!turned) return turned.error();
  auto there =
      ask(node, fmt::format("world set \"{}\" {} {} {}", put.object, p.x(), rest.frame_World_m, p.z()));
  return there ? Status{} : Status{there.error()};
}

msgs::ActionGoal goal_message(const TrialOutputs::Action& action, Time now) {
  msgs::ActionGoal goal;
  goal.header(header_at(now, "root"));
  goal.id(action.id);
  goal.action(action.action);
  goal.object(action.object);
  goal.position().x(action.p_Root_m.x());
  goal.position().y(action.p_Root_m.y());
  goal.position().z(action.p_Root_m.z());
  return goal;
}

std::optional<TrialInputs::Done> newest(Input<msgs::ActionStatus>& port) {
  std::optional<TrialInputs::Done> done;
  while (auto status = port.take()) done = TrialInputs::Done{status->id(), status->state(), status->reason()};
  return done;
}

Status save(const std::vector<TrialResult>& results, const std::string& path) {
  nlohmann::json rows = nlohmann::json::array();
  for (const TrialResult& r : results) {
    rows.push_back({{"attempt", r.attempt},
                    {"object", r.object},
                    {"trouble", r.trouble},
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
  auto objects = node.parameter<std::vector<std::string>>("objects", options.objects);
  if (!objects) return objects.error();
  if (*attempts < 1 || objects->empty()) {
    return Error{ErrorCode::kInvalidArgument,
                 "parameters attempts and objects: expected one or more of each"};
  }
  auto results_path = node.parameter<std::string>("results", "trials.json");
  if (!results_path) return results_path.error();
  options.attempts = *attempts;
  options.objects = *objects;

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

  std::optional<TrialsCore> core;
  std::map<std::string, Rest> rests;
  std::vector<TrialResult> results;
  bool finished = false;
  return node.run([&](Time now) -> Status {
    if (finished) return {};
    if (!core) {
      // all of them lie on the table as the world file has put them there
      std::vector<double> heights;
      for (const std::string& object : options.objects) {
        auto rest = rest_of(node, object);
        if (!rest) return rest.error();
        rests[object] = *rest;
        heights.push_back(rest->middle_Root_m);
      }
      core.emplace(options, heights, node.options().seed);
    }
    TrialInputs inputs;
    inputs.reach = newest(**reach_in);
    inputs.grasp = newest(**grasp_in);
    if (core->wants_height()) {
      auto height = object_height_m(node, core->object());
      if (!height) return height.error();
      inputs.object_height_m = *height;
    }
    const TrialOutputs out = core->step(node.options().period_s, inputs);
    if (out.put) {
      if (auto there = put(node, *out.put, rests[out.put->object]); !there) return there;
    }
    if (out.reach) {
      if (auto sent = (*reach_out)->write(goal_message(*out.reach, now)); !sent) return sent;
    }
    if (out.grasp) {
      if (auto sent = (*grasp_out)->write(goal_message(*out.grasp, now)); !sent) return sent;
    }
    if (out.result) {
      results.push_back(*out.result);
      if (out.result->trouble.empty()) {
        node.log_info(fmt::format("attempt {}: {}, held {} of {} steps, reward {:.2f}", out.result->attempt,
                                  out.result->object, out.result->steps_held, options.test_steps,
                                  out.result->reward));
        msgs::Reward reward;
        reward.header(header_at(now));
        reward.value(out.result->reward);
        if (auto sent = (*reward_out)->write(reward); !sent) return sent;
      } else {
        node.log_warning(fmt::format("attempt {}: {}, not tried: {}", out.result->attempt, out.result->object,
                                     out.result->trouble));
      }
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
