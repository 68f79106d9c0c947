// Things are taken from the table by the fingers' contact and friction, lifted, carried and let go.
#include <gtest/gtest.h>

#include "grasp_trial.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

struct Case {
  const char* shape;   // posture
  const char* object;  // file of config/objects
  Eigen::Vector2d place_m;
  double yaw_deg;
  Eigen::Vector3d error_m;
};

class GraspTest : public ::testing::Test {
 protected:
  static GraspResult run(const Case& c) {
    static const Result<RobotModel> kModel = RobotModel::load(config("robots/icub.urdf"));
    static const std::map<std::string, GraspPosture> kPostures =
        read_postures(config("robots/grasp_postures.yaml"));
    const ArmReach reach(*kModel);
    SimulationOptions options = robot_only();
    options.world_yaml = "table: {}\nobjects:\n  - {object: " + std::string(c.object) +
                         ", name: thing, position_m: [" + std::to_string(c.place_m.x()) + ", " +
                         std::to_string(c.place_m.y()) + "], yaw_deg: " + std::to_string(c.yaw_deg) +
                         "}\n  - {object: basket, name: basket, position_m: [-0.32, 0.25]}\n";
    auto simulation = make(options);
    GraspTrial trial;
    trial.object = "thing";
    trial.error_Root_m = c.error_m;
    trial.basket = "basket";
    return try_grasp(*simulation, reach, kPostures.at(c.shape), trial);
  }
};

TEST_F(GraspTest, cube_is_held_carried_and_dropped_into_the_basket) {
  const GraspResult result = run({"cube", "cube", {-0.30, 0.06}, 25, {0.006, -0.006, 0.003}});
  ASSERT_EQ(result.trouble, "");
  EXPECT_TRUE(result.hold.held());
  EXPECT_TRUE(result.hold.right[0]) << "the thumb must bear a part";
  EXPECT_GT(result.lifted_m, 0.07);
  EXPECT_LT(result.slip_m, 0.001) << "in 3 s";
  EXPECT_TRUE(result.in_basket);
}

// 0.3 kg, four times what the cube weighs, hang from the fingers for a minute
TEST_F(GraspTest, a_heavy_cube_does_not_creep) {
  const Result<RobotModel> model = RobotModel::load(config("robots/icub.urdf"));
  const std::map<std::string, GraspPosture> postures = read_postures(config("robots/grasp_postures.yaml"));
  const ArmReach reach(*model);
  SimulationOptions options = robot_only();
  options.world_yaml =
      "table: {}\nobjects:\n  - {object: cube, name: thing, position_m: [-0.30, 0.06], yaw_deg: 25, "
      "mass_kg: 0.3}\n";
  auto simulation = make(options);
  const GraspResult result =
      try_grasp(*simulation, reach, postures.at("cube"), {.object = "thing", .basket = "", .hold_s = 60});
  ASSERT_EQ(result.trouble, "");
  EXPECT_TRUE(result.hold.held());
  EXPECT_GT(result.lifted_m, 0.07);
  EXPECT_LT(result.slip_m, 0.002) << "in 60 s";
}

TEST_F(GraspTest, ball_is_held_carried_and_dropped_into_the_basket) {
  const GraspResult result = run({"ball", "ball", {-0.34, 0.02}, 0, {-0.006, 0.006, -0.003}});
  ASSERT_EQ(result.trouble, "");
  EXPECT_TRUE(result.hold.held());
  EXPECT_GT(result.lifted_m, 0.07);
  EXPECT_LT(result.slip_m, 0.001);
  EXPECT_TRUE(result.in_basket);
}

TEST_F(GraspTest, bear_is_held_carried_and_dropped_into_the_basket) {
  const GraspResult result = run({"bear", "bear", {-0.32, 0.08}, 60, {0, 0, 0}});
  ASSERT_EQ(result.trouble, "");
  EXPECT_TRUE(result.hold.held());
  EXPECT_GT(result.lifted_m, 0.07);
  EXPECT_TRUE(result.in_basket);
}

// friction does it: without it the same closing holds nothing
TEST_F(GraspTest, slippery_cube_is_not_lifted) {
  const Result<RobotModel> model = RobotModel::load(config("robots/icub.urdf"));
  const ArmReach reach(*model);
  SimulationOptions options = robot_only();
  options.world_yaml =
      "table: {}\nobjects:\n  - {object: cube, name: thing, position_m: [-0.30, 0.06], friction: 0.0, "
      "mass_kg: 1.0}\n";
  auto simulation = make(options);
  GraspTrial trial;
  trial.object = "thing";
  trial.hold_s = 1;
  const GraspResult result =
      try_grasp(*simulation, reach, read_postures(config("robots/grasp_postures.yaml")).at("cube"), trial);
  ASSERT_EQ(result.trouble, "");
  EXPECT_FALSE(result.hold.held() && result.lifted_m > 0.07);
}

}  // namespace
}  // namespace nido::sim
