// Polygons, outlines of bodies and the stereo fit, on shapes whose answers are known.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nido/vision/stereo_fit.h"

namespace nido::vision {
namespace {

double between(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

TEST(Polygon, AreaCentreAndOverlapOfKnownShapes) {
  const Polygon square = convex_hull({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {2, 2}, {1, 3}});
  EXPECT_EQ(square.size(), 4U);
  EXPECT_DOUBLE_EQ(area(square), 16);
  EXPECT_LT((centroid(square) - Eigen::Vector2d(2, 2)).norm(), 1e-12);
  const Polygon shifted = convex_hull({{2, 0}, {6, 0}, {6, 4}, {2, 4}});
  EXPECT_NEAR(area(intersection(square, shifted)), 8, 1e-12);
  EXPECT_NEAR(overlap(square, shifted), 8.0 / 24.0, 1e-12);
  EXPECT_NEAR(overlap(square, square), 1, 1e-12);
  EXPECT_EQ(overlap(square, convex_hull({{9, 9}, {10, 9}, {9, 10}})), 0);
  EXPECT_TRUE(contains(square, {1, 1}));
  EXPECT_FALSE(contains(square, {5, 1}));
  EXPECT_EQ(area(convex_hull({{0, 0}, {1, 1}, {2, 2}})), 0);
  EXPECT_EQ(area({}), 0);
}

TEST(Polygon, IntersectionHoldsExactlyTheCommonPoints) {
  std::mt19937_64 random(7);
  for (int n = 0; n < 50; ++n) {
    std::vector<Eigen::Vector2d> a;
    std::vector<Eigen::Vector2d> b;
    for (int i = 0; i < 8; ++i) {
      a.emplace_back(between(random, 0, 10), between(random, 0, 10));
      b.emplace_back(between(random, 3, 13), between(random, 3, 13));
    }
    const Polygon p = convex_hull(a);
    const Polygon q = convex_hull(b);
    const Polygon both = intersection(p, q);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d point(between(random, 0, 13), between(random, 0, 13));
      EXPECT_EQ(contains(both, point), contains(p, point) && contains(q, point));
    }
  }
}

// Two parallel eyes that look straight down from 40 cm.
EyePair eyes_above() {
  EyePair eyes;
  for (std::size_t e = 0; e < 2; ++e) {
    Eigen::Matrix3d R;
    R.col(0) = Eigen::Vector3d(0, 1, 0);   // image right is the robot's right
    R.col(1) = Eigen::Vector3d(1, 0, 0);   // image down is backward
    R.col(2) = Eigen::Vector3d(0, 0, -1);  // looks down
    eyes[e].X_RootCamera.linear() = R;
    eyes[e].X_RootCamera.translation() = Eigen::Vector3d(-0.3, e == 0 ? -0.034 : 0.034, 0.34);
  }
  return eyes;
}

TEST(Body, OutlineOfASphereIsItsSilhouette) {
  const EyeView eye = eyes_above()[0];
  Body ball;
  ball.solids = {{Solid::Kind::kSphere, {0.03, 0, 0}, {0, 0, 0}}};
  const Eigen::Vector3d below(-0.3, -0.034, -0.06);
  // straight below the eye the silhouette is a circle of angle asin(r / d)
  const double radius_px = 257.34 * std::tan(std::asin(0.03 / 0.40));
  const Polygon outline = ball.outline(eye, below, 0);
  EXPECT_NEAR(area(outline), M_PI * radius_px * radius_px, 0.002 * M_PI * radius_px * radius_px);
  EXPECT_LT((centroid(outline) - Eigen::Vector2d(160, 120)).norm(), 1e-9);
  EXPECT_TRUE(ball.outline(eye, {-0.3, -0.034, 0.5}, 0).empty());  // behind the eye
}

TEST(Body, OutlineIsCutAtTheImage) {
  const EyeView eye = eyes_above()[0];
  Body box;
  box.solids = {{Solid::Kind::kBox, {0.1, 0.1, 0.02}, {0, 0, 0}}};
  const Polygon outline = box.outline(eye, {-0.3, 0.22, -0.06}, 0);
  ASSERT_GE(outline.size(), 3U);
  for (const auto& p : outline) EXPECT_LE(p.x(), 320 + 1e-9);
  EXPECT_TRUE(box.outline(eye, {-0.3, 2.0, -0.06}, 0).empty());
  EXPECT_EQ(box.extents_m(), Eigen::Vector3d(0.1, 0.1, 0.02));
}

TEST(StereoFit, FindsPositionAndTurnFromOutlines) {
  const EyePair eyes = eyes_above();
  Body cube;
  cube.solids = {{Solid::Kind::kBox, {0.05, 0.05, 0.05}, {0, 0, 0}}};
  cube.symmetry_rad = M_PI / 2;
  std::mt19937_64 random(3);
  for (int n = 0; n < 30; ++n) {
    const Eigen::Vector3d p(between(random, -0.38, -0.22), between(random, -0.1, 0.1),
                            between(random, -0.1, 0.05));
    const double yaw = between(random, -M_PI / 4, M_PI / 4);
    const OutlinePair seen = {cube.outline(eyes[0], p, yaw), cube.outline(eyes[1], p, yaw)};
    const auto start = meet(eyes, centroid(seen[0]), centroid(seen[1]), 0.01);
    ASSERT_TRUE(start);
    const auto fit = fit_body(cube, eyes, seen, {*start, 0, 0}, true);
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->p_Root_m - p).norm(), 0.001);
    EXPECT_LT(std::abs(std::remainder(fit->yaw_rad - yaw, M_PI / 2)), 0.02);
    EXPECT_GT(fit->overlap, 0.97);
    // a ball does not explain a cube as well
    Body ball;
    ball.solids = {{Solid::Kind::kSphere, {0.03, 0, 0}, {0, 0, 0}}};
    const auto wrong = fit_body(ball, eyes, seen, {*start, 0, 0}, true);
    ASSERT_TRUE(wrong);
    EXPECT_LT(wrong->overlap, fit->overlap - 0.05);
  }
  EXPECT_FALSE(fit_body(cube, eyes, {}, {}, true));
  EXPECT_FALSE(meet(eyes, {160, 20}, {160, 220}, 0.01));  // no common point
}

TEST(StereoFit, SeesThatAHeldCubeLeans) {
  const EyePair eyes = eyes_above();
  Body cube;
  cube.solids = {{Solid::Kind::kBox, {0.05, 0.05, 0.05}, {0, 0, 0}}};
  cube.symmetry_rad = M_PI / 2;
  std::mt19937_64 random(4);
  int leaning = 0;
  int explained = 0;
  for (int n = 0; n < 30; ++n) {
    const Eigen::Vector3d p(between(random, -0.36, -0.24), between(random, -0.08, 0.08),
                            between(random, -0.05, 0.08));
    const double angle = between(random, 0, 2 * M_PI);
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(between(random, -0.7, 0.7), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(between(random, 0.3, 0.8), Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)))
            .toRotationMatrix();
    const OutlinePair seen = {cube.outline(eyes[0], p, R), cube.outline(eyes[1], p, R)};
    const auto start = meet(eyes, centroid(seen[0]), centroid(seen[1]), 0.01);
    ASSERT_TRUE(start);
    const auto fit = fit_body(cube, eyes, seen, {*start, 0, 0}, true);
    ASSERT_TRUE(fit);
    // the turn may be a local best, but never so poor that a ball explains the outlines better
    if (fit->overlap > 0.93) ++explained;
    Body ball;
    ball.solids = {{Solid::Kind::kSphere, {0.03, 0, 0}, {0, 0, 0}}};
    const auto wrong = fit_body(ball, eyes, seen, {*start, 0, 0}, true);
    ASSERT_TRUE(wrong);
    EXPECT_GT(fit->overlap, wrong->overlap);
    EXPECT_LT((fit->p_Root_m - p).norm(), 0.005);
    if (!fit->tilt.isIdentity(1e-6)) ++leaning;
  }
  EXPECT_GT(leaning, 15);
  EXPECT_GE(explained, 27);
}

}  // namespace
}  // namespace nido::vision
