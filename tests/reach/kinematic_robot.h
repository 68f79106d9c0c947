#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "nido/kinematics/robot_model.h"
#include "nido/reach/arm_chain.h"
#include "nido/reach/reach_core.h"

namespace nido::reach {

inline ArmChain right_arm() {
  static const ArmChain chain = [] {
    auto model = RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf");
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    return ArmChain::from_model(*model, "right").value();
  }();
  return chain;
}

// Arm and eyes without physics: joints follow their targets with a lag, and the eyes see the mark with a
// smooth error that depends on where it is, plus noise.
class KinematicRobot {
 public:
  explicit KinematicRobot(const Joints& q, std::uint64_t seed = 1, const ArmChain& chain = right_arm())
      : q_(q), random_(seed), chain_(chain) {}

  void step(const std::optional<Joints>& target) {
    if (target) q_ += 0.3 * (*target - q_) + push_rad_;
    time_s_ += 0.01;
  }
  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] const Joints& q() const { return q_; }
  // Somebody leads the arm: so much a tick.
  void push(const Joints& by_rad) { push_rad_ = by_rad; }
  // Somebody knocked against the head: everything is seen so far off from now on.
  void bump_eyes(const Eigen::Vector3d& by_m) { bump_m_ = by_m; }

  // What the eyes would say about something that is really at p.
  static Eigen::Vector3d seen(const Eigen::Vector3d& p) {
    return p + 0.01 * Eigen::Vector3d(std::sin(4.0 * p.y()) + 0.3, std::cos(5.0 * p.x()) - 0.5,
                                      0.6 + 3.0 * p.x());
  }
  static Eigen::Vector3d mark_Palm_m() { return {0.01, 0.002, -0.02}; }
  [[nodiscard]] Eigen::Vector3d seen_palm() const { return see(chain_.X_RootPalm(q_).translation()); }
  [[nodiscard]] Eigen::Vector3d see(const Eigen::Vector3d& p) const { return seen(p) + bump_m_; }

  HandSighting look(double noise_m = 0.002) {
    std::normal_distribution<double> noise(0.0, noise_m);
    const Eigen::Vector3d p = chain_.X_RootPalm(q_) * mark_Palm_m();
    return {time_s_, see(p) + Eigen::Vector3d(noise(random_), noise(random_), noise(random_)), 0.9};
  }

 private:
  Joints q_;
  std::mt19937_64 random_;
  ArmChain chain_;
  Joints push_rad_ = Joints::Zero();
  Eigen::Vector3d bump_m_ = Eigen::Vector3d::Zero();
  double time_s_ = 0.0;
};

}  // namespace nido::reach
