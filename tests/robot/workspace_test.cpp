// Borders of the workspace: what no command may do with a hand, whatever it is.

#include "limits/workspace.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fake/fake_control_board.h"
#include "limits/limited_control_board.h"
#include "rigs.h"
#include "simulated_rig.h"

namespace nido::test {
namespace {

const std::vector<std::string> kParts = {"torso", "left_arm", "right_arm"};

RobotModel body() { return required(RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf")); }

WorkspaceRule rule_of(const std::string& name, std::vector<std::string> links, double radius_m,
                      WorkspaceRule::Kind kind) {
  WorkspaceRule rule;
  rule.name = name;
  rule.links = std::move(links);
  rule.radius_m = radius_m;
  rule.kind = kind;
  return rule;
}

// A table top in front of the robot, a wall at its left, and room to work in.
std::vector<WorkspaceRule> rules() {
  WorkspaceRule table = rule_of("table", {"l_hand", "r_hand"}, 0.02, WorkspaceRule::Kind::kOutside);
  table.box_Root_m = {Eigen::Vector3d(-0.7, -0.5, -0.3), Eigen::Vector3d(-0.2, 0.5, -0.06)};
  WorkspaceRule wall = rule_of("wall", {"l_hand", "l_forearm"}, 0.0, WorkspaceRule::Kind::kPlane);
  wall.p_RootPlane_m = {0, -0.35, 0};
  wall.normal_Root = Eigen::Vector3d::UnitY();
  WorkspaceRule room = rule_of("room", {"l_hand", "r_hand"}, 0.0, WorkspaceRule::Kind::kInside);
  room.box_Root_m = {Eigen::Vector3d(-0.45, -9, -9), Eigen::Vector3d(9, 9, 0.4)};
  return {table, wall, room};
}

// Torso and arms under one workspace, on any devices.
class Rig {
 public:
  virtual ~Rig() = default;
  LimitedControlBoard& board(const std::string& part) { return *boards_.at(index_of(part)); }
  void advance() {
    const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
    for (auto& board : boards_) {
      if (const Status stepped = board->step_to(next_ns); !stepped)
        throw std::runtime_error(stepped.error().message);
    }
    step(next_ns);
    clock_.set_ns(next_ns);
  }
  // How far the worst link is beyond its border, m; below 0: none is.
  double worst_m() {
    const Eigen::VectorXd axes_rad = axes();
    double worst = -1;
    for (const WorkspaceRule& rule : rules()) {
      for (const std::string& link : rule.links) {
        const Eigen::Vector3d p = model_.X_RootLink(*model_.link_index(link), axes_rad).translation();
        double depth_m = 0;
        if (rule.kind == WorkspaceRule::Kind::kPlane) {
          depth_m = rule.normal_Root.dot(rule.p_RootPlane_m - p);
        } else if (rule.kind == WorkspaceRule::Kind::kInside) {
          depth_m = std::max((rule.box_Root_m.min() - p).maxCoeff(), (p - rule.box_Root_m.max()).maxCoeff());
        } else {
          // to the nearest face: what of the sphere is in the box
          depth_m = rule.box_Root_m.contains(p)
                        ? rule.radius_m + std::min((p - rule.box_Root_m.min()).minCoeff(),
                                                   (rule.box_Root_m.max() - p).minCoeff())
                        : rule.radius_m - rule.box_Root_m.exteriorDistance(p);
        }
        worst = std::max(worst, depth_m);
      }
    }
    return worst;
  }
  Eigen::Vector3d hand_m(const std::string& link) {
    return model_.X_RootLink(*model_.link_index(link), axes()).translation();
  }
  std::vector<std::string> warnings;

 protected:
  virtual void step(std::int64_t now_ns) = 0;
  void add(IControlBoard& device, const std::string& part) {
    LimitOptions options;
    options.part = part;
    options.workspace = workspace_;
    options.warn = [this](const std::string& sentence) { warnings.push_back(sentence); };
    boards_.push_back(required(LimitedControlBoard::create(device, clock_, std::move(options))));
  }
  const RobotModel model_ = body();

 private:
  static std::size_t index_of(const std::string& part) {
    return static_cast<std::size_t>(std::find(kParts.begin(), kParts.end(), part) - kParts.begin());
  }
  Eigen::VectorXd axes() {
    std::map<std::string, std::vector<double>> parts;
    for (const std::string& part : kParts) parts[part] = board(part).read_joints()->position_rad;
    return *model_.axes_from_parts(parts);
  }
  ManualClock clock_;
  const std::shared_ptr<Workspace> workspace_ = required(Workspace::create(body(), rules()));
  std::vector<std::unique_ptr<LimitedControlBoard>> boards_;
};

class FakeBody final : public Rig {
 public:
  FakeBody() {
    for (const std::string& part : kParts) {
      std::vector<FakeJoint> joints;
      for (const Axis& axis : model_.parts()[static_cast<std::size_t>(*model_.part_index(part))].axes) {
        joints.push_back({axis.name,
                          {axis.lower_rad, axis.upper_rad, axis.velocity_rad_s, axis.effort_Nm},
                          axis.home_rad,
                          axis.reference_speed_rad_s});
      }
      devices_.push_back(std::make_unique<FakeControlBoard>(std::move(joints)));
      add(*devices_.back(), part);
    }
  }

 private:
  void step(std::int64_t now_ns) override {
    for (auto& device : devices_) ASSERT_TRUE(device->step_to(now_ns).ok());
  }
  std::vector<std::unique_ptr<FakeControlBoard>> devices_;
};

class SimulatedBody final : public Rig {
 public:
  SimulatedBody() {
    for (const std::string& part : kParts) {
      devices_.push_back(required(sim::SimulatedControlBoard::create(robot_, part)));
      add(*devices_.back(), part);
    }
  }

 private:
  void step(std::int64_t now_ns) override { ASSERT_TRUE(robot_->step_to(now_ns).ok()); }
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::vector<std::unique_ptr<IControlBoard>> devices_;
};

constexpr double kDegree = M_PI / 180;

TEST(Workspace, ATargetBehindABorderIsRefusedAndNothingMoves) {
  FakeBody rig;
  ASSERT_LT(rig.worst_m(), 0) << "the home posture is allowed";
  // the elbow stretched: the hand goes through the table
  const int joints[] = {0, 3};
  const double targets[] = {-35 * kDegree, 20 * kDegree};
  const Status refused = rig.board("left_arm").move_to(joints, targets);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kFailed);
  EXPECT_NE(refused.error().message.find("beyond the border '"), std::string::npos)
      << refused.error().message;
  const Eigen::Vector3d before_m = rig.hand_m("l_hand");
  for (int i = 0; i < 50; ++i) rig.advance();
  EXPECT_EQ((rig.hand_m("l_hand") - before_m).norm(), 0);
  // fingers carry no link that is looked at
  const int finger[] = {11};
  const double closed[] = {0.5};
  EXPECT_TRUE(rig.board("left_arm").move_to(finger, closed).ok());
}

TEST(Workspace, ASpeedEndsBeforeTheBorder) {
  FakeBody rig;
  const int joint[] = {1};
  const double out[] = {0.6};
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(rig.board("left_arm").set_velocities(joint, out).ok());
    rig.advance();
    ASSERT_LE(rig.worst_m(), 0) << i;
  }
  EXPECT_LT(std::abs(rig.board("left_arm").read_joints()->velocity_rad_s[1]), 1e-3);
  EXPECT_LT(rig.hand_m("l_hand").y(), -0.3) << "it went as far as it may";
  ASSERT_EQ(rig.warnings.size(), 1U) << rig.warnings.back();
  EXPECT_EQ(rig.warnings[0], "left_arm: slowed down before the border 'wall' of the workspace");
  // the way back is free
  const double back[] = {-0.6};
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(rig.board("left_arm").set_velocities(joint, back).ok());
    rig.advance();
  }
  EXPECT_NEAR(rig.board("left_arm").read_joints()->velocity_rad_s[1], -0.6, 1e-6);
}

TEST(Workspace, AMotionThatLeadsThroughABorderIsStoppedBeforeIt) {
  FakeBody rig;
  // each target is allowed when it is given; together they are not
  const int shoulder[] = {1};
  const double out[] = {100 * kDegree};
  ASSERT_FALSE(rig.board("left_arm").move_to(shoulder, out).ok());
  const int torso[] = {0};
  const double turned[] = {-40 * kDegree};
  (void)rig.board("torso").move_to(torso, turned);
  const double direct[] = {100 * kDegree};
  for (int i = 0; i < 800; ++i) {
    (void)rig.board("left_arm").set_positions(shoulder, direct);
    rig.advance();
    ASSERT_LE(rig.worst_m(), 0) << i;
  }
}

// Whoever asks, by whatever command, in whatever order.
template <class Body>
double worst_of_adversary(std::uint64_t seed, int periods) {
  Body rig;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst_m = rig.worst_m();
  std::vector<int> joints;
  std::vector<double> values;
  std::uint64_t verb = 0;
  std::string part;
  for (int period = 0; period < periods; ++period) {
    // a command is kept up for a while, so that it gets somewhere
    if (period % 40 == 0) {
      part = kParts[random() % kParts.size()];
      verb = random() % 6;
      joints.clear();
      values.clear();
      const int count = part == "torso" ? 3 : 7;
      for (int joint = 0; joint < count; ++joint) {
        if (random() % 2 == 0) continue;
        joints.push_back(joint);
        values.push_back(unit(random) * (verb == 4 ? 5 : 2));
      }
    }
    LimitedControlBoard& board = rig.board(part);
    switch (verb) {
      case 0:
        if (period % 40 == 0) (void)board.move_to(joints, values);
        break;
      case 1:
        (void)board.set_positions(joints, values);
        break;
      case 2:
      case 3:
        (void)board.set_velocities(joints, values);
        break;
      case 4:
        (void)board.set_torques(joints, values);
        break;
      default:
        if (period % 40 == 0) (void)board.home(joints);
        break;
    }
    rig.advance();
    worst_m = std::max(worst_m, rig.worst_m());
  }
  return worst_m;
}

TEST(Workspace, NoCommandDrivesAFakeBodyOverABorder) {
  for (const std::uint64_t seed : {1, 2, 3}) EXPECT_LE(worst_of_adversary<FakeBody>(seed, 3000), 0) << seed;
}

// Bodies with mass overshoot a little; the borders are kept to a centimetre.
TEST(Workspace, NoCommandDrivesASimulatedBodyOverABorder) {
  EXPECT_LE(worst_of_adversary<SimulatedBody>(5, 1500), 0.01);
}

TEST(Workspace, RulesThatAreNoneAreRefused) {
  const auto refusal = [](const WorkspaceRule& rule) {
    const auto made = Workspace::create(body(), {rule});
    return made ? std::string() : made.error().message;
  };
  WorkspaceRule rule = rule_of("table", {"l_hnd"}, 0.0, WorkspaceRule::Kind::kOutside);
  rule.box_Root_m = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1)};
  EXPECT_NE(refusal(rule).find("l_hand"), std::string::npos) << refusal(rule);
  rule.links = {};
  EXPECT_NE(refusal(rule).find("names no links"), std::string::npos);
  rule.links = {"l_hand"};
  rule.box_Root_m.setEmpty();
  EXPECT_NE(refusal(rule).find("box is empty"), std::string::npos);
  rule.kind = WorkspaceRule::Kind::kPlane;
  rule.normal_Root.setZero();
  EXPECT_NE(refusal(rule).find("no direction"), std::string::npos);
}

}  // namespace
}  // namespace nido::test
