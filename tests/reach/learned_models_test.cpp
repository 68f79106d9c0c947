#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "kinematic_robot.h"
#include "nido/reach/babbling.h"
#include "nido/reach/posture_network.h"
#include "nido/reach/seen_hand.h"

namespace nido::reach {
namespace {

std::vector<BabblingSample> babble(int count, bool whole_body, std::uint64_t seed) {
  BabblingOptions options;
  options.spacing_rad = 0.12;  // few samples that are far apart
  options.samples = count;
  options.whole_body = whole_body;
  options.seed = seed;
  Babbling babbling(right_arm(), options);
  Joints start = Joints::Zero();
  start.segment<5>(kTorsoJoints) << -0.5, 0.5, 0.2, 1.2, 0.0;
  KinematicRobot robot(start, seed);
  for (long tick = 0; tick < 2000000 && !babbling.complete(); ++tick) {
    std::optional<HandSighting> hand;
    if (tick % 3 == 0) hand = robot.look();
    robot.step(babbling.step(robot.time_s(), robot.q(), hand));
  }
  return babbling.samples();
}

TEST(Babbling, GathersTheSamplesAskedForWithinTheLimits) {
  const auto samples = babble(200, true, 3);
  ASSERT_EQ(samples.size(), 200U);
  for (const BabblingSample& sample : samples) {
    EXPECT_GE((sample.q - right_arm().min()).minCoeff(), -1e-9);
    EXPECT_GE((right_arm().max() - sample.q).minCoeff(), -1e-9);
    const Eigen::Vector3d mark = right_arm().X_RootPalm(sample.q) * KinematicRobot::mark_Palm_m();
    EXPECT_LT((sample.p_Root_m - KinematicRobot::seen(mark)).norm(), 0.012)
        << "image and posture of one moment";
  }
}

TEST(Babbling, SamplesSurviveAFile) {
  const auto samples = babble(30, false, 4);
  const auto path = std::filesystem::temp_directory_path() / ("nido_babbling_" + std::to_string(getpid()));
  ASSERT_TRUE(save_samples(path, samples, "test").ok());
  const auto loaded = load_samples(path);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_EQ(loaded->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ((*loaded)[i].q, samples[i].q);
    EXPECT_EQ((*loaded)[i].p_Root_m, samples[i].p_Root_m);
  }
  std::filesystem::remove(path);
  EXPECT_FALSE(save_samples(path, {}, "test").ok());
}

TEST(SeenHandModel, LearnsWhatTheEyesSeeDifferently) {
  const auto samples = babble(4000, true, 5);
  SeenHandModel::TrainingReport report;
  const auto model = SeenHandModel::train(right_arm(), samples, {}, &report);
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_GT(report.prior_rms_m, 0.006) << "the eyes' error of the fake is larger";
  EXPECT_LT(report.learned_rms_m, 0.0045) << "noise alone is 3.5 mm";

  double sum = 0.0;
  const auto fresh = babble(200, true, 6);
  for (const BabblingSample& sample : fresh) {
    const Eigen::Vector3d mark = right_arm().X_RootPalm(sample.q) * KinematicRobot::mark_Palm_m();
    sum += (model->mark_Root_m(right_arm(), sample.q) - KinematicRobot::seen(mark)).norm();
  }
  EXPECT_LT(sum / static_cast<double>(fresh.size()), 0.0025);

  learning::WeightsFile file;
  file.command = "test";
  model->write_to(file);
  const auto copy =
      SeenHandModel::read_from(learning::WeightsFile::from_text(file.to_text(), "text").value());
  ASSERT_TRUE(copy.ok()) << copy.error().message;
  EXPECT_EQ(copy->mark_Root_m(right_arm(), fresh[0].q), model->mark_Root_m(right_arm(), fresh[0].q));
  file.matrices.erase("mark.p_PalmMark_m");
  EXPECT_FALSE(SeenHandModel::read_from(file).ok());
}

TEST(SeenHandModel, WrongSightingsAreLeftOutAndTooFewRefused) {
  auto samples = babble(400, true, 7);
  for (std::size_t i = 0; i < samples.size(); i += 10) samples[i].p_Root_m += Eigen::Vector3d(0.2, 0.0, -0.1);
  SeenHandModel::TrainingReport report;
  ASSERT_TRUE(SeenHandModel::train(right_arm(), samples, {}, &report).ok());
  EXPECT_EQ(report.outliers, 40U);
  samples.resize(50);
  EXPECT_FALSE(SeenHandModel::train(right_arm(), samples, {}).ok());
}

TEST(PostureNetwork, LearnsThePapersMapAndItsErrorsAreInTheReport) {
  const auto samples = babble(2000, false, 8);
  PostureNetwork::TrainingReport report;
  const auto network = PostureNetwork::train(right_arm(), samples, {.iterations = 200, .rate = 0.05},
                                             PostureNetwork::Iteration::kPass, &report);
  ASSERT_TRUE(network.ok()) << network.error().message;
  EXPECT_LT(report.rmse_test, 0.8 * report.curve.front().test_rmse);
  EXPECT_LT(report.rmse_test, 0.25);
  EXPECT_EQ(report.rmse_joint.size(), 5);
  EXPECT_NEAR(std::sqrt(report.rmse_joint.squaredNorm() / 5.0), report.rmse_test, 1e-12);
  for (const BabblingSample& sample : samples) {
    const auto posture = network->posture_rad(sample.p_Root_m);
    for (int i = 0; i < 5; ++i) {
      EXPECT_GE(posture(i), right_arm().min()(kTorsoJoints + i));
      EXPECT_LE(posture(i), right_arm().max()(kTorsoJoints + i));
    }
  }
  learning::WeightsFile file;
  network->write_to(file);
  const auto copy = PostureNetwork::read_from(file);
  ASSERT_TRUE(copy.ok());
  EXPECT_EQ(copy->posture_rad(samples[0].p_Root_m), network->posture_rad(samples[0].p_Root_m));
}

}  // namespace
}  // namespace nido::reach
