// Honest physics: motions with a closed form, and the body against its kinematics.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "nido/kinematics/robot_model.h"
#include "nido/simulator/simulation.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStep_s = 0.001;

void say(Simulation& sim, const std::string& line) { ASSERT_EQ(sim.world(line), "[ok]") << line; }

Eigen::Vector3d position(const Simulation& sim, const std::string& name) {
  return sim.object(name)->X_WorldObject.translation();
}

TEST(Physics, free_fall) {
  auto sim = make(robot_only());
  say(*sim, "world mk sph 0.03 1 2.5 0 1 0 0");
  const double from_m = position(*sim, "sph 1").z();
  ASSERT_TRUE(sim->step(0.5).ok());
  const ObjectState ball = *sim->object("sph 1");
  // the integrator takes the speed at the end of a step: half a step's fall more
  const double fall_m = kGravity_m_s2 * 0.5 * (0.5 + kStep_s) / 2;
  EXPECT_NEAR(from_m - ball.X_WorldObject.translation().z(), fall_m, 1e-6);
  EXPECT_NEAR(ball.v_World_m_s.z(), -kGravity_m_s2 * 0.5, 1e-9);
}

TEST(Physics, a_throw_is_a_parabola) {
  auto sim = make(robot_only());
  say(*sim, "world mk box 0.04 0.05 0.06 1 1.5 0 1 0 0");
  say(*sim, "world speed box 1 0.5 3 1 2 0 0");
  const Eigen::Vector3d from = position(*sim, "box 1");
  ASSERT_TRUE(sim->step(0.6).ok());
  const Eigen::Vector3d to = position(*sim, "box 1");
  // port: x left, y up, z forward; root: x backward, y right, z up
  EXPECT_NEAR(to.x() - from.x(), -0.6, 1e-6);
  EXPECT_NEAR(to.y() - from.y(), -0.3, 1e-6);
  EXPECT_NEAR(to.z() - from.z(), 3 * 0.6 - kGravity_m_s2 * 0.6 * (0.6 + kStep_s) / 2, 1e-6);
}

// free of torque, a body that tumbles keeps its angular momentum and its energy
TEST(Physics, a_tumbling_box_keeps_momentum_and_energy) {
  auto sim = make(robot_only());
  say(*sim, "world mk box 0.05 0.1 0.2 1 6 0 1 0 0");
  say(*sim, "world mass box 1 0.5");
  // about the middle axis, where turning is unstable
  say(*sim, "world speed box 1 0 0 0 0.1 10 0.1");
  const Eigen::Vector3d e = sim->object("box 1")->size_m;
  const Eigen::Vector3d inertia =
      0.5 / 12 *
      Eigen::Vector3d(e.y() * e.y() + e.z() * e.z(), e.x() * e.x() + e.z() * e.z(),
                      e.x() * e.x() + e.y() * e.y());
  const auto momentum = [&](const ObjectState& o) -> Eigen::Vector3d {
    const Eigen::Matrix3d R = o.X_WorldObject.linear();
    return R * inertia.cwiseProduct(R.transpose() * o.w_World_rad_s);
  };
  const auto energy = [&](const ObjectState& o) { return 0.5 * o.w_World_rad_s.dot(momentum(o)); };
  const ObjectState start = *sim->object("box 1");
  double least_along = 1;
  for (int i = 0; i < 90; ++i) {
    ASSERT_TRUE(sim->step(0.01).ok());
    const ObjectState now = *sim->object("box 1");
    EXPECT_LT((momentum(now) - momentum(start)).norm(), 0.02 * momentum(start).norm()) << i;
    EXPECT_NEAR(energy(now), energy(start), 0.03 * energy(start)) << i;
    const Eigen::Vector3d axis = now.X_WorldObject.linear() * start.X_WorldObject.linear().transpose() *
                                 start.w_World_rad_s.normalized();
    least_along = std::min(least_along, axis.dot(start.w_World_rad_s.normalized()));
  }
  EXPECT_LT(least_along, 0) << "the axis turns over";
}

// A symmetric top without torque: its axis goes round the angular momentum at L / I across.
TEST(Physics, a_spinning_disc_wobbles_at_the_right_rate) {
  auto sim = make(robot_only());
  say(*sim, "world mk cyl 0.1 0.02 1 6 0 1 0 0");
  say(*sim, "world mass cyl 1 1");
  const ObjectState rest = *sim->object("cyl 1");
  const Eigen::Vector3d axis = rest.X_WorldObject.linear().col(2);
  // mostly about its axis; given in the port's frame
  const Eigen::Vector3d w_World = 20 * axis + 4 * rest.X_WorldObject.linear().col(0);
  std::ostringstream line;
  line << "world speed cyl 1 0 0 0 " << -w_World.y() << ' ' << w_World.z() << ' ' << -w_World.x();
  say(*sim, line.str());
  const double along = 0.5 * 0.1 * 0.1;
  const double across = (3 * 0.1 * 0.1 + 0.02 * 0.02) / 12;
  const Eigen::Vector3d L = along * 20 * axis + across * 4 * rest.X_WorldObject.linear().col(0);
  const double rate_rad_s = L.norm() / across;
  double turned = 0;
  Eigen::Vector3d before = axis;
  const Eigen::Vector3d up = L.normalized();
  constexpr int kPeriods = 60;
  for (int i = 0; i < kPeriods; ++i) {
    ASSERT_TRUE(sim->step(0.01).ok());
    const Eigen::Vector3d now = sim->object("cyl 1")->X_WorldObject.linear().col(2);
    const Eigen::Vector3d a = before - up * up.dot(before);
    const Eigen::Vector3d b = now - up * up.dot(now);
    turned += std::atan2(up.dot(a.cross(b)), a.dot(b));
    before = now;
  }
  EXPECT_NEAR(turned, rate_rad_s * 0.01 * kPeriods, 0.02 * rate_rad_s * 0.01 * kPeriods);
}

// How far a box on a slope gets in a second, and how much faster it is at the end.
struct Slide {
  double way_m = 0;
  double acceleration_m_s2 = 0;
};
Slide slide(double slope_deg, double friction) {
  auto sim = make(robot_only());
  const std::string slope = std::to_string(slope_deg);
  say(*sim, "world mk sbox 2 0.02 4 0 1.5 3 1 1 1");
  say(*sim, "world rot sbox 1 " + slope + " 0 0");
  const double lift_m = 0.0351;  // above the slab's middle, along its normal
  say(*sim, "world mk box 0.05 0.05 0.05 0 " + std::to_string(1.5 + lift_m * std::cos(slope_deg * kDegree)) +
                " " + std::to_string(3 + lift_m * std::sin(slope_deg * kDegree)) + " 1 0 0");
  say(*sim, "world rot box 1 " + slope + " 0 0");
  say(*sim, "world friction box 1 " + std::to_string(friction));
  say(*sim, "world friction sbox 1 " + std::to_string(friction));
  EXPECT_TRUE(sim->step(0.2).ok());
  const Eigen::Vector3d from = position(*sim, "box 1");
  const double v0 = sim->object("box 1")->v_World_m_s.norm();
  EXPECT_TRUE(sim->step(0.5).ok());
  return {(position(*sim, "box 1") - from).norm(), (sim->object("box 1")->v_World_m_s.norm() - v0) / 0.5};
}

TEST(Physics, a_box_slides_beyond_the_angle_of_friction) {
  constexpr double kFriction = 0.5;  // 26.57 degrees
  EXPECT_LT(slide(25.5, kFriction).way_m, 0.001);
  const double angle = 30 * kDegree;
  const double expected = kGravity_m_s2 * (std::sin(angle) - kFriction * std::cos(angle));
  EXPECT_NEAR(slide(30, kFriction).acceleration_m_s2, expected, 0.05 * expected);
  const double steep = 40 * kDegree;
  const double faster = kGravity_m_s2 * (std::sin(steep) - kFriction * std::cos(steep));
  EXPECT_NEAR(slide(40, kFriction).acceleration_m_s2, faster, 0.05 * faster);
}

TEST(Physics, a_ball_bounces_to_the_square_of_its_restitution) {
  for (const double restitution : {0.5, 0.8}) {
    auto sim = make(robot_only());
    say(*sim, "world mk sbox 0.5 0.05 0.5 1.5 0.5 0 1 1 1");
    say(*sim, "world mk sph 0.03 1.5 0.955 0 1 0 0");  // 0.4 m above it
    for (const char* thing : {"sph 1", "sbox 1"})
      say(*sim, std::string("world restitution ") + thing + " " + std::to_string(restitution));
    const double ground_m = 0.525 + Simulation::kFloorHeight_m + 0.03;
    double highest_m = 0;
    bool bounced = false;
    for (int i = 0; i < 70; ++i) {
      ASSERT_TRUE(sim->step(0.01).ok());
      const ObjectState ball = *sim->object("sph 1");
      bounced = bounced || ball.v_World_m_s.z() > 0;
      if (bounced) highest_m = std::max(highest_m, ball.X_WorldObject.translation().z() - ground_m);
    }
    EXPECT_NEAR(highest_m, 0.4 * restitution * restitution, 0.06 * 0.4) << restitution;
  }
}

TEST(Physics, a_stack_stays_where_it_was_put) {
  auto sim = make_yaml(
      "table: {}\nobjects:\n"
      "  - {object: cube, name: low, position_m: [-0.45, 0.0, -0.0576]}\n"
      "  - {object: cube, name: middle, position_m: [-0.45, 0.0, -0.0076]}\n"
      "  - {object: cube, name: high, position_m: [-0.45, 0.0, 0.0424]}\n");
  ASSERT_TRUE(sim->step(1).ok());
  std::vector<Eigen::Vector3d> start;
  for (const char* name : {"low", "middle", "high"}) start.push_back(position(*sim, name));
  ASSERT_TRUE(sim->step(60).ok());
  std::size_t i = 0;
  for (const char* name : {"low", "middle", "high"})
    EXPECT_LT((position(*sim, name) - start[i++]).norm(), 0.001) << name;
}

TEST(Physics, things_of_all_shapes_stay_where_they_lie) {
  auto sim = make_yaml(
      "table: {}\nobjects:\n"
      "  - {object: cube, name: cube, position_m: [-0.45, 0.0], yaw_deg: 20}\n"
      "  - {object: ball, name: ball, position_m: [-0.40, 0.15]}\n"
      "  - {object: bear, name: bear, position_m: [-0.45, -0.15]}\n"
      "  - {object: basket, name: basket, position_m: [-0.35, 0.30]}\n");
  say(*sim, "world mk cyl 0.02 0.1 0.05 0.56 0.3 0 1 0");
  say(*sim, "world mk box 0.03 0.06 0.04 -0.05 0.55 0.3 0 1 0");
  ASSERT_TRUE(sim->step(2).ok());
  std::map<std::string, Eigen::Vector3d> start;
  for (const ObjectState& object : sim->objects()) start[object.name] = object.X_WorldObject.translation();
  ASSERT_TRUE(sim->step(60).ok());
  for (const ObjectState& object : sim->objects())
    EXPECT_LT((object.X_WorldObject.translation() - start[object.name]).norm(), 0.001) << object.name;
}

// a kilogram hangs from a pin and is swung and pulled: the two points of the pin stay together
TEST(Physics, pins_between_things_hold_under_load) {
  auto sim = make(robot_only());
  say(*sim, "world mk sbox 0.05 0.05 0.05 1 1.5 0 1 0 0");
  say(*sim, "world mk box 0.04 0.2 0.04 1 1.35 0 0 1 0");
  say(*sim, "world mass box 1 1");
  say(*sim, "world joint ball box 1 sbox 1 1 1.45 0");
  const Eigen::Vector3d pin(-0.026, -1, 1.45 + Simulation::kFloorHeight_m);  // in the root frame
  const Eigen::Vector3d p_BoxPin = sim->object("box 1")->X_WorldObject.inverse() * pin;
  say(*sim, "world force box 1 15 -10 10 1");
  double widest_m = 0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(sim->step().ok());
    const double gap_m = (sim->object("box 1")->X_WorldObject * p_BoxPin - pin).norm();
    widest_m = std::max(widest_m, gap_m);
  }
  EXPECT_LT(widest_m, 0.0005);
  EXPECT_GT((sim->object("box 1")->X_WorldObject.translation() - pin).cross(Eigen::Vector3d::UnitZ()).norm(),
            0.01)
      << "it does swing";
}

// The leg hangs from an unpowered hip: a pendulum, whose time of swing follows from the masses alone, and
// which gets no energy from nowhere.
TEST(Physics, a_leg_without_power_is_a_pendulum) {
  auto sim = make(robot_only());
  const auto model = RobotModel::load(config("robots/icub.urdf"));
  ASSERT_TRUE(model.ok());
  const int leg = sim->part_index("right_leg");
  std::vector<double> straight(6, 0.0);
  straight[0] = 0.4;
  ASSERT_TRUE(sim->place_joints(leg, straight).ok());
  const std::array<int, 1> hip = {0};
  ASSERT_TRUE(sim->command(leg, JointMode::kTorque, hip, std::array<double, 1>{0}).ok());

  // inertia about the hip's axis and the moment of the weight, of everything beyond the hip
  const int axis = *model->axis_index(sim->parts()[static_cast<std::size_t>(leg)].joints[0].name);
  Eigen::VectorXd axes = model->home_axes();
  for (const PartInfo& part : sim->parts()) {
    const auto states = sim->joints(sim->part_index(part.name));
    for (std::size_t j = 0; j < states.size(); ++j)
      axes[*model->axis_index(part.joints[j].name)] = states[j].position_rad;
  }
  axes[axis] = 0;
  double inertia_kgm2 = 0;
  double moment_kgm = 0;
  const double h = 1e-6;
  Eigen::VectorXd turned = axes;
  turned[axis] += h;
  for (std::size_t l = 0; l < model->links().size(); ++l) {
    const BodyLink& link = model->links()[l];
    if (link.mass_kg <= 0) continue;
    const auto jacobian = model->jacobian(static_cast<int>(l), axes, {axis}, link.p_LinkCom_m);
    const Eigen::Vector3d v = jacobian.col(0).head<3>();
    const Eigen::Vector3d w = jacobian.col(0).tail<3>();
    const Eigen::Matrix3d R = model->X_RootLink(static_cast<int>(l), axes).linear();
    inertia_kgm2 += link.mass_kg * v.squaredNorm() + w.dot(R * link.inertia_Link_kgm2 * R.transpose() * w);
    const auto later = model->jacobian(static_cast<int>(l), turned, {axis}, link.p_LinkCom_m);
    moment_kgm += link.mass_kg * (later.col(0)[2] - v[2]) / h;  // second derivative of the height
  }
  const double small_s = 2 * std::numbers::pi * std::sqrt(inertia_kgm2 / (moment_kgm * kGravity_m_s2));

  std::vector<double> crossing_s;
  std::vector<double> highest_rad;
  double before = straight[0];
  double highest = 0;
  for (int i = 1; i <= 500; ++i) {
    ASSERT_TRUE(sim->step(0.01).ok());
    const double now = sim->joints(leg)[0].position_rad;
    // where it rests is not exactly zero: the leg's middle of mass may lie off the axis
    highest = std::max(highest, now);
    if (before < 0 && now >= 0) {
      crossing_s.push_back(0.01 * (i - now / (now - before)));
      highest = 0;
    }
    if (before >= 0 && now < 0) highest_rad.push_back(highest);
    before = now;
  }
  ASSERT_GE(crossing_s.size(), 3U);
  const double period_s =
      (crossing_s.back() - crossing_s.front()) / static_cast<double>(crossing_s.size() - 1);
  EXPECT_NEAR(period_s, small_s, 0.03 * small_s);
  // what a swing loses is the work of the gear's friction: four times friction by stiffness
  const double friction_Nm = 0.002 * sim->parts()[static_cast<std::size_t>(leg)].joints[0].max_torque_Nm;
  const double loss_rad = 4 * friction_Nm / (moment_kgm * kGravity_m_s2);
  for (std::size_t i = 1; i + 1 < highest_rad.size(); ++i)
    EXPECT_NEAR(highest_rad[i] - highest_rad[i + 1], loss_rad, 0.25 * loss_rad) << "swing " << i;
}

// joints commanded, settled, every link read from the world port: within a millimetre and a tenth of a degree
// of the kinematics, which tests/kinematics compares with the DH table and with orocos-kdl
TEST(Physics, every_chain_reaches_where_it_was_sent) {
  auto sim = make(robot_only());
  const auto model = RobotModel::load(config("robots/icub.urdf"));
  ASSERT_TRUE(model.ok());
  std::mt19937 random(23);
  for (int round = 0; round < 4; ++round) {
    Eigen::VectorXd axes = model->home_axes();
    for (const Part& part : model->parts()) {
      std::vector<double> target;
      for (std::size_t j = 0; j < part.axes.size(); ++j) {
        const Axis& a = part.axes[j];
        const double u = 0.15 + 0.7 * static_cast<double>(random() % 1001) / 1000;
        target.push_back(a.lower_rad + u * (a.upper_rad - a.lower_rad));
        axes[part.first_axis + static_cast<int>(j)] = target.back();
      }
      const int index = sim->part_index(part.name);
      for (std::size_t j = 0; j < target.size(); ++j)
        ASSERT_TRUE(sim->set_reference_speed(index, static_cast<int>(j), 1.5).ok());
      ASSERT_TRUE(sim->command_all(index, JointMode::kPosition, target).ok());
    }
    ASSERT_TRUE(sim->step(5).ok());
    for (const BodyLink& link : model->links()) {
      std::istringstream in(sim->world("world link " + link.name));
      std::array<double, 7> v{};
      for (double& x : v) ASSERT_TRUE(in >> x) << link.name;
      const Eigen::Vector3d p(v[0], v[1], v[2]);
      const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
      const Eigen::Isometry3d sent = model->X_RootLink(*model->link_index(link.name), axes);
      EXPECT_LT((p - sent.translation()).norm(), 0.001) << link.name << " in round " << round;
      EXPECT_LT(q.angularDistance(Eigen::Quaterniond(sent.linear())), 0.1 * kDegree)
          << link.name << " in round " << round;
    }
  }
}

// Links that hang on each other never come apart, whatever pushes: where a link is follows from the angles
// alone.
TEST(Physics, hinges_hold_under_load) {
  auto sim = make(robot_only());
  const auto model = RobotModel::load(config("robots/icub.urdf"));
  ASSERT_TRUE(model.ok());
  // both forearms want the place in front of the chest
  for (const char* part : {"left_arm", "right_arm"}) {
    const std::array<int, 4> joints = {0, 1, 2, 3};
    ASSERT_TRUE(sim->command(sim->part_index(part), JointMode::kPosition, joints,
                             std::array<double, 4>{-0.7, 0.3, 1.2, 1.5})
                    .ok());
  }
  double hardest_N = 0;
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(sim->step().ok());
    for (const ContactPair& pair : sim->contacts()) hardest_N = std::max(hardest_N, pair.force_N);
    Eigen::VectorXd axes = model->home_axes();
    for (const Part& part : model->parts()) {
      const auto state = sim->joints(sim->part_index(part.name));
      for (std::size_t j = 0; j < part.axes.size(); ++j)
        axes[part.first_axis + static_cast<int>(j)] = state[j].position_rad;
    }
    // the hand's own links may bend against their coupling; the palm stands on uncoupled hinges
    const Eigen::Isometry3d found = *sim->X_WorldLink("r_hand");
    const Eigen::Isometry3d sent = model->X_RootLink(*model->link_index("r_hand"), axes);
    ASSERT_LT((found.translation() - sent.translation()).norm(), 1e-9) << "at period " << i;
  }
  EXPECT_GT(hardest_N, 10) << "there was a load";
}

// with self-collision on, the forearms stop each other
TEST(Physics, arms_do_not_pass_through_each_other) {
  for (const bool on : {false, true}) {
    SimulationOptions options = robot_only();
    options.self_collision = on;
    auto sim = make(options);
    ASSERT_TRUE(sim->step(0.5).ok());
    for (const ContactPair& pair : sim->contacts())
      EXPECT_FALSE(pair.a_is_robot && pair.b_is_robot) << "at home";
    // both forearms are folded in front of the chest, where only one has room
    for (const char* part : {"left_arm", "right_arm"}) {
      const int arm = sim->part_index(part);
      const std::array<int, 4> joints = {0, 1, 2, 3};
      ASSERT_TRUE(
          sim->command(arm, JointMode::kPosition, joints, std::array<double, 4>{-0.7, 0.3, 1.2, 1.5}).ok());
    }
    bool touched = false;
    double deepest_m = 0;
    for (int i = 0; i < 500; ++i) {
      ASSERT_TRUE(sim->step().ok());
      for (const ContactPair& pair : sim->contacts()) {
        if (!pair.a_is_robot || !pair.b_is_robot) continue;
        touched = true;
        deepest_m = std::max(deepest_m, pair.depth_m);
      }
    }
    EXPECT_EQ(touched, on);
    // they meet at full speed, and no hinge may be pushed back faster than it can turn: a forearm is four
    // times as thick
    EXPECT_LT(deepest_m, 0.015);
  }
}

// what the inertial sensor says is gravity and the second derivative of its own place
TEST(Physics, the_inertial_sensor_feels_motion) {
  auto sim = make(robot_only());
  const int torso = sim->part_index("torso");
  const std::array<int, 1> pitch = {2};
  ASSERT_TRUE(sim->set_reference_speed(torso, 2, 0.5).ok());
  ASSERT_TRUE(sim->command(torso, JointMode::kPosition, pitch, std::array<double, 1>{0.5}).ok());
  std::vector<Eigen::Isometry3d> X;
  std::vector<Simulation::Inertial> felt;
  double strongest = 0;
  double squares = 0;
  int count = 0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(sim->step(0.01).ok());
    X.push_back(*sim->X_WorldLink("imu"));
    felt.push_back(sim->inertial());
  }
  for (std::size_t i = 3; i + 1 < X.size(); ++i) {
    // the difference of the speeds at the ends of two periods: the middle of the second one
    const Eigen::Vector3d a =
        (X[i].translation() - 2 * X[i - 1].translation() + X[i - 2].translation()) / 1e-4;
    const Eigen::Vector3d b =
        (X[i + 1].translation() - 2 * X[i].translation() + X[i - 1].translation()) / 1e-4;
    const Eigen::Vector3d felt_World = X[i].linear() * felt[i].acceleration_m_s2;
    const Eigen::Vector3d expected = (a + b) / 2 + Eigen::Vector3d(0, 0, kGravity_m_s2);
    strongest = std::max(strongest, (expected - Eigen::Vector3d(0, 0, kGravity_m_s2)).norm());
    squares += (felt_World - expected).squaredNorm();
    ++count;
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(X[i + 1].linear() * X[i - 1].linear().transpose()));
    EXPECT_LT((X[i].linear() * felt[i].angular_velocity_rad_s - turn.axis() * turn.angle() / 0.02).norm(),
              0.05)
        << i;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.15);
  EXPECT_GT(strongest, 0.5) << "there was something to feel";
}

// a limb at rest weighs on its sensor what lies beyond it; moved, it adds mass times acceleration
TEST(Physics, the_limb_sensors_feel_weight_and_a_load) {
  auto sim = make(robot_only());
  ASSERT_TRUE(sim->step(1).ok());
  for (const char* limb : {"left_arm", "right_arm", "left_leg", "right_leg"}) {
    const auto wrench = sim->force_torque(limb);
    ASSERT_TRUE(wrench.ok()) << limb;
    EXPECT_GT(wrench->force_N.norm(), 5) << limb;
    EXPECT_LT(wrench->force_N.norm(), 40) << limb;
  }
  EXPECT_NEAR(sim->force_torque("left_leg")->force_N.norm(), sim->force_torque("right_leg")->force_N.norm(),
              0.01);
}

}  // namespace
}  // namespace nido::sim
