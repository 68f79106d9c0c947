#include "grasp_trial.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <numbers>
#include <random>
#include <stdexcept>

namespace nido::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kArmJoints = 7;

// from 0 to 1 with rest at both ends
double minimum_jerk(double u) { return u * u * u * (10 - 15 * u + 6 * u * u); }

void require(bool fine, const std::string& what) {
  if (!fine) throw std::runtime_error(what);
}

class Mover {
 public:
  Mover(Simulation& simulation, const ArmReach& reach) : sim_(simulation), reach_(reach) {
    arm_ = sim_.part_index("right_arm");
    torso_ = sim_.part_index("torso");
  }
  void send(const Eigen::VectorXd& axes) {
    static constexpr std::array<int, kArmJoints> kArm = {0, 1, 2, 3, 4, 5, 6};
    static constexpr std::array<int, 2> kTorso = {0, 2};
    std::array<double, kArmJoints> arm{};
    for (int i = 0; i < kArmJoints; ++i) arm[i] = axes[reach_.first_arm_axis() + i];
    const std::array<double, 2> torso = {axes[reach_.first_torso_axis()],
                                         axes[reach_.first_torso_axis() + 2]};
    require(sim_.command(arm_, JointMode::kDirect, kArm, arm).ok(), "arm command");
    require(sim_.command(torso_, JointMode::kDirect, kTorso, torso).ok(), "torso command");
  }
  void along(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double duration_s) {
    const int steps = static_cast<int>(duration_s / Simulation::kControlPeriod_s);
    for (int i = 1; i <= steps; ++i) {
      send(from + minimum_jerk(static_cast<double>(i) / steps) * (to - from));
      wait(Simulation::kControlPeriod_s);
    }
  }
  void wait(double duration_s) {
    const Status done = sim_.step(duration_s);
    require(done.ok(), done.ok() ? "" : done.error().message);
  }
  void fingers(const std::array<double, 9>& angle_rad, double speed_rad_s) {
    static constexpr std::array<int, 9> kFingers = {7, 8, 9, 10, 11, 12, 13, 14, 15};
    for (const int joint : kFingers)
      require(sim_.set_reference_speed(arm_, joint, speed_rad_s).ok(), "speed");
    require(sim_.command(arm_, JointMode::kPosition, kFingers, angle_rad).ok(), "finger command");
  }
  void place(const Eigen::VectorXd& axes, const std::array<double, 9>& fingers_rad) {
    std::array<double, 16> arm{};
    for (int i = 0; i < kArmJoints; ++i) arm[i] = axes[reach_.first_arm_axis() + i];
    std::copy(fingers_rad.begin(), fingers_rad.end(), arm.begin() + kArmJoints);
    const std::array<double, 3> torso = {axes[reach_.first_torso_axis()], 0,
                                         axes[reach_.first_torso_axis() + 2]};
    require(sim_.place_joints(torso_, torso).ok() && sim_.place_joints(arm_, arm).ok(), "placing the arm");
  }

 private:
  Simulation& sim_;
  const ArmReach& reach_;
  int arm_ = 0;
  int torso_ = 0;
};

}  // namespace

std::map<std::string, GraspPosture> read_postures(const std::string& path) {
  const YAML::Node file = YAML::LoadFile(path);
  std::map<std::string, GraspPosture> postures;
  for (const auto& entry : file["shapes"]) {
    const YAML::Node& node = entry.second;
    GraspPosture p;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) p.R_RootPalm(i, j) = node["R_RootPalm"][i][j].as<double>();
      p.p_PalmObject_m[i] = node["p_PalmObject_m"][i].as<double>();
      p.approach_m[i] = node["approach_m"][i].as<double>();
    }
    p.R_RootPalm = Eigen::Quaterniond(p.R_RootPalm).normalized().toRotationMatrix();
    for (std::size_t i = 0; i < 9; ++i) {
      p.preshape_rad[i] = kDegree * node["preshape_deg"][i].as<double>();
      p.close_rad[i] = kDegree * node["close_deg"][i].as<double>();
    }
    p.close_speed_rad_s = kDegree * node["close_speed_deg_s"].as<double>();
    p.close_time_s = node["close_time_s"].as<double>();
    postures[entry.first.as<std::string>()] = p;
  }
  return postures;
}

ArmReach::ArmReach(const RobotModel& model) : model_(model) {
  palm_ = *model.link_index("r_hand");
  arm_ = model.parts()[static_cast<std::size_t>(*model.part_index("right_arm"))].first_axis;
  torso_ = model.parts()[static_cast<std::size_t>(*model.part_index("torso"))].first_axis;
  for (int i = 0; i < kArmJoints; ++i) axes_.push_back(arm_ + i);
  axes_.push_back(torso_);
  axes_.push_back(torso_ + 2);
}

double ArmReach::solve(Eigen::VectorXd& q, const Eigen::Isometry3d& X_RootPalm, int iterations) const {
  constexpr double kTurnWeight_m = 0.3;
  double cost = 0;
  for (int it = 0; it <= iterations; ++it) {
    const Eigen::Isometry3d X = model_.X_RootLink(palm_, q);
    Eigen::Matrix<double, 6, 1> e;
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(X_RootPalm.linear() * X.linear().transpose()));
    e.head<3>() = X_RootPalm.translation() - X.translation();
    e.tail<3>() = kTurnWeight_m * turn.angle() * turn.axis();
    cost = e.head<3>().norm() + 0.1 * std::abs(turn.angle());
    if (cost < 2e-4 || it == iterations) break;
    if (e.norm() > 0.1) e *= 0.1 / e.norm();
    Eigen::MatrixXd J = model_.jacobian(palm_, q, axes_);
    J.bottomRows(3) *= kTurnWeight_m;
    const auto n = static_cast<Eigen::Index>(axes_.size());
    const Eigen::VectorXd dq =
        (J.transpose() * J + 1e-4 * Eigen::MatrixXd::Identity(n, n)).ldlt().solve(J.transpose() * e);
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      const Axis& axis = model_.axis(axes_[i]);
      q[axes_[i]] = std::clamp(q[axes_[i]] + dq[static_cast<Eigen::Index>(i)], axis.lower_rad + 0.02,
                               axis.upper_rad - 0.02);
    }
  }
  return cost;
}

double ArmReach::search(Eigen::VectorXd& q, const Eigen::Isometry3d& X_RootPalm) const {
  std::mt19937 random(7);
  double best = 1e9;
  Eigen::VectorXd found = q;
  for (int start = 0; start < 4 && best > 1e-3; ++start) {
    Eigen::VectorXd trial = q;
    for (const int axis : axes_) {
      if (start == 0) break;
      const Axis& a = model_.axis(axis);
      trial[axis] = a.lower_rad + (a.upper_rad - a.lower_rad) * static_cast<double>(random() % 1000) / 1000;
    }
    const double cost = solve(trial, X_RootPalm, 80);
    if (cost < best) {
      best = cost;
      found = trial;
    }
  }
  q = found;
  return best;
}

GraspResult try_grasp(Simulation& sim, const ArmReach& reach, const GraspPosture& posture,
                      const GraspTrial& trial) {
  GraspResult result;
  const ObjectState before = *sim.object(trial.object);
  // middle of the object's box: what eyes would see
  const auto middle = [&] {
    const ObjectState o = *sim.object(trial.object);
    const bool feet = o.kind == "bear";
    return Eigen::Vector3d(o.X_WorldObject * Eigen::Vector3d(0, 0, feet ? o.size_m.z() / 2 : 0));
  };
  const Eigen::Vector3d p_RootObject = middle() + trial.error_Root_m;

  // the first turn about the vertical that the arm reaches
  Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();
  Eigen::VectorXd at;
  Eigen::VectorXd above;
  std::vector<Eigen::VectorXd> lift;
  bool reached = false;
  for (const double turn_deg : {0, 10, -10, 20, -20, 30, -30, 45, -45}) {
    X_RootPalm.linear() =
        Eigen::AngleAxisd(turn_deg * kDegree, Eigen::Vector3d::UnitZ()) * posture.R_RootPalm;
    X_RootPalm.translation() = p_RootObject - X_RootPalm.linear() * posture.p_PalmObject_m;
    at = reach.model().home_axes();
    if (reach.search(at, X_RootPalm) > 0.002) continue;
    above = at;
    if (reach.solve(above, Eigen::Translation3d(posture.approach_m) * X_RootPalm, 150) > 0.004) continue;
    Eigen::VectorXd q = at;
    lift.clear();
    double cost = 0;
    for (int i = 1; i <= 20; ++i) {
      const double height = 0.10 * minimum_jerk(i / 20.0);
      cost = reach.solve(q, Eigen::Translation3d(0, 0, height) * X_RootPalm, 20);
      lift.push_back(q);
    }
    if (cost > 0.01) continue;
    reached = true;
    break;
  }
  if (!reached) {
    result.trouble = "out of reach";
    return result;
  }

  Mover move(sim, reach);
  move.place(above, posture.preshape_rad);
  move.along(above, at, 0.8);
  move.wait(0.15);
  move.fingers(posture.close_rad, posture.close_speed_rad_s);
  move.wait(posture.close_time_s);
  Eigen::VectorXd last = at;
  for (const Eigen::VectorXd& q : lift) {
    move.along(last, q, 0.05);
    last = q;
  }
  const auto in_palm = [&] { return Eigen::Vector3d(sim.X_WorldLink("r_hand")->inverse() * middle()); };
  const Eigen::Vector3d p_Palm0 = in_palm();
  move.wait(trial.hold_s);
  result.hold = *sim.hold(trial.object);
  result.slip_m = (in_palm() - p_Palm0).norm();
  result.lifted_m =
      sim.object(trial.object)->X_WorldObject.translation().z() - before.X_WorldObject.translation().z();
  if (trial.basket.empty() || !result.hold.held()) return result;

  // over the basket's middle, any turn, then open
  const Eigen::Vector3d p_RootBasket = sim.object(trial.basket)->X_WorldObject.translation();
  Eigen::Isometry3d X_Carry = X_RootPalm;
  const Eigen::Vector3d p_PalmHeld = in_palm();
  Eigen::VectorXd over = last;
  double best = 1e9;
  for (const double turn_deg : {0, -15, -30, -45, 15}) {
    Eigen::VectorXd q = last;
    X_Carry.linear() = Eigen::AngleAxisd(turn_deg * kDegree, Eigen::Vector3d::UnitZ()) * X_RootPalm.linear();
    X_Carry.translation() = p_RootBasket + Eigen::Vector3d(0, 0, 0.13) - X_Carry.linear() * p_PalmHeld;
    const double cost = reach.search(q, X_Carry);
    if (cost < best) {
      best = cost;
      over = q;
    }
    if (best < 0.003) break;
  }
  move.along(last, over, 2.0);
  move.wait(0.3);
  // wide open: the fingers' shape before the grasp still goes round the thing. The thumb swings back last:
  // bent, it wedges a bear between its root and the palm.
  std::array<double, 9> open{};
  open[0] = posture.preshape_rad[0];
  open[1] = posture.close_rad[1];
  move.fingers(open, posture.close_speed_rad_s);
  move.wait(1.2);
  open[1] = 20 * kDegree;
  move.fingers(open, posture.close_speed_rad_s);
  move.wait(0.8);
  result.in_basket = *sim.is_inside(trial.object, trial.basket);
  return result;
}

}  // namespace nido::sim
