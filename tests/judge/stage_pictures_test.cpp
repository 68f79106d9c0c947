#include "nido/judge/stage_pictures.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

namespace nido {
namespace {

CameraFrame grey(std::int64_t stamp_ns, std::uint8_t value, int width = 320, int height = 240) {
  CameraFrame frame;
  frame.stamp_ns = stamp_ns;
  frame.width = width;
  frame.height = height;
  frame.rgb.assign(static_cast<std::size_t>(width * height * 3), value);
  return frame;
}

std::string fresh_folder() {
  const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  const auto folder = std::filesystem::path(testing::TempDir()) /
                      ("stage_pictures_test_" + test + "_" + std::to_string(getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder.string();
}

using Camera = StagePictures::Camera;

TEST(StagePictures, WritesWhatTheCamerasGaveWithWhatWasFound) {
  const std::string folder = fresh_folder();
  StagePictures sut(folder);
  sut.frame(Camera::kLeft, grey(10, 90));
  sut.frame(Camera::kRight, grey(10, 90));
  sut.frame(Camera::kOutside, grey(10, 90, 64, 48));
  sut.found(10, {{"blue cube", {100, 100, 40, 40}, {60, 100, 40, 40}}});
  std::vector<std::string> troubles;
  const auto pictures = sut.capture("seen", troubles);
  EXPECT_TRUE(troubles.empty());
  ASSERT_EQ(pictures.size(), 3U);
  EXPECT_EQ(pictures[0].file, "stage-01-seen-left.png");
  EXPECT_EQ(pictures[2].file, "stage-01-seen-outside.png");
  const cv::Mat left = cv::imread(folder + "/" + pictures[0].file);
  const cv::Mat right = cv::imread(folder + "/" + pictures[1].file);
  ASSERT_FALSE(left.empty());
  // white edge of the box where it was found, grey elsewhere
  EXPECT_GT(left.at<cv::Vec3b>(220, 200)[1], 180);
  EXPECT_LT(right.at<cv::Vec3b>(220, 240)[1], 120);
  EXPECT_GT(right.at<cv::Vec3b>(220, 120)[1], 180);
  EXPECT_NEAR(left.at<cv::Vec3b>(20, 20)[0], 90, 2);
}

TEST(StagePictures, ShowsTheFrameThatVisionLookedAt) {
  const std::string folder = fresh_folder();
  StagePictures sut(folder);
  for (std::int64_t i = 1; i <= 5; ++i) sut.frame(Camera::kLeft, grey(i, static_cast<std::uint8_t>(40 * i)));
  sut.found(3, {});
  std::vector<std::string> troubles;
  const auto pictures = sut.capture("a", troubles);
  ASSERT_EQ(pictures.size(), 1U);
  EXPECT_NEAR(cv::imread(folder + "/" + pictures[0].file).at<cv::Vec3b>(5, 5)[0], 120, 2);
}

TEST(StagePictures, BrokenFramesAndBoxesAreLeftOut) {
  const std::string folder = fresh_folder();
  StagePictures sut(folder);
  CameraFrame broken = grey(1, 50);
  broken.rgb.pop_back();
  sut.frame(Camera::kLeft, broken);
  std::vector<std::string> troubles;
  EXPECT_TRUE(sut.capture("none", troubles).empty());
  sut.frame(Camera::kLeft, grey(1, 50));
  sut.found(1, {{"far", {1e9, -1e9, 5, 5}, {}}, {"nan", {NAN, 0, 5, 5}, {}}, {"empty", {0, 0, 0, 0}, {}}});
  EXPECT_EQ(sut.capture("../../evil name", troubles).size(), 1U);
  EXPECT_TRUE(std::filesystem::exists(folder + "/stage-02-------evil-name-left.png"));
}

TEST(StagePictures, AFolderThatIsGoneIsTold) {
  StagePictures sut("/nowhere/at/all");
  sut.frame(Camera::kLeft, grey(1, 50));
  std::vector<std::string> troubles;
  EXPECT_TRUE(sut.capture("x", troubles).empty());
  ASSERT_EQ(troubles.size(), 1U);
  EXPECT_NE(troubles[0].find("/nowhere/at/all"), std::string::npos);
}

}  // namespace
}  // namespace nido
