// nido-grasp-trials: the experimenter of the grasping experiment (docs/grasp.md).
#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "trials_core.h"
#include "world_port.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::grasp;  // NOLINT(google-build-using-namespace)

// The experimenter works with the right hand; for the left one all is done in the mirror.
void mirror(TrialOutputs& out) {
  for (auto* action : {&out.reach, &out.grasp}) {
    if (*action) (*action)->p_Root_m.y() *= -1;
  }
  if (out.put) {
    out.put->p_Root_m.y() *= -1;
    out.put->yaw_rad *= -1;
  }
  if (out.pull) out.pull->f_Root_N.y() *= -1;
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
  auto pull_N = node.parameter<double>("pull_N", options.pull_N);
  if (!pull_N) return pull_N.error();
  auto off_m = node.parameter<double>("off_m", options.off_m);
  if (!off_m) return off_m.error();
  auto turn_rad = node.parameter<double>("turn_rad", options.turn_rad);
  if (!turn_rad) return turn_rad.error();
  if (!(*pull_N >= 0 && *pull_N <= 1000 && *off_m >= 0 && *off_m <= 0.05 && *turn_rad >= 0)) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("parameters pull_N, off_m and turn_rad are {}, {} and {}; expected 0 to 1000, 0 to "
                    "0.05 and 0 or more",
                    *pull_N, *off_m, *turn_rad)};
  }
  auto spread_m = node.parameter<double>("spread_m", options.spread_m);
  if (!spread_m) return spread_m.error();
  auto x_m = node.parameter<double>("x_m", options.p_Root_m.x());
  if (!x_m) return x_m.error();
  auto y_m = node.parameter<double>("y_m", options.p_Root_m.y());
  if (!y_m) return y_m.error();
  if (!(*spread_m >= 0 && *spread_m <= 0.08)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameter spread_m is {}; expected 0 to 0.08", *spread_m)};
  }
  options.spread_m = *spread_m;
  options.p_Root_m = {*x_m, *y_m};
  // a thing beside which the hand works: put back before each attempt, and what leans on it is not held
  auto beside = node.parameter<std::string>("beside", "");
  if (!beside) return beside.error();
  auto hand = node.parameter<std::string>("hand", "right",
                                          {.about = "the hand that learns", .choices = {"right", "left"}});
  if (!hand) return hand.error();
  auto until_max = node.parameter<bool>("until_max", options.until_max);
  if (!until_max) return until_max.error();
  options.until_max = *until_max;
  options.pull_N = *pull_N;
  options.off_m = *off_m;
  options.turn_rad = *turn_rad;
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
  std::map<std::string, Box> boxes;
  std::vector<TrialResult> results;
  bool finished = false;
  return node.run([&](Time now) -> Status {
    if (finished) return {};
    if (!core) {
      // all of them lie on the table as the world file has put them there
      std::vector<double> heights;
      for (const std::string& object : options.objects) {
        auto box = box_of(node, object);
        if (!box) return box.error();
        boxes[object] = *box;
        heights.push_back(box->p_Root_m.z());
      }
      if (!beside->empty()) {
        auto box = box_of(node, *beside);
        if (!box) return box.error();
        if (*hand == "left") box->p_Root_m.y() *= -1;
        boxes[*beside] = *box;
      }
      core.emplace(options, heights, node.options().seed);
    }
    TrialInputs inputs;
    inputs.reach = newest(**reach_in);
    inputs.grasp = newest(**grasp_in);
    if (core->wants_height()) {
      auto box = box_of(node, core->object());
      if (!box) return box.error();
      inputs.object_height_m = box->p_Root_m.z();
      if (!beside->empty()) {
        auto other = touches_other(node, core->object());
        if (!other) return other.error();
        inputs.borne_by_other = *other;
      }
    }
    TrialOutputs out = core->step(node.options().period_s, inputs);
    if (*hand == "left") mirror(out);
    if (out.put) {
      if (!beside->empty()) {
        auto back = place(node, *beside, boxes[*beside].p_Root_m.head<2>(), boxes[*beside].frame_Root_m, 0.0);
        if (!back) return back;
      }
      auto there = place(node, out.put->object, out.put->p_Root_m, boxes[out.put->object].frame_Root_m,
                         out.put->yaw_rad);
      if (!there) return there;
    }
    if (out.pull) {
      // the world port's frame: x left, y up, z forward
      const Eigen::Vector3d& f = out.pull->f_Root_N;
      auto pulled = ask_world(node, fmt::format("world force \"{}\" {} {} {} {}", out.pull->object, -f.y(),
                                                f.z(), -f.x(), out.pull->duration_s));
      if (!pulled) return pulled.error();
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
