#include "physics_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

namespace nido::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kBall_m = 0.03;

// forearms level and forward, palms up, fingers open; then they close on a ball
constexpr std::array<double, 16> kArm_deg = {-25, 25, 0, 75, 0, 0, 0, 53, 70, 2, 2, 48, 9, 48, 9, 11};
constexpr std::array<double, 9> kClosed_deg = {53, 70, 70, 117, 89, 114, 89, 114, 212};
constexpr double kClosing_s = 0.4;

}  // namespace

Result<PhysicsScene> PhysicsScene::create(const std::string& urdf_path) {
  auto model = RobotModel::load(urdf_path);
  if (!model) return model.error();
  PhysicsScene scene(std::move(*model));
  scene.urdf_path_ = urdf_path;
  const RobotModel& robot = scene.model_;
  Eigen::VectorXd axes = robot.home_axes();
  scene.table_ = {"table", false, {0.4, 0.7, 0.02}, {-0.48, 0, kTableTop_m - 0.01}, 0};
  for (const char* side : {"left", "right"}) {
    const auto part = robot.part_index(std::string(side) + "_arm");
    const auto hand = robot.hand(side);
    if (!part || !hand) return part ? hand.error() : part.error();
    const int first = robot.parts()[static_cast<std::size_t>(*part)].first_axis;
    for (std::size_t j = 0; j < kArm_deg.size(); ++j)
      axes[first + static_cast<int>(j)] = kArm_deg[j] * kDegree;
    // the palm looks along z of its frame on the right, against it on the left: turn the forearm until that
    // is up
    const double out = std::string(side) == "right" ? 1 : -1;
    const int turn = first + 4;
    const int bend = first + 5;
    double best = -2;
    Eigen::Vector2d found = Eigen::Vector2d::Zero();
    for (double a = robot.axis(turn).lower_rad; a <= robot.axis(turn).upper_rad; a += kDegree) {
      for (double b = robot.axis(bend).lower_rad / 2; b <= robot.axis(bend).upper_rad / 2; b += kDegree) {
        axes[turn] = a;
        axes[bend] = b;
        const double up = out * robot.X_RootLink(hand->frame, axes).linear()(2, 2);
        if (up > best) {
          best = up;
          found = {a, b};
        }
      }
    }
    axes[turn] = found.x();
    axes[bend] = found.y();
    const Eigen::Isometry3d X = robot.X_RootLink(hand->frame, axes);
    const Eigen::Vector3d p = X * Eigen::Vector3d(0.009, -0.001, out * kBall_m);
    scene.things_.push_back({std::string(side) + " ball", true, {kBall_m, 0, 0}, p, 0.08});
  }
  scene.posture_rad_ = robot.clamped(axes);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p(-0.36 - 0.08 * (i / 4), -0.15 + 0.1 * (i % 4), kTableTop_m + 0.025);
    const bool ball = i % 2 == 1;
    scene.things_.push_back({"thing " + std::to_string(i), ball,
                             ball ? Eigen::Vector3d(0.025, 0, 0) : Eigen::Vector3d(0.05, 0.05, 0.05), p,
                             0.08});
  }
  return scene;
}

std::string PhysicsScene::world_yaml() const {
  std::ostringstream yaml;
  yaml << "table: {top_center_m: [" << table_.p_Root_m.x() << ", 0, " << kTableTop_m << "], size_m: ["
       << table_.size_m.x() << ", " << table_.size_m.y() << "]}\nposture_deg:\n";
  for (const Part& part : model_.parts()) {
    yaml << "  " << part.name << ": [";
    for (std::size_t j = 0; j < part.axes.size(); ++j)
      yaml << (j == 0 ? "" : ", ") << posture_rad_[part.first_axis + static_cast<int>(j)] / kDegree;
    yaml << "]\n";
  }
  return yaml.str();
}

Eigen::VectorXd PhysicsScene::axes_rad(double time_s) const {
  Eigen::VectorXd axes = posture_rad_;
  for (const char* arm : {"left_arm", "right_arm"}) {
    const int first = model_.parts()[static_cast<std::size_t>(*model_.part_index(arm))].first_axis + 7;
    for (std::size_t j = 0; j < kClosed_deg.size(); ++j) {
      double& angle = axes[first + static_cast<int>(j)];
      angle += std::min(time_s / kClosing_s, 1.0) * (kClosed_deg[j] * kDegree - angle);
    }
  }
  for (int a = 0; a < model_.axis_count(); ++a) {
    const double frequency_Hz = 0.3 + 0.01 * (a % 17);
    const double amplitude_rad = 0.03;
    // begins at the posture and at rest
    axes[a] += amplitude_rad * (1 - std::cos(2 * std::numbers::pi * frequency_Hz * time_s)) *
               (a % 2 == 0 ? 0.5 : -0.5);
  }
  return model_.clamped(axes);
}

}  // namespace nido::bench
