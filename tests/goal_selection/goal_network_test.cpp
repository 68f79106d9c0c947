#include "nido/goal_selection/goal_network.h"

#include <gtest/gtest.h>

#include "nido/goal_selection/goal_training.h"
#include "nido/learning/weights_file.h"

namespace nido {
namespace {

PhraseBook shipped_book() {
  auto book = PhraseBook::load(NIDO_CONFIG "/phrases.yaml");
  EXPECT_TRUE(book.ok());
  return book.ok() ? *book : PhraseBook{};
}

TEST(GoalCode, EveryPhraseHasItsOwnCode) {
  const GoalCode code(shipped_book());
  EXPECT_EQ(code.input_size(), 7 + 3 + 7);
  for (std::size_t i = 0; i < 28; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_GT((code.encode({}, i) - code.encode({}, k)).norm(), 0.5);
    }
  }
}

TEST(GoalCode, NothingSeenAndNothingSaidIsZero) {
  const GoalCode code(shipped_book());
  EXPECT_EQ(code.encode({}, {}).norm(), 0.0);
}

TEST(GoalCode, WildPerceptsAreBounded) {
  const GoalCode code(shipped_book());
  VisionParameters seen;
  seen.p_RootObject_m = {-100.0, 50.0, -3.0};
  seen.width_m = 1000.0;
  const Eigen::VectorXd input = code.encode(seen, {});
  EXPECT_LE(input.maxCoeff(), 1.5);
  EXPECT_GE(input.minCoeff(), -0.5);
}

TEST(GoalTraining, ReachesTheErrorOfTheExperiment) {
  const GoalTraining training = train_goal_network(GoalCode(shipped_book()), {});
  EXPECT_LE(training.report.rmse_test, 0.0368);
  EXPECT_EQ(training.report.accuracy, 1.0);
  EXPECT_EQ(training.report.idle_without_speech, 1.0);
  ASSERT_GT(training.report.curve.size(), 50U);
  EXPECT_LT(training.report.curve.back().train_rmse, 0.2 * training.report.curve.front().train_rmse);
}

TEST(GoalTraining, PairsThatWereNeverTaughtAreUnderstood) {
  int understood = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    GoalTrainingOptions options;
    options.seed = seed;
    options.held_out = 6;
    understood +=
        train_goal_network(GoalCode(shipped_book()), options).report.held_out_accuracy > 0.8 ? 1 : 0;
  }
  EXPECT_GE(understood, 4);
}

TEST(GoalTraining, SameSeedSameWeights) {
  const GoalCode code(shipped_book());
  GoalTrainingOptions options;
  options.iterations = 2000;
  const auto first = train_goal_network(code, options);
  const auto second = train_goal_network(code, options);
  EXPECT_EQ(first.network.layers()[0].weights, second.network.layers()[0].weights);
  options.seed = 2;
  EXPECT_NE(train_goal_network(code, options).network.layers()[0].weights, first.network.layers()[0].weights);
}

TEST(GoalNetwork, ShippedWeightsKnowEveryPhraseAndStayIdleWithoutOne) {
  const PhraseBook book = shipped_book();
  const auto network = GoalNetwork::load(NIDO_CONFIG "/weights/goal_selection.txt", book);
  ASSERT_TRUE(network.ok()) << network.error().message;
  for (std::size_t i = 0; i < book.phrases.size(); ++i) {
    const NamedObject& object = book.object_of(book.phrases[i]);
    VisionParameters seen;
    seen.p_RootObject_m = {-0.3, 0.1, -0.05};
    seen.width_m = 0.055;
    seen.height_m = 0.055;
    seen.colour = object.colour;
    seen.shape = object.shape;
    EXPECT_EQ(network->choose(seen, i).action, action_of(book.phrases[i].verb)) << book.phrases[i].text;
    EXPECT_EQ(network->choose(seen, {}).action, Action::kIdle) << object.name;
  }
}

GoalNetwork shipped_network() {
  return GoalNetwork::load(NIDO_CONFIG "/weights/goal_selection.txt", shipped_book()).value();
}
VisionParameters seen_as(const std::string& colour, const std::string& shape) {
  return {{-0.31, 0.07, -0.05}, 0.06, 0.06, colour, shape};
}

TEST(GoalLessons, ABareNameAsksForWhatWasTaughtAndThePhrasesAreKept) {
  GoalNetwork network = shipped_network();
  EXPECT_FALSE(network.choose_by_name(seen_as("purple", "ball"), "plum"));
  const std::vector<GoalLesson> lessons = {{"plum", Action::kDrop, seen_as("purple", "ball")},
                                           {"bottle", Action::kReach, seen_as("teal", "cylinder")},
                                           {"brick", Action::kGrasp, seen_as("amber", "cube")}};
  for (const GoalLesson& lesson : lessons) {
    const Status taught = network.teach(lesson);
    ASSERT_TRUE(taught.ok()) << taught.error().message;
  }
  for (const GoalLesson& lesson : lessons) {
    VisionParameters elsewhere = lesson.seen;
    elsewhere.p_RootObject_m = {-0.40, -0.15, -0.05};
    EXPECT_EQ(network.choose_by_name(elsewhere, lesson.name)->action, lesson.action) << lesson.name;
  }
  const PhraseBook book = shipped_book();
  for (std::size_t i = 0; i < book.phrases.size(); ++i) {
    const NamedObject& object = book.object_of(book.phrases[i]);
    const auto choice = network.choose(seen_as(object.colour, object.shape), i);
    EXPECT_EQ(choice.action, action_of(book.phrases[i].verb)) << book.phrases[i].text;
  }
  EXPECT_EQ(network.choose(seen_as("purple", "ball"), std::nullopt).action, Action::kIdle);
  // said otherwise later
  ASSERT_TRUE(network.teach({"plum", Action::kGrasp, seen_as("purple", "ball")}).ok());
  EXPECT_EQ(network.lessons().size(), 3U);
  EXPECT_EQ(network.choose_by_name(seen_as("purple", "ball"), "plum")->action, Action::kGrasp);
}

TEST(GoalLessons, OutliveTheProcessInAFile) {
  const std::string path = testing::TempDir() + "nido_goal_lessons.txt";
  const std::vector<GoalLesson> lessons = {{"plum", Action::kDrop, seen_as("purple", "ball")},
                                           {"old bottle", Action::kReach, seen_as("teal", "cylinder")}};
  ASSERT_TRUE(save_lessons(lessons, path).ok());
  const auto read = load_lessons(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[1].name, "old bottle");
  EXPECT_EQ((*read)[1].action, Action::kReach);
  EXPECT_EQ((*read)[1].seen.shape, "cylinder");
  EXPECT_EQ((*read)[1].seen.p_RootObject_m, lessons[1].seen.p_RootObject_m);
  EXPECT_EQ(load_lessons(path + ".none").error().code, ErrorCode::kNotFound);
}

TEST(GoalNetwork, WeightsOfAnotherShapeAreRefused) {
  const PhraseBook book = shipped_book();
  const std::string path = testing::TempDir() + "goal_network_test.txt";
  learning::WeightsFile file;
  file.command = "test";
  learning::Mlp::random(3, {{15, learning::Activation::kSigmoid}, {4, learning::Activation::kSigmoid}}, 1)
      .write_to(file, "goal_selection");
  ASSERT_TRUE(file.save(path).ok());
  const auto network = GoalNetwork::load(path, book);
  ASSERT_FALSE(network.ok());
  EXPECT_NE(network.error().message.find("3 inputs"), std::string::npos) << network.error().message;
  const auto missing = GoalNetwork::load("/nowhere/weights.txt", book);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace nido
