#include "nido/calibration/self_calibration.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "nido/calibration/pose_chooser.h"

namespace nido::calibration {
namespace {

const std::filesystem::path kUrdf = NIDO_CONFIG_DIR "/robots/icub.urdf";

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = std::filesystem::temp_directory_path() / "nido-calibration-XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// A body that is not built as drawn, and what its eyes see: cameras without a renderer.
class Lab {
 public:
  explicit Lab(std::uint64_t seed, double off = 1.0, double noise_px = 0.15)
      : drawn_(RobotModel::load(kUrdf).value()), random_(seed), noise_px_(noise_px) {
    std::normal_distribution<double> normal(0.0, 1.0);
    for (const Unknown& unknown : default_unknowns("right")) {
      if (unknown.link == wrist_mark("right")) continue;
      LinkCorrection& link = body_.links[unknown.link];
      const int c = unknown.component;
      const double by = off * 0.5 * unknown.expected * std::clamp(normal(random_), -2.0, 2.0);
      (c < 3 ? link.p_m(c) : link.turn_rad(c - 3)) = by;
    }
    real_.emplace(load_corrected_model(kUrdf, body_).value());
    eyes_ = {*drawn_.camera_link("left"), *drawn_.camera_link("right")};
    const HandInfo hand = drawn_.hand("right").value();
    for (const HandMark& mark : hand.marks) marks_[mark.name == "wrist" ? 1 : 0] = mark.link;
  }
  [[nodiscard]] const RobotModel& drawn() const { return drawn_; }
  [[nodiscard]] std::array<PinholeCamera, 2> cameras() const { return {PinholeCamera{}, PinholeCamera{}}; }

  // Poses chosen as the process chooses them, under what is drawn.
  std::vector<PoseView> look(int poses, std::uint64_t seed) {
    PoseChooser chooser = PoseChooser::create(drawn_, "right", PinholeCamera{}, seed).value();
    std::normal_distribution<double> noise(0.0, noise_px_);
    std::vector<PoseView> views;
    reach::Joints arm = reach::Joints::Zero();
    arm.tail<reach::kArmJoints>() << -0.3, 0.9, 0.1, 1.2, 0.0, -0.2, 0.0;
    while (static_cast<int>(views.size()) < poses) {
      const auto pose = chooser.next(arm);
      if (!pose) {
        ADD_FAILURE() << "no pose";
        break;
      }
      arm = pose->arm_rad;
      PoseView view;
      view.axes_rad = chooser.axes(pose->arm_rad, pose->head_rad);
      for (std::size_t e = 0; e < 2; ++e) {
        const Eigen::Isometry3d X_CameraRoot = real_->X_RootLink(eyes_[e], view.axes_rad).inverse();
        for (std::size_t m = 0; m < 2; ++m) {
          const auto px = PinholeCamera{}.project(X_CameraRoot *
                                                  real_->X_RootLink(marks_[m], view.axes_rad).translation());
          if (px && PinholeCamera{}.contains(*px))
            view.mark_px[e][m] = *px + Eigen::Vector2d(noise(random_), noise(random_));
        }
      }
      if (view.mark_px[0][0] && view.mark_px[1][0]) views.push_back(view);
    }
    return views;
  }
  // Mean distance of the hand from where a believed body feels it.
  [[nodiscard]] double error_m(const BodyCorrections& corrections, const std::vector<PoseView>& views) const {
    const RobotModel believed = load_corrected_model(kUrdf, corrections).value();
    double sum = 0;
    for (const PoseView& view : views) {
      sum += (believed.X_RootLink(marks_[0], view.axes_rad).translation() -
              real_->X_RootLink(marks_[0], view.axes_rad).translation())
                 .norm();
    }
    return sum / static_cast<double>(views.size());
  }

 private:
  RobotModel drawn_;
  BodyCorrections body_;
  std::optional<RobotModel> real_;
  std::array<int, 2> eyes_{};
  std::array<int, 2> marks_{};
  std::mt19937_64 random_;
  double noise_px_;
};

TEST(SelfCalibration, FindsHowTheBodyIsBuiltFromLooksAtItsHand) {
  for (const std::uint64_t seed : {1, 2}) {
    Lab lab(seed);
    const auto views = lab.look(50, 10 + seed);
    const auto held_out = lab.look(30, 20 + seed);
    const double before_m = lab.error_m({}, held_out);
    const auto found = calibrate(lab.drawn(), "right", lab.cameras(), views, default_unknowns("right"));
    ASSERT_TRUE(found) << found.error().message;
    const double after_m = lab.error_m(found->corrections, held_out);
    RecordProperty("before_mm_" + std::to_string(seed), std::to_string(1000 * before_m));
    RecordProperty("after_mm_" + std::to_string(seed), std::to_string(1000 * after_m));
    EXPECT_GT(before_m, 0.01) << "there is something to find";
    EXPECT_LT(after_m, 0.005);
    EXPECT_LT(found->rms_px, 0.4);
  }
}

TEST(SelfCalibration, ABodyAsDrawnIsLeftAsDrawn) {
  Lab lab(3, 0.0);
  const auto found =
      calibrate(lab.drawn(), "right", lab.cameras(), lab.look(40, 5), default_unknowns("right"));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(lab.error_m(found->corrections, lab.look(20, 6)), 0.003);
}

TEST(SelfCalibration, WildSightingsDoNotCount) {
  Lab lab(4);
  auto views = lab.look(60, 7);
  const auto held_out = lab.look(20, 8);
  for (std::size_t v = 0; v < views.size(); v += 8) views[v].mark_px[0][0] = Eigen::Vector2d(20, 200);
  const auto found = calibrate(lab.drawn(), "right", lab.cameras(), views, default_unknowns("right"));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GE(found->wild, 6);
  EXPECT_LT(lab.error_m(found->corrections, held_out), 0.006);
}

TEST(SelfCalibration, RefusesWhatCannotBe) {
  Lab lab(5);
  auto views = lab.look(4, 9);
  EXPECT_EQ(
      calibrate(lab.drawn(), "right", lab.cameras(), {views[0]}, default_unknowns("right")).error().code,
      ErrorCode::kInvalidArgument);
  EXPECT_FALSE(calibrate(lab.drawn(), "middle", lab.cameras(), views, default_unknowns("right")));
  EXPECT_FALSE(calibrate(lab.drawn(), "right", lab.cameras(), views, {{"l_foot", 5, 0.1}}));
  views[1].axes_rad(0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(calibrate(lab.drawn(), "right", lab.cameras(), views, default_unknowns("right")));
}

TEST(SelfCalibration, ViewsKeepInAFile) {
  Lab lab(6);
  const TemporaryFolder folder;
  ViewsFile file{lab.cameras(), lab.look(3, 2)};
  file.views[1].mark_px[1][1].reset();
  ASSERT_TRUE(save_views(folder / "views.txt", file, "a test"));
  const auto back = load_views(folder / "views.txt");
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->views.size(), 3U);
  EXPECT_EQ(back->views[0].axes_rad, file.views[0].axes_rad);
  EXPECT_EQ(back->views[0].mark_px[0][0], file.views[0].mark_px[0][0]);
  EXPECT_FALSE(back->views[1].mark_px[1][1]);
  EXPECT_FALSE(load_views(folder / "none.txt"));
}

TEST(BodyCorrections, KeepInAFileAndMoveTheModel) {
  const TemporaryFolder folder;
  BodyCorrections corrections;
  corrections.links["r_forearm"].p_m = {0.0, 0.02, 0.001};
  corrections.links["r_palm"].turn_rad = {0.01, -0.02, 0.1};
  corrections.links["l_eye"].turn_rad = {0.0, 0.05, 0.0};
  ASSERT_TRUE(corrections.save(folder / "body.yaml", "a test"));
  const auto model = load_corrected_model(kUrdf, folder / "body.yaml");
  ASSERT_TRUE(model) << model.error().message;
  const RobotModel drawn = RobotModel::load(kUrdf).value();
  for (std::size_t l = 0; l < drawn.links().size(); ++l) {
    const BodyLink& link = drawn.links()[l];
    const auto at = corrections.links.find(link.name);
    const Eigen::Isometry3d expected =
        at == corrections.links.end() ? link.X_ParentChild0 : link.X_ParentChild0 * at->second.X_DrawnReal();
    EXPECT_TRUE(model->links()[l].X_ParentChild0.isApprox(expected, 1e-8)) << link.name;
  }
}

TEST(BodyCorrections, BadFilesAreRefusedWithTheirLine) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    std::ofstream(folder / "bad.yaml") << text;
    const auto loaded = load_corrected_model(kUrdf, folder / "bad.yaml");
    return loaded ? std::string() : loaded.error().message;
  };
  EXPECT_NE(refused("links:\n  r_palm: {p_m: [0, 0, 0.5]}\n").find("bad.yaml:2:"), std::string::npos);
  EXPECT_NE(refused("links:\n  r_palm: {turn: [0, 0, 0]}\n").find("allowed: p_m, turn_rad"),
            std::string::npos);
  EXPECT_NE(refused("links:\n  r_palm: {turn_rad: [0, .nan, 0]}\n").find("three numbers"), std::string::npos);
  EXPECT_NE(refused("links:\n  tail: {p_m: [0, 0, 0]}\n").find("another robot"), std::string::npos);
  EXPECT_FALSE(refused("joints: 3\n").empty());
  EXPECT_FALSE(refused("[1, 2").empty());
  EXPECT_FALSE(load_corrected_model(kUrdf, folder / "none.yaml"));
}

}  // namespace
}  // namespace nido::calibration
