#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nido/goal_selection/goal_selection_core.h"

namespace nido {

// A table, eyes, an arm and fingers that do what is asked after a while, or fail as told. It stands for the
// other processes and what they sense, so that the order of things can be tested without them.
class FakeBody {
 public:
  struct Thing {
    std::string name;
    Eigen::Vector3d p;
    Eigen::Vector3d size{0.05, 0.05, 0.05};
  };

  std::map<std::string, Thing> things;
  std::set<std::string> hidden;           // seen only after a search
  std::map<std::string, int> fail_reach;  // action -> how often it fails
  std::map<std::string, int> fail_grasp;
  std::string reach_reason = "the arm stopped";
  int slips = 0;         // so many carries lose the object on the way
  int empty_grasps = 0;  // so many closings report success with nothing in the hand, pads on the table
  int misses = 0;        // so many releases fall beside the basket
  bool mute = false;     // nobody answers

  std::string held;
  std::vector<std::string> asked;  // "reach pregrasp", "grasp open", "look object blue cube", ...
  std::vector<ActionCommand> reach_commands;
  std::vector<std::string> grasp_objects;     // as the fingers are told
  std::map<std::string, std::string> shapes;  // of things whose names do not say it

  FakeBody() {
    put("blue cube", {-0.30, 0.10, -0.0576});
    put("red ball", {-0.35, -0.05, -0.0526});
    things["basket"] = {"basket", {-0.28, 0.25, -0.0526}, {0.18, 0.18, 0.06}};
  }
  void put(const std::string& name, const Eigen::Vector3d& p) { things[name] = {name, p}; }

  GoalSelectionInputs sense(double now) {
    GoalSelectionInputs in;
    // eyes at 30 Hz or so
    if (++tick_ % 3 == 0) {
      std::vector<SeenObject> seen;
      for (const auto& [name, thing] : things) {
        if (hidden.contains(name)) continue;
        SeenObject object;
        object.name = name;
        object.colour = name.substr(0, name.find(' '));
        object.shape = name.substr(name.find(' ') + 1);
        if (const auto shape = shapes.find(name); shape != shapes.end()) object.shape = shape->second;
        object.confidence = 0.9;
        object.p_RootObject_m = thing.p;
        object.size_m = thing.size;
        seen.push_back(object);
      }
      in.objects = seen;
    }
    GazeState gaze;
    gaze.mode = gaze_.mode;
    gaze.target = gaze_.target;
    const bool visible = things.contains(gaze_.target) && !hidden.contains(gaze_.target);
    gaze.fixated = gaze_.mode == "object" && visible && now > gaze_since_ + 0.5;
    gaze.search_done = gaze_.mode == "search" && now > gaze_since_ + 3.0;
    if (gaze_.mode == "search" && now > gaze_since_ + 1.0) hidden.erase(gaze_.target);
    in.gaze = gaze;
    std::array<bool, 6> touch{};
    touch[0] = touch[2] = !held.empty() || now < false_touch_until_;
    in.touch_on = in.left_touch_on = touch;
    answer(now, reach_, in.reach);
    answer(now, grasp_, in.grasp);
    return in;
  }

  void act(double now, const GoalSelectionOutputs& out) {
    for (const auto& gaze : out.gaze) {
      gaze_ = gaze;
      gaze_since_ = now;
      asked.push_back("look " + gaze.mode + " " + gaze.target);
    }
    for (const auto& command : out.grasp) {
      grasp_ = {command, now + 1.0, "", false};
      grasp_objects.push_back(command.object);
      asked.push_back("grasp " + command.action);
      if (fail_grasp[command.action]-- > 0) grasp_.reason = "the fingers met nothing";
    }
    for (const auto& command : out.reach) {
      reach_ = {command, now + 2.0, "", false};
      reach_commands.push_back(command);
      asked.push_back("reach " + command.action);
      if (command.action == "carry" && slips-- > 0) {
        things[held].p = {-0.36, 0.02, -0.0576};
        held.clear();
      }
      if (fail_reach[command.action]-- > 0) reach_.reason = reach_reason;
    }
  }

  [[nodiscard]] int count(const std::string& what) const {
    return static_cast<int>(std::count(asked.begin(), asked.end(), what));
  }

 private:
  struct Job {
    ActionCommand command;
    double ends = 0.0;
    std::string reason;
    bool over = true;
  };

  void answer(double now, Job& job, std::vector<ActionState>& states) {
    if (mute || job.command.id == 0) return;
    ActionState state;
    state.id = job.command.id;
    state.action = job.command.action;
    state.error_m = 0.004;
    state.state = "running";
    if (now >= job.ends) {
      state.state = job.reason.empty() ? "done" : "failed";
      state.reason = job.reason;
      if (!job.over) {
        job.over = true;
        if (job.reason.empty()) carry_out(job.command, now);
      }
    }
    states.push_back(state);
  }

  void carry_out(const ActionCommand& command, double now) {
    if (command.action == "grasp") {
      if (empty_grasps-- > 0) {
        false_touch_until_ = now + 10.0;
      } else {
        // hands are told the shape of a thing after its name
        for (const auto& [name, thing] : things) {
          if (command.object.starts_with(name)) held = name;
        }
      }
    } else if (command.action == "open") {
      held.clear();
      false_touch_until_ = 0.0;
    } else if (command.action == "lift" && !held.empty()) {
      things[held].p = command.p_RootTarget_m;
    } else if (command.action == "carry") {
      if (!held.empty()) {
        things[held].p = command.p_RootTarget_m;
      }
    } else if (command.action == "release" && !held.empty()) {
      things[held].p.z() = -0.05;
      if (misses-- > 0) things[held].p.y() -= 0.2;
      held.clear();
    }
  }

  int tick_ = 0;
  GazeCommand gaze_;
  double gaze_since_ = 0.0;
  double false_touch_until_ = 0.0;
  Job reach_;
  Job grasp_;
};

}  // namespace nido
