// The shipped network under physics, with the reaching process's inside before it: what touch and friction
// hold.
#include <gtest/gtest.h>

#include "grasp_lab.h"
#include "nido/grasp/policies.h"

namespace nido::grasp {
namespace {

LabResult take_and_drop(const LabThing& thing) {
  const auto network = load_grasp_network(std::string(NIDO_CONFIG_DIR) + "/weights/grasp.txt");
  if (!network) return LabResult{network.error().message};
  GraspLab lab(thing, learned_policy(*network));
  LabResult result = lab.take(1.0);
  EXPECT_TRUE(result.held) << thing.name << ": " << result.trouble;
  EXPECT_TRUE(result.said_so) << "touch must tell the same";
  if (result.held) lab.drop(result);
  return result;
}

TEST(GraspPhysics, CubeIsHeldAndDroppedIntoTheBasket) {
  const LabResult result =
      take_and_drop({"object: cube", "blue cube", {-0.29, 0.04}, 35, {0.005, -0.005, 0.003}});
  EXPECT_TRUE(result.in_basket) << result.trouble;
}

TEST(GraspPhysics, BallIsHeldAndDroppedIntoTheBasket) {
  const LabResult result =
      take_and_drop({"object: ball", "red ball", {-0.35, 0.02}, 0, {-0.005, 0.005, -0.003}});
  EXPECT_TRUE(result.in_basket) << result.trouble;
}

TEST(GraspPhysics, BearIsHeldAndDroppedIntoTheBasket) {
  const LabResult result =
      take_and_drop({"object: bear", "teddy bear", {-0.32, 0.06}, 60, {0.004, 0.004, 0.003}});
  EXPECT_TRUE(result.in_basket) << result.trouble;
}

// friction does it: the same hand round the same ball without friction comes up empty, and says so
TEST(GraspPhysics, SlipperyThingIsNotHeldAndTheHandKnows) {
  const auto network = load_grasp_network(std::string(NIDO_CONFIG_DIR) + "/weights/grasp.txt");
  ASSERT_TRUE(network);
  GraspLab lab({"object: cube, friction: 0.0, mass_kg: 1.0", "blue cube", {-0.29, 0.04}},
               learned_policy(*network));
  const LabResult result = lab.take(1.5);
  EXPECT_FALSE(result.held);
  EXPECT_FALSE(result.said_so);
}

}  // namespace
}  // namespace nido::grasp
