// nido-grasp-success: the experimenter of grasp-success (docs/grasp.md). It knows the truth of the world; the
// robot, which it tells what to grasp, sees and feels by itself.
#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "success_core.h"
#include "world_port.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::grasp;  // NOLINT(google-build-using-namespace)

constexpr double kTable_Root_m = -0.0826;  // top of the table of config/worlds/grasp_success.yaml

// The thing that lies on the table now.
class Stage {
 public:
  explicit Stage(Node& node) : node_(node) {}

  Status put(const SuccessThing& thing) {
    // things of the world file come from behind the robot and go back there; others are made and deleted
    made_.clear();
    lent_.clear();
    if (thing.shape == "bear") {
      lent_ = "teddy bear";
    } else if (thing.trained) {
      lent_ = thing.shape == "ball" ? "blue ball" : "blue cube";
    } else if (auto made = make(thing); !made) {
      return made;
    }
    const std::string& name = made_.empty() ? lent_ : made_;
    auto box = box_of(node_, name);
    if (!box) return box.error();
    home_ = *box;
    // its frame over its underside, as it stands upright
    const double frame_m = lent_ == "teddy bear" ? 0.0 : 0.5 * box->size_m.z();
    auto there = place(node_, name, thing.p_Root_m, kTable_Root_m + frame_m, thing.yaw_rad);
    if (!there) return there;
    auto now = box_of(node_, name);
    if (!now) return now.error();
    rest_m_ = now->p_Root_m.z();
    return {};
  }

  Status remove() {
    if (!made_.empty()) {
      auto deleted = ask_world(node_, "world del \"" + made_ + "\"");
      if (!deleted) return deleted.error();
    } else if (!lent_.empty()) {
      auto gone = place(node_, lent_, home_.p_Root_m.head<2>(), home_.frame_Root_m, 0.0);
      if (!gone) return gone;
    }
    made_.clear();
    lent_.clear();
    return {};
  }

  Result<double> above_rest_m() {
    auto box = box_of(node_, made_.empty() ? lent_ : made_);
    if (!box) return box.error();
    return box->p_Root_m.z() - rest_m_;
  }

 private:
  Status make(const SuccessThing& thing) {
    const std::string kind = thing.shape == "cylinder" ? "cyl" : thing.shape == "ball" ? "sph" : "box";
    const std::string sizes = kind == "cyl"   ? fmt::format("{} {}", thing.width_m / 2, thing.height_m)
                              : kind == "sph" ? fmt::format("{}", thing.width_m / 2)
                                              : fmt::format("{0} {0} {1}", thing.width_m, thing.height_m);
    // blue; made over the table's far end, where nothing is, then put into its place
    const Eigen::Vector3d p = world_of_root({-0.55, -0.25, 0.2});
    auto made = ask_world(
        node_, fmt::format("world mk {} {} {} {} {} 0.05 0.12 0.85", kind, sizes, p.x(), p.y(), p.z()));
    if (!made) return made.error();
    auto count = ask_world(node_, "world num " + kind);
    if (!count) return count.error();
    auto named = ask_world(node_, fmt::format("world name {} {} thing", kind, *count));
    if (!named) return named.error();
    made_ = "thing";
    return {};
  }

  Node& node_;
  std::string made_;   // name of a made thing
  std::string lent_;   // name of one of the world file
  Box home_;           // where that one waits
  double rest_m_ = 0;  // height of the thing's middle on the table
};

msgs::ActionGoal goal_message(const SuccessOutputs::Action& action, Time now) {
  msgs::ActionGoal goal;
  goal.header(header_at(now, "root"));
  goal.id(action.id);
  goal.action(action.action);
  return goal;
}

void take_newest(Input<msgs::ActionStatus>& port, std::optional<SuccessInputs::Done>& done) {
  while (auto status = port.take()) done = SuccessInputs::Done{status->id(), status->state() != "running"};
}

Status save(const std::vector<SuccessResult>& results, const std::string& path) {
  nlohmann::json rows = nlohmann::json::array();
  for (const SuccessResult& r : results) {
    rows.push_back({{"number", r.number},
                    {"shape", r.thing.shape},
                    {"trained", r.thing.trained},
                    {"width_m", r.thing.width_m},
                    {"height_m", r.thing.height_m},
                    {"x_m", r.thing.p_Root_m.x()},
                    {"y_m", r.thing.p_Root_m.y()},
                    {"yaw_rad", r.thing.yaw_rad},
                    {"success", r.success},
                    {"held_s", r.held_s},
                    {"closings", r.closings},
                    {"slips_noticed", r.slips_noticed},
                    {"said_so", r.said_so},
                    {"sentence", r.sentence}});
  }
  std::ofstream file(path);
  file << rows.dump(1) << '\n';
  return file ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path}};
}

Status run(Node& node) {
  SuccessOptions options;
  options.seed = node.options().seed;
  auto first = node.parameter<int>("first", options.first);
  if (!first) return first.error();
  auto count = node.parameter<int>("count", options.count);
  if (!count) return count.error();
  auto results_path = node.parameter<std::string>("results", "success.json");
  if (!results_path) return results_path.error();
  if (*first < 0 || *count < 1) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameters first and count are {} and {}; expected 0 or more and 1 or more",
                             *first, *count)};
  }
  auto hand = node.parameter<std::string>("hand", options.hand, {.about = "", .choices = {"right", "left"}});
  if (!hand) return hand.error();
  options.hand = *hand;
  options.first = *first;
  options.count = *count;

  auto stage_in = node.open_input<msgs::StageEvent>("/grasp_success/stage:i", Profile::kEvent, 64);
  if (!stage_in) return stage_in.error();
  auto reach_in = node.open_input<msgs::ActionStatus>("/grasp_success/reach_status:i", Profile::kEvent, 64);
  if (!reach_in) return reach_in.error();
  auto grasp_in = node.open_input<msgs::ActionStatus>("/grasp_success/grasp_status:i", Profile::kEvent, 64);
  if (!grasp_in) return grasp_in.error();
  auto heard_out = node.open_output<msgs::Heard>("/grasp_success/heard:o", Profile::kEvent);
  if (!heard_out) return heard_out.error();
  auto reach_out = node.open_output<msgs::ActionGoal>("/grasp_success/reach:o", Profile::kEvent);
  if (!reach_out) return reach_out.error();
  auto grasp_out = node.open_output<msgs::ActionGoal>("/grasp_success/grasp:o", Profile::kEvent);
  if (!grasp_out) return grasp_out.error();
  auto outcome_out = node.open_output<msgs::StageEvent>("/grasp_success/outcome:o", Profile::kState);
  if (!outcome_out) return outcome_out.error();
  node.set_ready();

  SuccessCore core(options);
  Stage stage(node);
  std::vector<SuccessResult> results;
  return node.run([&](Time now) -> Status {
    SuccessInputs inputs;
    take_newest(**reach_in, inputs.reach);
    take_newest(**grasp_in, inputs.grasp);
    while (auto line = (*stage_in)->take())
      inputs.stages.push_back({line->stage(), line->state(), line->text()});
    if (core.wants_height()) {
      auto above = stage.above_rest_m();
      if (!above) return above.error();
      inputs.above_rest_m = *above;
    }
    const SuccessOutputs out = core.step(node.options().period_s, inputs);
    if (out.result) {
      results.push_back(*out.result);
      const SuccessResult& r = *out.result;
      node.log_info(fmt::format("{} {} {:.0f} mm at {:.3f} {:.3f}: {} after {:.1f} s, {} closings: {}",
                                r.number, r.thing.shape, 1000 * r.thing.width_m, r.thing.p_Root_m.x(),
                                r.thing.p_Root_m.y(), r.success ? "held" : "not held", r.held_s, r.closings,
                                r.sentence));
      if (auto saved = save(results, *results_path); !saved) return saved;
    }
    if (out.remove) {
      if (auto removed = stage.remove(); !removed) return removed;
    }
    if (out.put) {
      if (auto there = stage.put(*out.put); !there) return there;
    }
    if (out.reach) {
      if (auto sent = (*reach_out)->write(goal_message(*out.reach, now)); !sent) return sent;
    }
    if (out.grasp) {
      if (auto sent = (*grasp_out)->write(goal_message(*out.grasp, now)); !sent) return sent;
    }
    if (out.say) {
      msgs::Heard heard;
      heard.header(header_at(now));
      heard.text(*out.say);
      heard.confidence(1.0);
      heard.accepted(true);
      if (auto sent = (*heard_out)->write(heard); !sent) return sent;
    }
    if (out.finished) {
      msgs::StageEvent end;
      end.header(header_at(now));
      end.stage("outcome");
      end.state("done");
      end.text(fmt::format("{} things tried", results.size()));
      if (auto sent = (*outcome_out)->write(end); !sent) return sent;
    }
    return {};
  });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "grasp_success", run); }
