// Attention on made pairs of pictures, whose truth is known: a patterned patch moves before a patterned wall.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nido/attention/surface_tracker.h"
#include "truth.h"

namespace nido::attention {
namespace {

constexpr double kBaseline_m = 0.068;
constexpr double kWall_m = 0.6;
constexpr double kPeriod_s = 1.0 / 30;

// Grains of about 4 pixels, as large as the picture.
cv::Mat grain(std::uint64_t seed, const cv::Scalar& tint) {
  cv::Mat noise(60, 80, CV_8UC3);
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::UNIFORM, 40, 160);
  cv::Mat large;
  cv::resize(noise, large, {320, 240}, 0, 0, cv::INTER_LINEAR);
  return large + tint;
}

// Two parallel eyes before a wall and a square patch that faces them. Root frame: the left eye's at the
// start.
struct Theatre {
  cv::Mat wall = grain(1, {0, 0, 0});
  cv::Mat cloth = grain(2, {0, 0, 0});
  PinholeCamera camera;
  double edge_m = 0.08;

  struct Shot {
    cv::Mat left;
    cv::Mat right;
    std::vector<std::uint8_t> truth;  // of the left picture
    vision::EyePair eyes;
  };
  // p_Patch_m: the patch's middle in the left eye's frame.
  [[nodiscard]] Shot shoot(const Eigen::Vector3d& p_Patch_m, double turn_rad) const {
    Shot shot;
    shot.truth.assign(320 * 240, 0);
    for (std::size_t e = 0; e < 2; ++e) {
      shot.eyes[e].camera = camera;
      shot.eyes[e].X_RootCamera = Eigen::Isometry3d::Identity();
      shot.eyes[e].X_RootCamera.translation().x() = e == 0 ? 0 : kBaseline_m;
      cv::Mat picture(240, 320, CV_8UC3);
      for (int y = 0; y < 240; ++y) {
        for (int x = 0; x < 320; ++x) {
          const Eigen::Vector3d ray((x + 0.5 - camera.cx_px) / camera.fx_px,
                                    (y + 0.5 - camera.cy_px) / camera.fy_px, 1);
          const Eigen::Vector3d origin = shot.eyes[e].X_RootCamera.translation();
          const Eigen::Vector3d at = origin + ray * p_Patch_m.z() - p_Patch_m;
          const Eigen::Vector2d p = Eigen::Rotation2Dd(-turn_rad) * at.head<2>();
          const bool on = p.cwiseAbs().maxCoeff() < edge_m / 2;
          if (on && e == 0) shot.truth[static_cast<std::size_t>(y * 320 + x)] = 255;
          const Eigen::Vector3d far = origin + ray * kWall_m;
          const Eigen::Vector2d from = on ? Eigen::Vector2d(p * 1200) : Eigen::Vector2d(far.head<2>() * 400);
          picture.at<cv::Vec3b>(y, x) = sample(on ? cloth : wall, from);
        }
      }
      (e == 0 ? shot.left : shot.right) = picture;
    }
    return shot;
  }

  static cv::Vec3b sample(const cv::Mat& from, const Eigen::Vector2d& px) {
    const double u = std::clamp(px.x() + 160, 0.0, 318.0);
    const double v = std::clamp(px.y() + 120, 0.0, 238.0);
    const int x = static_cast<int>(u);
    const int y = static_cast<int>(v);
    cv::Vec3b out;
    for (int c = 0; c < 3; ++c) {
      const double top =
          (1 - (u - x)) * from.at<cv::Vec3b>(y, x)[c] + (u - x) * from.at<cv::Vec3b>(y, x + 1)[c];
      const double low =
          (1 - (u - x)) * from.at<cv::Vec3b>(y + 1, x)[c] + (u - x) * from.at<cv::Vec3b>(y + 1, x + 1)[c];
      out[c] = static_cast<std::uint8_t>(std::lround((1 - (v - y)) * top + (v - y) * low));
    }
    return out;
  }
};

std::vector<std::uint8_t> flat(const cv::Mat& mask) { return {mask.datastart, mask.dataend}; }

Time at(int frame) { return {static_cast<std::int64_t>(frame * kPeriod_s * 1e9)}; }

TEST(PlaneSweep, KnowsHowFarAPatchIs) {
  const Theatre theatre;
  const auto shot = theatre.shoot({0.0, 0.0, 0.41}, 0);
  cv::Mat left;
  cv::Mat right;
  cv::resize(shot.left, left, {160, 120}, 0, 0, cv::INTER_AREA);
  cv::resize(shot.right, right, {160, 120}, 0, 0, cv::INTER_AREA);
  const PlaneSweep planes = sweep(left, right, shot.eyes, {60, 40, 40, 40}, 1 / 0.45, -8, 8);
  cv::Mat middle = cv::Mat::zeros(40, 40, CV_8U);
  middle(cv::Rect(12, 12, 16, 16)).setTo(255);
  const double depth_m = 1 / planes.inverse_depth(best_plane(planes, middle, -8, 8));
  EXPECT_NEAR(depth_m, 0.41, 0.004);
}

TEST(MarkovField, FillsWhatHasNoEvidenceUpToTheEdge) {
  // a grey square on a dark ground; only its middle and the far border have something to say
  cv::Mat picture(60, 60, CV_8UC3, cv::Scalar(40, 40, 40));
  picture(cv::Rect(15, 15, 30, 30)).setTo(cv::Scalar(150, 150, 150));
  cv::Mat evidence = cv::Mat::zeros(60, 60, CV_32F);
  evidence(cv::Rect(26, 26, 8, 8)).setTo(1.0);
  evidence.row(0).setTo(-1.0);
  evidence.row(59).setTo(-1.0);
  evidence.col(0).setTo(-1.0);
  evidence.col(59).setTo(-1.0);
  const cv::Mat on = most_likely(evidence, picture);
  cv::Mat truth = cv::Mat::zeros(60, 60, CV_8U);
  truth(cv::Rect(15, 15, 30, 30)).setTo(255);
  EXPECT_GT(intersection_over_union(flat(on), flat(truth)), 0.97);
}

TEST(Appearance, TellsColoursApartAndForgets) {
  cv::Mat picture(20, 40, CV_8UC3, cv::Scalar(200, 20, 20));
  picture.colRange(20, 40).setTo(cv::Scalar(20, 20, 200));
  cv::Mat left = cv::Mat::zeros(20, 40, CV_8U);
  left.colRange(0, 20).setTo(255);
  Appearance appearance;
  EXPECT_EQ(cv::countNonZero(appearance.log_odds(picture, 2)), 0);
  appearance.learn(picture, left, ~left, 0.8);
  const cv::Mat odds = appearance.log_odds(picture, 2);
  EXPECT_GT(odds.at<float>(10, 5), 1.0F);
  EXPECT_LT(odds.at<float>(10, 35), -1.0F);
  appearance.forget();
  EXPECT_TRUE(appearance.empty());
}

TEST(SurfaceTracker, HoldsAPatchThatMovesAndTurns) {
  const Theatre theatre;
  SurfaceTracker tracker({});
  tracker.start();
  double overlap = 0;
  double alone = 0;
  int frames = 0;
  for (int frame = 0; frame < 24; ++frame) {
    const double t = frame * kPeriod_s;
    const Eigen::Vector3d p(0.02 + 0.10 * t, 0.03 * std::sin(4 * t), 0.40 - 0.06 * t);
    const auto shot = theatre.shoot(p, 0.5 * t);
    const auto surface = tracker.step(at(frame), shot.left, shot.right, shot.eyes);
    ASSERT_TRUE(surface) << frame;
    if (frame < 6) continue;
    ++frames;
    overlap += intersection_over_union(flat(surface->mask), shot.truth);
    alone += intersection_over_union(flat(surface->threshold), shot.truth);
    EXPECT_LT((surface->p_Root_m - p).norm(), 0.012) << frame;
  }
  EXPECT_GT(overlap / frames, 0.85);
  EXPECT_GT(overlap, alone);
}

TEST(SurfaceTracker, GivesUpAfterAWhileWithoutASurfaceAndTakesTheNextOne) {
  const Theatre theatre;
  SurfaceTracker tracker({});
  tracker.start();
  const Eigen::Vector3d p(0.015, 0, 0.40);
  const auto shot = theatre.shoot(p, 0);
  ASSERT_TRUE(tracker.step(at(0), shot.left, shot.right, shot.eyes));
  // far beside: the point that it held on to is out of the picture
  vision::EyePair away = shot.eyes;
  for (auto& eye : away)
    eye.X_RootCamera = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY()) * eye.X_RootCamera;
  EXPECT_FALSE(tracker.step(at(1), shot.left, shot.right, away));
  EXPECT_TRUE(tracker.step(at(2), shot.left, shot.right, shot.eyes));
}

TEST(Truth, ABallsSilhouetteIsRoundAndOneInFrontHidesIt) {
  Placed ball{1, Eigen::Isometry3d::Identity()};  // radius 3 cm
  ball.X_RootThing.translation() << 0, 0, 0.4;
  const auto alone = silhouette({}, Eigen::Isometry3d::Identity(), {ball});
  const auto count = std::count(alone.begin(), alone.end(), 255);
  // tangent cone: tan = r / sqrt(d^2 - r^2)
  const double radius_px = 257.34 * 0.03 / std::sqrt(0.16 - 0.0009);
  EXPECT_NEAR(static_cast<double>(count), M_PI * radius_px * radius_px, 12);
  Placed cover = ball;
  cover.X_RootThing.translation().z() = 0.3;
  const auto hidden = silhouette({}, Eigen::Isometry3d::Identity(), {ball, cover});
  EXPECT_EQ(std::count(hidden.begin(), hidden.end(), 255), 0);
}

TEST(Scenes, AreTheSameForASeedAndMoveFromRestSmoothly) {
  const Scene a = make_scene(3, 2);
  const Scene b = make_scene(3, 2);
  ASSERT_TRUE(a.moving);
  EXPECT_TRUE(target_at(a, 3).isApprox(target_at(b, 3)));
  EXPECT_TRUE(target_at(a, 0.9).isApprox(a.target.X_RootThing));
  double fastest_m_s = 0;
  for (double t = 0; t < 4.5; t += 0.01) {
    const double step_m = (target_at(a, t + 0.01).translation() - target_at(a, t).translation()).norm();
    fastest_m_s = std::max(fastest_m_s, step_m / 0.01);
  }
  EXPECT_GT(fastest_m_s, 0.03);
  EXPECT_LT(fastest_m_s, 0.4);
  EXPECT_FALSE(make_scene(3, 0).moving);
  EXPECT_FALSE(make_scene(3, 1).others.empty());
}

}  // namespace
}  // namespace nido::attention
