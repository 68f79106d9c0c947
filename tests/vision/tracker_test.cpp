// What the tracker believes of outlines that are computed from bodies at known places.
#include <gtest/gtest.h>

#include "nido/vision/object_tracker.h"

namespace nido::vision {
namespace {

TemplateSet one_cube() {
  TemplateSet set;
  set.colours = {{"blue", 228, 8, 0.4, 0.9, 0.3}};
  ObjectTemplate cube{"blue cube", "blue", "cube", {}, {}};
  cube.body.solids = {{Solid::Kind::kBox, {0.05, 0.05, 0.05}, {0, 0, 0}}};
  cube.body.symmetry_rad = M_PI / 2;
  set.objects = {cube};
  return set;
}

TemplateSet cube_and_ball(double ball_radius_m) {
  TemplateSet set = one_cube();
  ObjectTemplate ball{"blue ball", "blue", "ball", {}, {}};
  ball.body.solids = {{Solid::Kind::kSphere, {ball_radius_m, 0, 0}, {0, 0, 0}}};
  set.objects.push_back(ball);
  return set;
}

// Two eyes side by side that look forward and down, as the robot's do at its table.
EyePair eyes_over_the_table() {
  EyePair eyes;
  const Eigen::Vector3d forward = Eigen::Vector3d(-0.28, 0, -0.36).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY();
  for (std::size_t e = 0; e < 2; ++e) {
    eyes[e].X_RootCamera.linear() << right, forward.cross(right), forward;
    eyes[e].X_RootCamera.translation() = Eigen::Vector3d(-0.05, e == 0 ? -0.034 : 0.034, 0.34);
  }
  return eyes;
}

// Shows the tracker outlines as blobs of the first colour, a pair of pictures every 33 ms.
class Shown {
 public:
  explicit Shown(const TemplateSet& templates = one_cube()) : tracker_(templates, {}) {}

  const std::vector<SeenObject>& show(const OutlinePair& outlines) {
    std::array<std::vector<Blob>, 2> blobs;
    for (std::size_t e = 0; e < 2; ++e) {
      Blob blob;
      blob.colour = 0;
      blob.area_px = static_cast<int>(area(outlines[e]));
      blob.centroid_px = centroid(outlines[e]);
      blob.hull = outlines[e];
      blobs[e].push_back(blob);
    }
    stamp_.ns += 33'000'000;
    return tracker_.step({stamp_, eyes_, {&none_, &none_}, {&blobs[0], &blobs[1]}, false});
  }

  [[nodiscard]] OutlinePair outlines(const Eigen::Vector3d& p_Root_m, double yaw_rad) const {
    OutlinePair pair;
    for (std::size_t e = 0; e < 2; ++e) pair[e] = cube_.outline(eyes_[e], p_Root_m, yaw_rad);
    return pair;
  }

 private:
  Body cube_ = one_cube().objects[0].body;
  EyePair eyes_ = eyes_over_the_table();
  ObjectTracker tracker_;
  Image none_;
  Time stamp_;
};

// The part of an outline that lies below a share of its height.
Polygon lower_part(const Polygon& outline, double hidden_share) {
  Eigen::Vector2d low = outline[0];
  Eigen::Vector2d high = outline[0];
  for (const auto& p : outline) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double cut = low.y() + hidden_share * (high.y() - low.y());
  return intersection(
      outline,
      convex_hull({{low.x() - 1, cut}, {high.x() + 1, cut}, high.array() + 1, {low.x() - 1, high.y() + 1}}));
}

// A thing that comes out of a hand is half hidden when it is seen first and lies elsewhere a moment later.
TEST(Tracker, AFirstGlimpseBindsNobody) {
  for (const double hidden_share : {0.1, 0.2, 0.3, 0.4}) {
    for (const double fallen_m : {0.01, 0.02, 0.03}) {
      Shown shown;
      OutlinePair glimpse = shown.outlines({-0.32, 0.05, -0.03 + fallen_m}, 0.3);
      for (Polygon& outline : glimpse) outline = lower_part(outline, hidden_share);
      shown.show(glimpse);
      const Eigen::Vector3d p_Root_m(-0.32, 0.05, -0.03);
      for (int i = 0; i < 12; ++i) shown.show(shown.outlines(p_Root_m, 0.5));
      const auto& seen = shown.show(shown.outlines(p_Root_m, 0.5));
      ASSERT_EQ(seen.size(), 1U) << hidden_share << " hidden, " << fallen_m << " m fallen";
      EXPECT_FALSE(seen[0].occluded);
      EXPECT_LT((seen[0].p_RootObject_m - p_Root_m).norm(), 0.002)
          << hidden_share << " hidden, " << fallen_m << " m fallen";
    }
  }
}

// A known thing that an arm covers in part stays where it was.
TEST(Tracker, AKnownThingStaysBehindWhatCoversIt) {
  Shown shown;
  const Eigen::Vector3d p_Root_m(-0.32, 0.05, -0.03);
  for (int i = 0; i < 12; ++i) shown.show(shown.outlines(p_Root_m, 0.5));
  OutlinePair covered = shown.outlines(p_Root_m, 0.5);
  for (Polygon& outline : covered) outline = lower_part(outline, 0.4);
  for (int i = 0; i < 12; ++i) shown.show(covered);
  const auto& seen = shown.show(covered);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_TRUE(seen[0].occluded);
  EXPECT_LT((seen[0].p_RootObject_m - p_Root_m).norm(), 0.002);
}

// Somebody takes a thing away and puts another one of its colour there.
TEST(Tracker, TheOldNameGoesWithTheThing) {
  for (const double ball_radius_m : {0.02, 0.025, 0.03}) {
    const TemplateSet templates = cube_and_ball(ball_radius_m);
    Shown shown(templates);
    const Eigen::Vector3d p_Root_m(-0.32, 0.05, -0.0576);
    for (int i = 0; i < 40; ++i) shown.show(shown.outlines(p_Root_m, 0.5));
    const Eigen::Vector3d p_RootBall_m(-0.32, 0.05, -0.0826 + ball_radius_m);
    const Body& ball = templates.objects[1].body;
    OutlinePair round;
    for (std::size_t e = 0; e < 2; ++e) round[e] = ball.outline(eyes_over_the_table()[e], p_RootBall_m, 0.0);
    double named_after_s = -1;
    for (int i = 0; i < 90 && named_after_s < 0; ++i) {
      const auto& seen = shown.show(round);
      if (seen.size() == 1 && seen[0].name == "blue ball" &&
          (seen[0].p_RootObject_m - p_RootBall_m).norm() < 0.004)
        named_after_s = i * 0.033;
    }
    EXPECT_GE(named_after_s, 0.0) << "still the old name after 3 s; radius " << ball_radius_m;
    for (int i = 0; i < 30; ++i) {
      const auto& seen = shown.show(round);
      ASSERT_EQ(seen.size(), 1U);
      EXPECT_EQ(seen[0].name, "blue ball");
    }
  }
}

}  // namespace
}  // namespace nido::vision
