#pragma once

#include <functional>

#include "stage.h"

namespace nido::test {

// Vision with its hands on the simulated head: pictures every 30 ms, encoders and commands every 10 ms, as in
// a run.
class Loop {
 public:
  Loop(Stage& stage, const vision::TemplateSet& templates);

  void set_goal(const vision::GazeGoal& goal) { goal_ = goal; }
  // Somebody says what the thing in the middle of the view is called.
  void call(const std::string& name) { called_ = name; }
  // Runs for `duration_s` or until `done(outputs)` after a tick; the time it took, s.
  double run(double duration_s, const std::function<bool(const vision::VisionOutputs&)>& done = {});
  [[nodiscard]] const vision::TemplateSet& templates() const { return core_->templates(); }
  // Of the last tick; the things and hands are those of the last pictures.
  [[nodiscard]] const vision::VisionOutputs& last() const { return last_; }

 private:
  Stage& stage_;
  std::unique_ptr<vision::VisionCore> core_;
  std::optional<vision::GazeGoal> goal_;
  std::optional<std::string> called_;
  vision::VisionOutputs last_;
  int tick_ = 0;
};

}  // namespace nido::test
