#include "nido/judge/judge_core.h"

#include <gtest/gtest.h>

namespace nido {
namespace {

// A world that is as the test says.
class FakeTruth final : public GroundTruth {
 public:
  Eigen::Vector3d place{-0.3, 0.1, -0.0576};
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // a question
  Eigen::Vector3d palm{-0.3, 0.1, 0.0};
  bool hand = false;
  bool world = true;
  bool in_basket = false;
  bool silent = false;
  int questions = 0;

  Result<ObjectTruth> object(const std::string& name) override {
    if (auto status = ask(name); !status) return status.error();
    ObjectTruth truth;
    truth.X_RootObject.translation() = place;
    truth.size_m = {0.05, 0.05, 0.05};
    place += velocity;
    return truth;
  }
  Result<bool> held(const std::string& name) override {
    if (auto status = ask(name); !status) return status.error();
    return hand && !world;
  }
  Result<bool> inside(const std::string& name, const std::string&) override {
    if (auto status = ask(name); !status) return status.error();
    return in_basket;
  }
  Result<std::vector<Eigen::Isometry3d>> X_RootPalms() override {
    if (auto status = ask("palm"); !status) return status.error();
    Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();
    X_RootPalm.translation() = palm;
    return std::vector<Eigen::Isometry3d>{X_RootPalm};
  }

 private:
  Status ask(const std::string& name) {
    ++questions;
    if (silent) return Error{ErrorCode::kTimeout, "no answer about " + name};
    return {};
  }
};

class JudgeCoreTest : public testing::Test {
 protected:
  void SetUp() override { make({}); }
  void make(const JudgeSettings& settings) {
    const auto book = PhraseBook::load(NIDO_CONFIG "/phrases.yaml");
    ASSERT_TRUE(book.ok());
    auto core = JudgeCore::create(*book, settings);
    ASSERT_TRUE(core.ok());
    sut_.emplace(std::move(core).value());
  }
  void hear(const std::string& text) { sut_->heard({now_, now_ - 0.4, text, ""}); }
  void tell(const std::string& stage, const std::string& state, const std::string& text = "") {
    sut_->stage({now_, stage, state, "blue cube", text});
  }
  // lets time pass
  void wait(double seconds) {
    for (const double end = now_ + seconds; now_ < end && !sut_->tick(now_, truth_);) now_ += 0.01;
  }
  [[nodiscard]] double metric(const std::string& name) const {
    for (const auto& [key, value] : sut_->metrics()) {
      if (key == name) return value.value;
    }
    return -1.0;
  }
  void whole_drop() {
    hear("drop blue cube into basket");
    for (const char* stage :
         {"heard", "chosen", "seen", "reached", "grasped", "carried", "dropped", "idle"}) {
      tell(stage, "done", "fine");
      if (std::string(stage) != "idle") wait(1.0);
    }
  }

  std::optional<JudgeCore> sut_;
  FakeTruth truth_;
  double now_ = 0.0;
};

TEST_F(JudgeCoreTest, ADropIsGoodOnlyIfTheObjectLiesInTheBasket) {
  truth_.in_basket = true;
  whole_drop();
  EXPECT_FALSE(sut_->tick(now_, truth_)) << "it must be left to settle";
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_TRUE(sut_->outcome()->success);
  EXPECT_TRUE(sut_->outcome()->object_in_basket);
  EXPECT_EQ(sut_->outcome()->stage, "dropped");
  EXPECT_EQ(sut_->outcome()->goal, "drop");
  EXPECT_EQ(sut_->outcome()->object, "blue cube");
  EXPECT_EQ(sut_->outcome()->heard, "drop blue cube into basket");
  EXPECT_NEAR(metric("time_to_reached_s"), 3.0, 0.05);
  EXPECT_NEAR(metric("speech_latency_s"), 0.4, 1e-9);
}

TEST_F(JudgeCoreTest, AnOrderAboutAThingThatWasNamedIsJudgedAsAnyOther) {
  make({.expected = "this is a lemon; lemon; drop lemon into basket; lemon"});
  truth_.in_basket = true;
  hear("this is a lemon");
  wait(1.0);
  for (const char* said : {"lemon", "drop lemon into basket"}) {
    hear(said);
    tell("idle", "done", "fine");
    wait(1.0);
    EXPECT_FALSE(sut_->outcome()) << "another order is to come";
  }
  hear("lemon");
  tell("idle", "done", "I look at the lemon");
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_TRUE(sut_->outcome()->success) << sut_->outcome()->sentence;
  EXPECT_EQ(sut_->outcome()->object, "lemon");
  EXPECT_EQ(sut_->outcome()->goal, "look");
}

TEST_F(JudgeCoreTest, ABareNameIsJudgedByWhatWasTaughtAboutIt) {
  make({.expected = "this is a lemon; drop lemon into basket; lemon"});
  hear("this is a lemon");
  hear("drop lemon into basket");
  tell("idle", "done", "fine");
  wait(1.0);
  hear("lemon");
  tell("idle", "done", "I look at the lemon");
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_EQ(sut_->outcome()->goal, "drop");
  EXPECT_FALSE(sut_->outcome()->success) << "it is not in the basket";
}

TEST_F(JudgeCoreTest, LessonsOfAnEarlierDayCountAsWell) {
  make({.expected = "lemon", .lessons = {"drop lemon into basket"}});
  hear("lemon");
  tell("idle", "done", "I look at the lemon");
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_EQ(sut_->outcome()->goal, "drop");
  EXPECT_FALSE(sut_->outcome()->success);
}

TEST_F(JudgeCoreTest, WhatTheRobotBelievesDoesNotCount) {
  whole_drop();
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_FALSE(sut_->outcome()->object_in_basket);
  EXPECT_NE(sut_->outcome()->sentence.find("is not in the basket"), std::string::npos);
}

TEST_F(JudgeCoreTest, WhatRollsIsNotAtRest) {
  truth_.in_basket = true;
  truth_.velocity = {0.01, 0, 0};
  whole_drop();
  wait(10.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_NE(sut_->outcome()->sentence.find("not come to rest"), std::string::npos);
}

TEST_F(JudgeCoreTest, AGraspMustHoldForThreeSeconds) {
  hear("grasp blue cube");
  for (const char* stage : {"heard", "chosen", "seen", "reached"}) tell(stage, "done");
  tell("grasped", "done");
  truth_.place.z() += 0.12;
  truth_.hand = true;
  truth_.world = false;
  wait(4.0);
  EXPECT_FALSE(sut_->outcome());
  tell("idle", "done", "Done.");
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_TRUE(sut_->outcome()->success) << sut_->outcome()->sentence;
  EXPECT_GE(metric("hold_s"), 3.0);
}

TEST_F(JudgeCoreTest, AGraspThatBreaksInBetweenIsNone) {
  hear("grasp blue cube");
  tell("grasped", "done");
  truth_.place.z() += 0.12;
  truth_.hand = true;
  truth_.world = false;
  wait(2.0);
  truth_.hand = false;
  wait(0.5);
  truth_.hand = true;
  wait(1.5);
  truth_.place.z() -= 0.12;
  tell("idle", "done", "Done.");
  wait(10.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
}

TEST_F(JudgeCoreTest, HeldTooLowOrLeaningOnTheTableIsNotHeld) {
  for (const bool low : {true, false}) {
    make({});
    truth_ = {};
    truth_.hand = true;
    truth_.world = !low;
    truth_.place.z() += low ? 0.04 : 0.12;
    hear("grasp blue cube");
    tell("grasped", "done");
    wait(5.0);
    tell("idle", "done");
    wait(6.0);
    ASSERT_TRUE(sut_->outcome());
    EXPECT_FALSE(sut_->outcome()->success);
  }
}

TEST_F(JudgeCoreTest, AReachIsMeasuredFromThePalmToTheSurface) {
  // 5.4 cm over the centre is 2.9 cm over the surface
  for (const auto& [height, good] : {std::pair{0.054, true}, {0.056, false}}) {
    make({});
    truth_.palm = truth_.place + Eigen::Vector3d(0, 0, height);
    hear("reach blue cube");
    tell("reached", "done");
    tell("idle", "done");
    wait(1.0);
    ASSERT_TRUE(sut_->outcome());
    EXPECT_EQ(sut_->outcome()->success, good) << sut_->outcome()->sentence;
    EXPECT_NEAR(metric("palm_distance_m"), height - 0.025, 1e-9);
  }
}

TEST_F(JudgeCoreTest, AFailureNamesItsStageAndSentence) {
  hear("drop blue cube into basket");
  for (const char* stage : {"heard", "chosen", "seen", "reached"}) tell(stage, "done");
  tell("grasped", "failed", "I did not get hold of it. I try again (2 of 3).");
  tell("seen", "done");
  tell("grasped", "failed", "I did not get hold of it.");
  tell("idle", "failed", "I did not get hold of it.");
  wait(1.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_EQ(sut_->outcome()->stage, "grasped");
  EXPECT_EQ(sut_->outcome()->sentence, "I did not get hold of it.");
  EXPECT_EQ(metric("failed_tries"), 2.0);
}

TEST_F(JudgeCoreTest, TheWrongPhraseHeardIsAFailureOfHearing) {
  JudgeSettings settings;
  settings.expected = "drop red cube into basket";
  make(settings);
  truth_.in_basket = true;
  whole_drop();
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_EQ(sut_->outcome()->stage, "heard");
  EXPECT_NE(sut_->outcome()->sentence.find("red cube"), std::string::npos);
}

TEST_F(JudgeCoreTest, NoSuchPhraseIsAFailureOfHearing) {
  sut_->heard({now_, now_, "", "no such phrase: ..."});
  tell("heard", "failed", "I did not understand.");
  tell("idle", "failed", "I stay idle: no such phrase.");
  wait(1.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_EQ(sut_->outcome()->stage, "heard");
}

TEST_F(JudgeCoreTest, ANameAloneNeedsOnlyToBeLookedAt) {
  hear("blue cube");
  for (const char* stage : {"heard", "chosen", "seen"}) tell(stage, "done");
  tell("idle", "done", "I look at the blue cube.");
  wait(1.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_TRUE(sut_->outcome()->success);
  EXPECT_EQ(truth_.questions, 0);
}

TEST_F(JudgeCoreTest, ARunThatDoesNotEndIsEnded) {
  JudgeSettings settings;
  settings.limit_s = 5.0;
  make(settings);
  wait(10.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_LT(now_, 6.0);
}

TEST_F(JudgeCoreTest, AWorldThatDoesNotAnswerIsASentence) {
  truth_.silent = true;
  whole_drop();
  wait(5.0);
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_NE(sut_->outcome()->sentence.find("no answer about blue cube"), std::string::npos);
}

TEST_F(JudgeCoreTest, StoppedRunsHaveAnOutcomeToo) {
  hear("drop blue cube into basket");
  tell("heard", "done");
  sut_->give_up(3.0, "The run was stopped.");
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_EQ(sut_->outcome()->sentence, "The run was stopped.");
}

TEST(DistanceToBox, FollowsTheTurnOfTheBox) {
  ObjectTruth box;
  box.size_m = {0.2, 0.02, 0.02};
  EXPECT_NEAR(distance_to_box({0.0, 0.05, 0.0}, box), 0.04, 1e-12);
  EXPECT_EQ(distance_to_box({0.09, 0.0, 0.0}, box), 0.0);
  box.X_RootObject.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_EQ(distance_to_box({0.0, 0.05, 0.0}, box), 0.0);
  EXPECT_NEAR(distance_to_box({0.05, 0.0, 0.0}, box), 0.04, 1e-12);
}

TEST_F(JudgeCoreTest, SeveralOrdersEndWithTheLast) {
  JudgeSettings settings;
  settings.expected = "drop blue cube into basket; reach red ball";
  make(settings);
  FakeTruth truth;
  truth.in_basket = true;
  sut_->heard({2.0, 1.7, "drop blue cube into basket", ""});
  sut_->heard({4.0, 3.7, "reach red ball", ""});
  EXPECT_TRUE(sut_->stage({20.0, "idle", "done", "blue cube", "Done."}));
  EXPECT_FALSE(sut_->tick(20.1, truth));
  EXPECT_TRUE(sut_->stage({30.0, "idle", "done", "red ball", "Done."}));
  truth.palm = truth.place;
  EXPECT_TRUE(sut_->tick(30.1, truth));
  ASSERT_TRUE(sut_->outcome());
  EXPECT_TRUE(sut_->outcome()->success) << sut_->outcome()->sentence;
}

TEST_F(JudgeCoreTest, AnEarlierOrderThatLeftNothingInTheBasketCounts) {
  JudgeSettings settings;
  settings.expected = "drop blue cube into basket; reach red ball";
  make(settings);
  FakeTruth truth;
  sut_->heard({2.0, 1.7, "drop blue cube into basket", ""});
  sut_->stage({20.0, "idle", "done", "blue cube", "Done."});
  sut_->heard({24.0, 23.7, "reach red ball", ""});
  sut_->stage({30.0, "idle", "done", "red ball", "Done."});
  truth.palm = truth.place;
  EXPECT_TRUE(sut_->tick(30.1, truth));
  ASSERT_TRUE(sut_->outcome());
  EXPECT_FALSE(sut_->outcome()->success);
  EXPECT_NE(sut_->outcome()->sentence.find("blue cube is not in the basket"), std::string::npos);
}

TEST_F(JudgeCoreTest, AStopIsJudgedByTimeAndByTheHandAtRest) {
  for (const auto& [end_s, moved_m, success] :
       {std::tuple{9.35, 0.0, true}, std::tuple{9.9, 0.0, false}, std::tuple{9.35, 0.05, false}}) {
    JudgeSettings settings;
    settings.expected = "drop blue cube into basket; @8 stop";
    make(settings);
    FakeTruth truth;
    sut_->heard({2.0, 1.7, "drop blue cube into basket", ""});
    sut_->heard({9.3, 9.0, "stop", ""});
    sut_->stage({end_s, "idle", "failed", "blue cube", "I stop reaching."});
    sut_->tick(9.95, truth);
    truth.palm.x() += moved_m;
    EXPECT_TRUE(sut_->tick(10.3, truth));
    ASSERT_TRUE(sut_->outcome());
    EXPECT_EQ(sut_->outcome()->success, success) << sut_->outcome()->sentence;
  }
}

}  // namespace
}  // namespace nido
