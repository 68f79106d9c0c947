// Gaze on a head that does at once what it is told.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "nido/vision/gaze_controller.h"
#include "nido/vision/vision_core.h"

namespace nido::vision {
namespace {

RobotModel icub() {
  auto model = RobotModel::load(std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf");
  EXPECT_TRUE(model.ok());
  return std::move(model).value();
}

double off_centre_px(const RobotModel& model, const GazeController::HeadJoints& head,
                     const Eigen::Vector3d& p_Root_m) {
  const Eigen::VectorXd axes = *model.axes_from_parts({{"head", {head.begin(), head.end()}}});
  double worst = 0;
  for (const char* side : {"left", "right"}) {
    const auto px =
        PinholeCamera{}.project(model.X_RootLink(*model.camera_link(side), axes).inverse() * p_Root_m);
    if (!px) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, (*px - Eigen::Vector2d(160, 120)).norm());
  }
  return worst;
}

TEST(Gaze, SolvesForPointsOnTheTable) {
  const RobotModel model = icub();
  const auto gaze = GazeController::create(model, PinholeCamera{}, {});
  ASSERT_TRUE(gaze.ok());
  for (double x = -0.5; x < -0.24; x += 0.05) {
    for (double y = -0.25; y < 0.26; y += 0.05) {
      const Eigen::Vector3d p(x, y, -0.06);
      const auto head = gaze->solve(p, {0, 0, 0}, {});
      EXPECT_LT(off_centre_px(model, head, p), 2.0) << p.transpose();
      for (int i = 0; i < 6; ++i) {
        EXPECT_GE(head[static_cast<std::size_t>(i)],
                  model.parts()[0].axes[static_cast<std::size_t>(i)].lower_rad);
        EXPECT_LE(head[static_cast<std::size_t>(i)],
                  model.parts()[0].axes[static_cast<std::size_t>(i)].upper_rad);
      }
    }
  }
}

TEST(Gaze, FollowsAPointWithinItsSpeedsAndSaysWhenItIsThere) {
  const RobotModel model = icub();
  const GazeSettings settings;
  auto gaze = GazeController::create(model, PinholeCamera{}, settings);
  ASSERT_TRUE(gaze.ok());
  const Eigen::Vector3d p(-0.3, 0.2, -0.05);
  ASSERT_TRUE(gaze->set_goal({"point", "", p}).ok());
  GazeController::HeadJoints head{};
  double speed = 0;
  int reached = -1;
  for (int tick = 0; tick < 300; ++tick) {
    const auto out = gaze->step(Time{tick * 10'000'000LL}, 0.01, head, {0, 0, 0}, speed, {});
    speed = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double step = std::abs(out.command_rad[i] - head[i]);
      const double limit = i < 3 ? settings.neck_speed_rad_s : settings.eye_speed_rad_s * (i == 5 ? 2 : 1);
      EXPECT_LE(step, limit * 0.01 + 1e-9) << "joint " << i << " tick " << tick;
      speed = std::max(speed, step / 0.01);
    }
    if (out.status.fixated) {
      EXPECT_LT(off_centre_px(model, head, p), 9);
      if (reached < 0) reached = tick;
    }
    head = out.command_rad;
  }
  EXPECT_GT(reached, 10);
  EXPECT_LT(reached, 200);
  EXPECT_LT(off_centre_px(model, head, p), 1.0);
}

TEST(Gaze, FixatesWhatLiesTooNearAsWellAsItsJointsAllow) {
  const RobotModel model = icub();
  auto gaze = GazeController::create(model, PinholeCamera{}, {});
  ASSERT_TRUE(gaze.ok());
  const Eigen::Vector3d p(-0.19, 0.0, -0.06);
  ASSERT_TRUE(gaze->set_goal({"object", "thing", {}}).ok());
  GazeController::HeadJoints head{};
  bool fixated = false;
  for (int tick = 0; tick < 300; ++tick) {
    const auto out =
        gaze->step(Time{tick * 10'000'000LL}, 0.01, head, {0, 0, 0}, tick < 200 ? 1 : 0, GazeTarget{p, 0.0});
    EXPECT_TRUE(tick >= 200 || !out.status.fixated);
    fixated = out.status.fixated;
    head = out.command_rad;
  }
  EXPECT_TRUE(fixated);
  EXPECT_GT(off_centre_px(model, head, p), 8);
  EXPECT_LT(off_centre_px(model, head, p), 60);
}

TEST(Gaze, PursuesAMovingTarget) {
  const RobotModel model = icub();
  auto gaze = GazeController::create(model, PinholeCamera{}, {});
  ASSERT_TRUE(gaze.ok());
  ASSERT_TRUE(gaze->set_goal({"object", "thing", {}}).ok());
  GazeController::HeadJoints head{};
  double worst_px = 0;
  for (int tick = 0; tick < 600; ++tick) {
    const Eigen::Vector3d p(-0.32, 0.1 * std::sin(tick * 0.01), -0.05);
    const auto out = gaze->step(Time{tick * 10'000'000LL}, 0.01, head, {0, 0, 0}, 0, GazeTarget{p, 0.0});
    head = out.command_rad;
    if (tick > 200) worst_px = std::max(worst_px, off_centre_px(model, head, p));
  }
  EXPECT_LT(worst_px, 8);
}

TEST(Gaze, SearchesTheWholeTableOnce) {
  const RobotModel model = icub();
  const GazeSettings settings;
  auto gaze = GazeController::create(model, PinholeCamera{}, settings);
  ASSERT_TRUE(gaze.ok());
  ASSERT_TRUE(gaze->set_goal({"search", "red ball", {}}).ok());
  GazeController::HeadJoints head{};
  std::vector<bool> looked(settings.scan_Root_m.size(), false);
  double speed = 0;
  int tick = 0;
  bool done = false;
  for (; tick < 3000 && !done; ++tick) {
    const auto out = gaze->step(Time{tick * 10'000'000LL}, 0.01, head, {0, 0, 0}, speed, {});
    speed = 0;
    for (std::size_t i = 0; i < 6; ++i)
      speed = std::max(speed, std::abs(out.command_rad[i] - head[i]) / 0.01);
    head = out.command_rad;
    for (std::size_t i = 0; i < looked.size(); ++i) {
      if (off_centre_px(model, head, settings.scan_Root_m[i]) < 40) looked[i] = true;
    }
    done = out.status.search_done;
    EXPECT_FALSE(out.status.fixated);
  }
  EXPECT_TRUE(done);
  EXPECT_LT(tick, 1500);
  for (const bool seen : looked) EXPECT_TRUE(seen);
  // a target that turns up ends the search
  const auto out =
      gaze->step(Time{tick * 10'000'000LL}, 0.01, head, {0, 0, 0}, 0, GazeTarget{{-0.3, 0, -0.05}, 0.0});
  EXPECT_FALSE(out.status.search_done);
}

TEST(Gaze, RefusesWrongGoalsAndKeepsTheOld) {
  const RobotModel model = icub();
  auto gaze = GazeController::create(model, PinholeCamera{}, {});
  ASSERT_TRUE(gaze.ok());
  EXPECT_TRUE(gaze->set_goal({"hand", "right", {}}).ok());
  EXPECT_FALSE(gaze->set_goal({"stare", "", {}}).ok());
  EXPECT_FALSE(gaze->set_goal({"object", "", {}}).ok());
  EXPECT_FALSE(gaze->set_goal({"hand", "third", {}}).ok());
  EXPECT_FALSE(gaze->set_goal({"point", "", {NAN, 0, 0}}).ok());
  EXPECT_EQ(gaze->goal().mode, "hand");
}

TEST(VisionCore, RefusesPicturesAndEncodersThatDoNotFit) {
  const auto templates = TemplateSet::load(std::string(NIDO_CONFIG_DIR) + "/objects/templates.yaml");
  ASSERT_TRUE(templates.ok());
  auto core = VisionCore::create(icub(), *templates, {});
  ASSERT_TRUE(core.ok());
  const auto warned = [&](const std::function<void(VisionInputs&)>& fill) {
    VisionInputs in;
    fill(in);
    const auto out = (*core)->step(Time{0}, std::move(in));
    EXPECT_FALSE(out.pictures_stamp);
    return !out.warnings.empty();
  };
  EXPECT_TRUE(warned([](VisionInputs& in) { in.left.emplace(); }));
  EXPECT_TRUE(warned([](VisionInputs& in) { in.right = Image{0, 320, 240, std::vector<std::uint8_t>(10)}; }));
  EXPECT_TRUE(warned([](VisionInputs& in) { in.head = {{Time{0}, {0, 0, 0}, {}}}; }));
  EXPECT_TRUE(warned([](VisionInputs& in) { in.left_info = CameraInfo{320, 240, -1, 1, 0, 0, {}}; }));
  EXPECT_TRUE(warned([](VisionInputs& in) { in.gaze.emplace().mode = "stare"; }));

  // pictures of two different moments are no pair
  const auto black = [](std::int64_t stamp_ns) {
    return Image{stamp_ns, 320, 240, std::vector<std::uint8_t>(320 * 240 * 3)};
  };
  VisionInputs first;
  first.head = {{Time{0}, std::vector<double>(6), {}}};
  first.torso = {{Time{0}, std::vector<double>(3), {}}};
  first.left = black(1);
  first.right = black(2);
  const auto apart = (*core)->step(Time{2}, std::move(first));
  EXPECT_FALSE(apart.pictures_stamp);
  EXPECT_TRUE(apart.gaze);
  VisionInputs second;
  second.left = black(2);
  const auto together = (*core)->step(Time{3}, std::move(second));
  EXPECT_TRUE(together.pictures_stamp);
  EXPECT_TRUE(together.objects.empty());
}

}  // namespace
}  // namespace nido::vision
