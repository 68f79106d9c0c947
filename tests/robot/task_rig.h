#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fake/fake_control_board.h"
#include "limits/limited_control_board.h"
#include "rigs.h"
#include "task/cartesian_arm.h"
#include "task/head_gaze.h"
#include "task_control_rig.h"

namespace nido::test {

inline RobotModel task_model() { return required(RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf")); }

// The right hand and the gaze on fake boards under their limits.
class FakeTaskRig : public TaskRig {
 public:
  FakeTaskRig() {
    for (const char* part : {"torso", "right_arm", "head"}) {
      std::vector<FakeJoint> joints;
      for (const Axis& axis :
           model_.parts()[static_cast<std::size_t>(required(model_.part_index(part)))].axes) {
        joints.push_back({axis.name,
                          {axis.lower_rad, axis.upper_rad, axis.velocity_rad_s, axis.effort_Nm},
                          axis.home_rad,
                          axis.reference_speed_rad_s});
      }
      boards_.push_back(std::make_unique<FakeControlBoard>(std::move(joints)));
      LimitOptions limits;
      limits.part = part;
      limits.safety = safety_;
      limited_.push_back(required(LimitedControlBoard::create(*boards_.back(), clock_, std::move(limits))));
    }
    hand_ = required(CartesianArm::create(model_, "right", *limited_[1], *limited_[0], true, clock_));
    gaze_ = required(HeadGaze::create(task_model(), PinholeCamera{}, *limited_[2], *limited_[0], clock_));
  }
  const std::shared_ptr<Safety>& safety() const { return safety_; }
  ICartesianControl& hand() override { return *hand_; }
  IGazeControl& gaze() override { return *gaze_; }
  void advance() override {
    const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
    for (ISteppable* commander :
         {static_cast<ISteppable*>(hand_.get()), static_cast<ISteppable*>(gaze_.get())}) {
      if (const Status stepped = commander->step_to(next_ns); !stepped)
        throw std::runtime_error(stepped.error().message);
    }
    for (const auto& board : limited_) required_ok(board->step_to(next_ns));
    for (const auto& board : boards_) required_ok(board->step_to(next_ns));
    clock_.set_ns(next_ns);
  }

 private:
  static void required_ok(const Status& status) {
    if (!status) throw std::runtime_error(status.error().message);
  }
  RobotModel model_ = task_model();
  ManualClock clock_;
  std::shared_ptr<Safety> safety_ = std::make_shared<Safety>(SafetyOptions{}, clock_);
  std::vector<std::unique_ptr<FakeControlBoard>> boards_;
  std::vector<std::unique_ptr<LimitedControlBoard>> limited_;
  std::unique_ptr<CartesianArm> hand_;
  std::unique_ptr<HeadGaze> gaze_;
};

}  // namespace nido::test
