#include "nido/kinematics/camera_geometry.h"

#include <gtest/gtest.h>

#include <random>

namespace nido {
namespace {

TEST(PinholeCamera, ProjectsAndComesBack) {
  const PinholeCamera camera;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> side(-0.3, 0.3);
  std::uniform_real_distribution<double> depth(0.1, 2.0);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(side(random), side(random), depth(random));
    const auto px = camera.project(p);
    ASSERT_TRUE(px);
    EXPECT_LT((camera.ray_Camera(*px) * p.norm() - p).norm(), 1e-12);
  }
  EXPECT_FALSE(camera.project({0.1, 0.1, 0}));
  EXPECT_FALSE(camera.project({0.1, 0.1, -1}));
  EXPECT_TRUE(camera.contains({0, 0}));
  EXPECT_FALSE(camera.contains({0, 0}, 1));
  EXPECT_FALSE(camera.contains({320.5, 100}));
}

TEST(Triangulate, FindsThePointAndTheGap) {
  const Eigen::Vector3d p(0.3, -0.2, 0.7);
  const Eigen::Vector3d a(0, 0, 0);
  const Eigen::Vector3d b(0.068, 0, 0);
  const auto met = triangulate({a, (p - a).normalized()}, {b, (p - b).normalized()});
  ASSERT_TRUE(met);
  EXPECT_LT((met->p_m - p).norm(), 1e-12);
  EXPECT_LT(met->gap_m, 1e-12);
  EXPECT_NEAR(met->distance_left_m, p.norm(), 1e-12);

  // crossing lines that miss each other by 2 cm: the middle lies between them
  const auto missed = triangulate({{0, 0, 0}, {1, 0, 0}}, {{1, -1, 0.02}, {0, 1, 0}});
  ASSERT_TRUE(missed);
  EXPECT_NEAR(missed->gap_m, 0.02, 1e-12);
  EXPECT_LT((missed->p_m - Eigen::Vector3d(1, 0, 0.01)).norm(), 1e-12);

  EXPECT_FALSE(triangulate({a, {0, 0, 1}}, {b, {0, 0, 1}}));                        // parallel
  EXPECT_FALSE(triangulate({a, (a - p).normalized()}, {b, (b - p).normalized()}));  // they meet behind
}

TEST(MeetPlane, OnlyAhead) {
  const auto met = meet_plane({{0, 0, 1}, Eigen::Vector3d(1, 0, -1).normalized()}, {0, 0, 0}, {0, 0, 1});
  ASSERT_TRUE(met);
  EXPECT_LT((*met - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_FALSE(meet_plane({{0, 0, 1}, {0, 0, 1}}, {0, 0, 0}, {0, 0, 1}));
  EXPECT_FALSE(meet_plane({{0, 0, 1}, {1, 0, 0}}, {0, 0, 0}, {0, 0, 1}));
}

}  // namespace
}  // namespace nido
