#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "fake/fake_control_board.h"
#include "limits/limited_control_board.h"
#include "rigs.h"
#include "task/body_frames.h"
#include "task/cartesian_arm.h"
#include "task/head_gaze.h"
#include "task_control_rig.h"

namespace nido::test {

inline RobotModel task_model() { return required(RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf")); }

// The right hand, the gaze and the frames on boards of a family, under their limits.
class LocalTaskRig : public TaskRig {
 public:
  const std::shared_ptr<Safety>& safety() const { return safety_; }
  ICartesianControl& hand() override { return *hand_; }
  IGazeControl& gaze() override { return *gaze_; }
  IFrameTransforms& frames() override { return *frames_; }
  void advance() override {
    const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
    for (ISteppable* commander :
         {static_cast<ISteppable*>(hand_.get()), static_cast<ISteppable*>(gaze_.get())}) {
      must(commander->step_to(next_ns));
    }
    for (const auto& board : limited_) must(board->step_to(next_ns));
    must(step(next_ns));
    clock_.set_ns(next_ns);
  }
  // Time passes, and the boards tell nothing new.
  void let_encoders_age(double for_s) {
    clock_.set_ns(clock_.now_ns() + static_cast<std::int64_t>(for_s * 1e9));
  }

 protected:
  static constexpr std::array<const char*, 3> kParts = {"torso", "right_arm", "head"};
  // The boards of kParts, which this outlives.
  void put(const std::array<IControlBoard*, 3>& boards) {
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      LimitOptions limits;
      limits.part = kParts[part];
      limits.safety = safety_;
      limited_.push_back(required(LimitedControlBoard::create(*boards[part], clock_, std::move(limits))));
    }
    hand_ = required(CartesianArm::create(model_, "right", *limited_[1], *limited_[0], true, clock_));
    gaze_ = required(HeadGaze::create(task_model(), PinholeCamera{}, *limited_[2], *limited_[0], clock_));
    frames_ = required(
        BodyFrames::create(task_model(), {limited_[0].get(), limited_[1].get(), limited_[2].get()}, clock_));
  }
  virtual Status step(std::int64_t now_ns) = 0;
  static void must(const Status& status) {
    if (!status) throw std::runtime_error(status.error().message);
  }
  [[nodiscard]] const RobotModel& model() const { return model_; }

 private:
  RobotModel model_ = task_model();
  ManualClock clock_;
  std::shared_ptr<Safety> safety_ = std::make_shared<Safety>(SafetyOptions{}, clock_);
  std::vector<std::unique_ptr<LimitedControlBoard>> limited_;
  std::unique_ptr<CartesianArm> hand_;
  std::unique_ptr<HeadGaze> gaze_;
  std::unique_ptr<BodyFrames> frames_;
};

class FakeTaskRig : public LocalTaskRig {
 public:
  FakeTaskRig() {
    std::array<IControlBoard*, 3> boards{};
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      std::vector<FakeJoint> joints;
      for (const Axis& axis :
           model().parts()[static_cast<std::size_t>(required(model().part_index(kParts[part])))].axes) {
        joints.push_back({axis.name,
                          {axis.lower_rad, axis.upper_rad, axis.velocity_rad_s, axis.effort_Nm},
                          axis.home_rad,
                          axis.reference_speed_rad_s});
      }
      boards_.push_back(std::make_unique<FakeControlBoard>(std::move(joints)));
      boards[part] = boards_.back().get();
    }
    put(boards);
  }

 protected:
  Status step(std::int64_t now_ns) override {
    for (const auto& board : boards_) must(board->step_to(now_ns));
    return {};
  }

 private:
  std::vector<std::unique_ptr<FakeControlBoard>> boards_;
};

}  // namespace nido::test
