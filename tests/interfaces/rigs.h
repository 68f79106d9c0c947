#pragma once

// Rigs that the contract suites are run on: fake and simulated boards, as they are and under their limits.

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "control_board_rig.h"
#include "fake/fake_control_board.h"
#include "limits/limited_control_board.h"
#include "nido/interfaces/clock.h"

namespace nido::test {

inline constexpr std::int64_t kPeriod_ns = 10'000'000;

// Ends the test program when a rig cannot be made: nothing can be tested then.
template <class T>
T required(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(result).value();
}

inline std::vector<FakeJoint> three_joints() {
  return {{"shoulder", {-1.0, 1.5, 2.0, 10.0}, 0.2, 0.5},
          {"elbow", {0.2, 1.9, 2.0, 5.0}, 0.5, 0.5},
          {"wrist", {-0.6, 0.6, 3.0, 2.0}, 0.0, 0.5}};
}

// A board, its time, and on request the limits layer over it.
class LocalRig : public ControlBoardRig {
 public:
  IControlBoard& board() override { return limited_ ? static_cast<IControlBoard&>(*limited_) : device(); }
  void advance() override {
    const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
    if (limited_) must(limited_->step_to(next_ns));
    must(step(next_ns));
    clock_.set_ns(next_ns);
  }
  ManualClock& clock() { return clock_; }

  void put_limits(LimitOptions options = {}) {
    limited_ = required(LimitedControlBoard::create(device(), clock_, std::move(options)));
  }

 protected:
  virtual IControlBoard& device() = 0;
  virtual Status step(std::int64_t now_ns) = 0;
  static void must(const Status& status) {
    if (!status) throw std::runtime_error(status.error().message);
  }

 private:
  ManualClock clock_;
  std::unique_ptr<LimitedControlBoard> limited_;
};

class FakeRig final : public LocalRig {
 public:
  explicit FakeRig(std::vector<FakeJoint> joints = three_joints()) : fake_(std::move(joints)) {}
  FakeControlBoard& fake() { return fake_; }
  int free_joint() override { return 0; }

 protected:
  IControlBoard& device() override { return fake_; }
  Status step(std::int64_t now_ns) override { return fake_.step_to(now_ns); }

 private:
  FakeControlBoard fake_;
};

}  // namespace nido::test
