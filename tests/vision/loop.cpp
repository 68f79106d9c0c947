#include "loop.h"

#include <gtest/gtest.h>

namespace nido::test {

Loop::Loop(Stage& stage, const vision::TemplateSet& templates)
    : stage_(stage), core_(need(vision::VisionCore::create(stage.model(), templates, {}))) {}

double Loop::run(double duration_s, const std::function<bool(const vision::VisionOutputs&)>& done) {
  const double begin_s = stage_.simulation().time_s();
  const int head = stage_.simulation().part_index("head");
  while (stage_.simulation().time_s() - begin_s < duration_s - 1e-9) {
    EXPECT_TRUE(stage_.simulation().step().ok());
    vision::VisionInputs in = stage_.inputs(tick_++ % 3 == 0);
    in.gaze = goal_;
    goal_.reset();
    in.called = called_;
    called_.reset();
    vision::VisionOutputs out = core_->step(Time{stage_.simulation().time_ns()}, std::move(in));
    EXPECT_TRUE(out.warnings.empty()) << out.warnings.front();
    if (!out.pictures_stamp) {
      out.objects = std::move(last_.objects);
      out.hands = last_.hands;
    }
    if (out.gaze) {
      EXPECT_TRUE(stage_.simulation().command_all(head, sim::JointMode::kDirect, out.gaze->command_rad).ok());
    }
    last_ = std::move(out);
    if (done && done(last_)) break;
  }
  return stage_.simulation().time_s() - begin_s;
}

}  // namespace nido::test
