#include "nido/goal_selection/goal_selection_core.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "fake_body.h"
#include "nido/goal_selection/goal_training.h"

namespace nido {
namespace {

class GoalSelectionCoreTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto book = PhraseBook::load(NIDO_CONFIG "/phrases.yaml");
    ASSERT_TRUE(book.ok());
    book_ = new PhraseBook(*book);
    network_ = new GoalNetwork(GoalCode(*book_), train_goal_network(GoalCode(*book_), {}).network);
  }
  static void TearDownTestSuite() {
    delete network_;
    delete book_;
  }

  void SetUp() override { make({}); }
  void make(const GoalSelectionSettings& settings) {
    auto core = GoalSelectionCore::create(*book_, *network_, settings);
    ASSERT_TRUE(core.ok());
    sut_.emplace(std::move(core).value());
  }

  // says a phrase (or nothing) and lets time pass until the job ends
  void run(const std::string& text, double limit_s = 400.0) {
    bool said = text.empty();
    const double end = now_ + limit_s;
    done_ = failed_ = false;
    for (; now_ < end && !done_ && !failed_; now_ += 0.01) {
      GoalSelectionInputs in = body_.sense(now_);
      if (!said && ++quiet_ > 20) {
        in.heard.push_back({text, 0.9, true, ""});
        said = true;
      }
      step(in);
    }
  }

  // somebody says something now
  void hear(const std::string& text) {
    GoalSelectionInputs in = body_.sense(now_);
    in.heard.push_back({text, 0.9, true, ""});
    step(in);
    now_ += 0.01;
  }

  void step(const GoalSelectionInputs& in) {
    const GoalSelectionOutputs out = sut_->step(now_, in);
    for (const auto& line : out.stages) {
      story_.push_back(line);
      done_ = done_ || (line.stage == "idle" && line.state == "done");
      failed_ = failed_ || (line.stage == "idle" && line.state == "failed");
    }
    body_.act(now_, out);
  }

  [[nodiscard]] std::vector<std::string> stages(const std::string& state) const {
    std::vector<std::string> result;
    for (const auto& line : story_) {
      if (line.state == state) result.push_back(line.stage);
    }
    return result;
  }
  [[nodiscard]] std::string story() const {
    std::string text;
    for (const auto& line : story_) text += line.stage + " " + line.state + ": " + line.text + "\n";
    return text;
  }

  static PhraseBook* book_;
  static GoalNetwork* network_;
  std::optional<GoalSelectionCore> sut_;
  FakeBody body_;
  double now_ = 0.0;
  int quiet_ = 0;
  bool done_ = false;
  bool failed_ = false;
  std::vector<StageLine> story_;
};
PhraseBook* GoalSelectionCoreTest::book_ = nullptr;
GoalNetwork* GoalSelectionCoreTest::network_ = nullptr;

using Stages = std::vector<std::string>;

TEST_F(GoalSelectionCoreTest, WatchesItsHandAndStaysIdleWithoutAPhrase) {
  run("", 10.0);
  EXPECT_EQ(body_.asked, Stages{"look hand right"});
  EXPECT_FALSE(done_ || failed_);
}

TEST_F(GoalSelectionCoreTest, DropIsTheSequenceOfTheExperiment) {
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(stages("done"),
            (Stages{"heard", "chosen", "seen", "reached", "grasped", "carried", "dropped", "idle"}))
      << story();
  EXPECT_TRUE(stages("failed").empty()) << story();
  EXPECT_EQ(body_.asked,
            (Stages{"look hand right", "look object blue cube", "grasp open", "reach pregrasp", "grasp grasp",
                    "reach lift", "look object basket", "reach carry", "grasp release", "reach home"}))
      << story();
  EXPECT_NEAR(body_.things["blue cube"].p.x(), body_.things["basket"].p.x(), 1e-6);
  EXPECT_NEAR(body_.things["blue cube"].p.y(), body_.things["basket"].p.y(), 1e-6);
}

TEST_F(GoalSelectionCoreTest, CarriesOverTheRimOfTheBasket) {
  run("drop blue cube into basket");
  for (const auto& command : body_.reach_commands) {
    if (command.action == "lift") {
      EXPECT_NEAR(command.p_RootTarget_m.z(), -0.0576 + 0.12, 1e-9);
    }
    if (command.action == "carry") {
      EXPECT_NEAR(command.p_RootTarget_m.z(), -0.0526 + 0.03 + 0.10, 1e-9);
    }
  }
}

TEST_F(GoalSelectionCoreTest, ReachStaysAtTheObject) {
  run("reach red ball");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(stages("done"), (Stages{"heard", "chosen", "seen", "reached", "idle"})) << story();
  EXPECT_EQ(body_.asked, (Stages{"look hand right", "look object red ball", "reach reach"}));
  EXPECT_LT((body_.reach_commands[0].p_RootTarget_m - body_.things["red ball"].p).norm(), 1e-9);
}

TEST_F(GoalSelectionCoreTest, GraspHolds) {
  run("grasp red ball");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.held, "red ball");
  EXPECT_EQ(body_.count("grasp release") + body_.count("reach home"), 0);
}

TEST_F(GoalSelectionCoreTest, ANameAloneIsLookedAt) {
  run("blue cube");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(stages("done"), (Stages{"heard", "chosen", "seen", "idle"})) << story();
  EXPECT_EQ(body_.asked, (Stages{"look hand right", "look object blue cube"}));
}

TEST_F(GoalSelectionCoreTest, NoSuchPhraseStaysIdleAndSaysWhy) {
  GoalSelectionInputs in = body_.sense(now_);
  in.heard.push_back({"", 0.0, false, "no such phrase: what was said sounds like none of those that I know"});
  step(in);
  EXPECT_TRUE(failed_);
  ASSERT_FALSE(story_.empty());
  EXPECT_NE(story_.back().text.find("I stay idle: no such phrase"), std::string::npos) << story();
  EXPECT_EQ(body_.asked, Stages{"look hand right"});
  // and it listens on
  run("reach red ball");
  EXPECT_TRUE(done_) << story();
}

TEST_F(GoalSelectionCoreTest, AnUnknownTextIsNoPhraseEither) {
  run("eat blue cube");
  EXPECT_TRUE(failed_);
  EXPECT_EQ(body_.asked, Stages{"look hand right"});
}

TEST_F(GoalSelectionCoreTest, ATaughtThingIsTakenLikeAKnownOneOfItsShape) {
  body_.put("lemon", {-0.30, 0.10, -0.0576});
  body_.shapes["lemon"] = "cube";
  body_.things.erase("blue cube");
  run("drop lemon into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.grasp_objects.front(), "lemon cube");
  EXPECT_EQ(body_.reach_commands.front().object, "lemon cube");
  run("grasp lemon");
  EXPECT_TRUE(done_) << story();
  run("lemon");  // the eyes know it
  EXPECT_TRUE(done_) << story();
  EXPECT_NE(story_.back().text.find("I look at the lemon"), std::string::npos) << story();
}

TEST_F(GoalSelectionCoreTest, WhatIsSaidAfterANamingIsWhatTheNameAsksFor) {
  body_.put("plum", {-0.30, 0.10, -0.0576});
  body_.shapes["plum"] = "ball";
  hear("this is a plum");
  run("reach plum");
  EXPECT_TRUE(done_) << story();
  ASSERT_EQ(sut_->lessons().size(), 1U) << story();
  const int reaches = body_.count("reach reach");
  run("plum");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("reach reach"), reaches + 1) << story();
}

TEST_F(GoalSelectionCoreTest, AnOrderThatFollowsNoNamingTeachesNothing) {
  body_.put("plum", {-0.30, 0.10, -0.0576});
  body_.shapes["plum"] = "ball";
  hear("this is a plum");
  run("reach red ball");  // something else
  run("reach plum");
  EXPECT_TRUE(sut_->lessons().empty());
  run("plum");
  EXPECT_NE(story_.back().text.find("I look at the plum"), std::string::npos) << story();
}

TEST_F(GoalSelectionCoreTest, ANameThatSomebodyGaveIsLookedFor) {
  hear("this is a lemon");
  run("lemon");
  EXPECT_TRUE(failed_);
  EXPECT_EQ(body_.count("look search lemon"), 1);
}

TEST_F(GoalSelectionCoreTest, SearchesForWhatIsNotInView) {
  body_.hidden = {"blue cube", "basket"};
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("look search blue cube"), 1);
  EXPECT_EQ(body_.count("look search basket"), 1);
}

TEST_F(GoalSelectionCoreTest, MissingObjectIsLookedForAndReported) {
  run("grasp teddy bear");
  EXPECT_TRUE(failed_) << story();
  EXPECT_EQ(stages("failed"), (Stages{"seen", "idle"}));
  EXPECT_NE(story_.back().text.find("do not find the teddy bear"), std::string::npos) << story();
  EXPECT_EQ(body_.count("look search teddy bear"), 1);
  EXPECT_TRUE(body_.reach_commands.empty());
}

TEST_F(GoalSelectionCoreTest, MissingBasketIsReportedAndTheObjectKept) {
  body_.things.erase("basket");
  run("drop blue cube into basket");
  EXPECT_TRUE(failed_) << story();
  EXPECT_EQ(stages("failed"), (Stages{"carried", "idle"}));
  EXPECT_EQ(body_.held, "blue cube");
}

TEST_F(GoalSelectionCoreTest, OutOfReachIsNotTriedTwice) {
  body_.fail_reach["pregrasp"] = 99;
  body_.reach_reason = "the blue cube is out of reach: it is 0.2 m too far.";
  run("drop blue cube into basket");
  EXPECT_TRUE(failed_) << story();
  EXPECT_EQ(body_.count("reach pregrasp"), 1);
  EXPECT_NE(story_.back().text.find("0.2 m too far"), std::string::npos) << story();
}

TEST_F(GoalSelectionCoreTest, AFailedGraspIsTriedAgain) {
  body_.fail_grasp["grasp"] = 2;
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("grasp grasp"), 3);
  EXPECT_EQ(stages("failed"), (Stages{"grasped", "grasped"}));
}

TEST_F(GoalSelectionCoreTest, TriesAreBounded) {
  body_.fail_grasp["grasp"] = 99;
  run("drop blue cube into basket");
  EXPECT_TRUE(failed_) << story();
  EXPECT_EQ(body_.count("grasp grasp"), 3);
  EXPECT_EQ(stages("failed"), (Stages{"grasped", "grasped", "grasped", "idle"}));
  EXPECT_NE(story_.back().text.find("the fingers met nothing"), std::string::npos);
}

TEST_F(GoalSelectionCoreTest, SightTellsThatTheHandCameUpEmpty) {
  body_.empty_grasps = 1;
  run("grasp blue cube");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("grasp grasp"), 2);
  EXPECT_EQ(stages("failed"), Stages{"grasped"}) << story();
}

TEST_F(GoalSelectionCoreTest, TouchTellsThatItWasLostOnTheWay) {
  body_.slips = 1;
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  const auto failed = stages("failed");
  ASSERT_FALSE(failed.empty());
  EXPECT_EQ(body_.count("grasp grasp"), 2);
  // the second try goes where it fell
  for (auto command = body_.reach_commands.rbegin(); command != body_.reach_commands.rend(); ++command) {
    if (command->action == "pregrasp") {
      EXPECT_LT((command->p_RootTarget_m - Eigen::Vector3d(-0.36, 0.02, -0.0576)).norm(), 1e-6);
      break;
    }
  }
}

TEST_F(GoalSelectionCoreTest, SightTellsThatItFellBeside) {
  body_.misses = 1;
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(stages("failed"), Stages{"dropped"}) << story();
  EXPECT_EQ(body_.count("grasp release"), 2);
}

TEST_F(GoalSelectionCoreTest, SilentNodesEndInASentence) {
  body_.mute = true;
  run("grasp blue cube");
  EXPECT_TRUE(failed_) << story();
  EXPECT_NE(story_.back().text.find("did not finish"), std::string::npos) << story();
}

TEST_F(GoalSelectionCoreTest, APhraseDuringAJobWaitsItsTurn) {
  run("drop blue cube into basket", 3.0);
  hear("reach red ball");
  ASSERT_FALSE(story_.empty());
  EXPECT_NE(story_.back().text.find("when I am done"), std::string::npos) << story();
  run("", 100.0);
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("reach reach"), 0);
  run("", 100.0);
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("reach reach"), 1);
  EXPECT_EQ(body_.asked.back(), "reach reach");
}

TEST_F(GoalSelectionCoreTest, TooManyPhrasesAreRefused) {
  run("drop blue cube into basket", 3.0);
  for (std::size_t i = 0; i < GoalSelectionCore::kMostWaiting; ++i) hear("reach red ball");
  hear("reach red ball");
  EXPECT_EQ(story_.back().state, "failed");
  EXPECT_NE(story_.back().text.find("busy"), std::string::npos) << story();
}

TEST_F(GoalSelectionCoreTest, StopEndsTheJobInTheStepThatHearsIt) {
  for (const double after_s : {0.5, 1.2, 2.0, 3.0, 4.5, 6.0, 8.0}) {
    SetUp();
    body_ = {};
    story_.clear();
    run("drop blue cube into basket", after_s);
    ASSERT_FALSE(done_ || failed_) << story();
    hear("reach red ball");
    hear("stop");
    EXPECT_TRUE(failed_) << after_s;
    EXPECT_NE(story_.back().text.find("I stop"), std::string::npos) << story();
    EXPECT_EQ(sut_->doing(), "listening");
    EXPECT_EQ(body_.count("reach stop"), 1);
    // nothing more is done, and what waited is forgotten
    const auto asked = body_.asked.size();
    run("", 20.0);
    EXPECT_EQ(body_.asked.size(), asked) << after_s;
    EXPECT_FALSE(done_) << story();
  }
}

TEST_F(GoalSelectionCoreTest, StopKeepsWhatIsHeldAndTheNextPhraseGoesOnWithIt) {
  for (int i = 0; i < 4000 && body_.count("reach carry") == 0; ++i) {
    run(i == 0 ? "drop blue cube into basket" : "", 0.01 + (i == 0 ? 1.0 : 0.0));
  }
  ASSERT_EQ(body_.held, "blue cube") << story();
  hear("stop");
  EXPECT_NE(story_.back().text.find("I keep the blue cube"), std::string::npos) << story();
  EXPECT_EQ(body_.count("grasp stop"), 0);
  EXPECT_EQ(body_.held, "blue cube");
  run("drop blue cube into basket");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.count("grasp grasp"), 1) << story();
  EXPECT_NEAR(body_.things["blue cube"].p.y(), body_.things["basket"].p.y(), 1e-6);
}

// What is said to the hand is the reach node's business.
TEST_F(GoalSelectionCoreTest, ACorrectionOfAReachIsNoOrder) {
  run("", 1.0);
  const std::size_t before = story_.size();
  hear("a bit left");
  EXPECT_EQ(story_.size(), before) << story();
  run("reach red ball");
  EXPECT_TRUE(done_) << story();
}

TEST_F(GoalSelectionCoreTest, StopWhileIdleMovesNothing) {
  run("", 1.0);
  hear("stop");
  EXPECT_FALSE(failed_);
  EXPECT_EQ(body_.count("reach stop"), 1);
  run("reach red ball");
  EXPECT_TRUE(done_) << story();
}

TEST_F(GoalSelectionCoreTest, PositionsAreMediansOfSureViews) {
  now_ = 0.0;
  for (int i = 0; !done_ && i < 2000; ++i, now_ += 0.01) {
    GoalSelectionInputs in = body_.sense(now_);
    if (in.objects && i % 15 == 0) {
      // now and then a wild view, and an unsure one of something else
      for (auto& object : *in.objects) object.p_RootObject_m.x() += 0.5;
    }
    if (in.objects) {
      SeenObject ghost;
      ghost.name = "red ball";
      ghost.confidence = 0.1;
      in.objects->push_back(ghost);
      ghost.confidence = 0.95;
      ghost.p_RootObject_m.x() = std::numeric_limits<double>::quiet_NaN();
      in.objects->push_back(ghost);
    }
    if (i == 30) in.heard.push_back({"reach red ball", 0.9, true, ""});
    step(in);
  }
  ASSERT_EQ(body_.reach_commands.size(), 1U) << story();
  EXPECT_LT((body_.reach_commands[0].p_RootTarget_m - body_.things["red ball"].p).norm(), 1e-9);
}

TEST_F(GoalSelectionCoreTest, SecondJobFollowsTheFirst) {
  run("drop blue cube into basket");
  ASSERT_TRUE(done_) << story();
  run("reach red ball");
  EXPECT_TRUE(done_) << story();
}

TEST_F(GoalSelectionCoreTest, TheNearerHandActsWhereBothMay) {
  GoalSelectionSettings settings;
  settings.side = "nearer";
  make(settings);
  body_.put("red ball", {-0.35, -0.15, -0.0526});
  run("reach blue cube");  // on the right
  run("reach red ball");   // on the left: the right hand goes home first
  ASSERT_TRUE(done_) << story();
  ASSERT_EQ(body_.reach_commands.size(), 3U) << story();
  EXPECT_EQ(body_.reach_commands[0].side, "right");
  EXPECT_EQ(body_.reach_commands[1].action, "home");
  EXPECT_EQ(body_.reach_commands[1].side, "right");
  EXPECT_EQ(body_.reach_commands[2].action, "reach");
  EXPECT_EQ(body_.reach_commands[2].side, "left");
  // what has a way to go is taken by the hand that is nearer to the middle of the way, fingers and all
  run("drop red ball into basket");
  ASSERT_TRUE(done_) << story();
  EXPECT_EQ(body_.reach_commands[3].action, "home");
  EXPECT_EQ(body_.reach_commands[3].side, "left");
  for (std::size_t i = 4; i < body_.reach_commands.size(); ++i)
    EXPECT_EQ(body_.reach_commands[i].side, "right") << body_.reach_commands[i].action;
}

TEST_F(GoalSelectionCoreTest, WhereOneHandDoesNotGetTheOtherOneTries) {
  GoalSelectionSettings settings;
  settings.side = "nearer";
  make(settings);
  body_.fail_reach["pregrasp"] = 1;
  body_.reach_reason = "the blue cube is out of reach";
  run("grasp blue cube");
  EXPECT_TRUE(done_) << story();
  EXPECT_EQ(body_.reach_commands.front().side, "right");
  EXPECT_EQ(body_.reach_commands.back().side, "left");
  // both of them do not get there: once is enough for each
  body_.asked.clear();
  body_.fail_reach["reach"] = 99;
  body_.reach_reason = "the red ball is out of reach";
  body_.held.clear();
  now_ += 5.0;
  run("reach red ball");
  EXPECT_TRUE(failed_) << story();
  EXPECT_EQ(body_.count("reach reach"), 2);
}

TEST_F(GoalSelectionCoreTest, SettingsOutOfRangeAreRefused) {
  GoalSelectionSettings settings;
  settings.tries = 0;
  EXPECT_NE(GoalSelectionCore::create(*book_, *network_, settings).error().message.find("tries"),
            std::string::npos);
  settings = {};
  settings.side = "middle";
  EXPECT_NE(GoalSelectionCore::create(*book_, *network_, settings).error().message.find("middle"),
            std::string::npos);
  settings = {};
  settings.hold_s = -1.0;
  EXPECT_NE(GoalSelectionCore::create(*book_, *network_, settings).error().message.find("hold_s"),
            std::string::npos);
}

}  // namespace
}  // namespace nido
