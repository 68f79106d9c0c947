// Emergency stop, heartbeat and read-only robots.

#include "limits/safety.h"

#include <gtest/gtest.h>

#include "fake/fake_control_board.h"
#include "limits/limited_control_board.h"
#include "rigs.h"

namespace nido::test {
namespace {

class SafetyTest : public testing::Test {
 protected:
  void make(SafetyOptions options) {
    options.report = [this](const std::string& sentence) { reports_.push_back(sentence); };
    safety_ = std::make_shared<Safety>(std::move(options), clock_);
    LimitOptions limits;
    limits.part = "arm";
    limits.safety = safety_;
    limits.warn = [this](const std::string& sentence) { reports_.push_back(sentence); };
    board_ = required(LimitedControlBoard::create(device_, clock_, std::move(limits)));
  }
  void advance(int periods) {
    for (int i = 0; i < periods; ++i) {
      const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
      safety_->step_to(next_ns);
      ASSERT_TRUE(board_->step_to(next_ns).ok());
      ASSERT_TRUE(device_.step_to(next_ns).ok());
      clock_.set_ns(next_ns);
    }
  }
  double speed() { return std::abs(device_.read_joints()->velocity_rad_s.at(0)); }

  ManualClock clock_;
  FakeControlBoard device_{
      {{"shoulder", {-1.5, 1.5, 3.0, 10.0}, 0, 0.5}, {"elbow", {0, 1.5, 3.0, 5.0}, 0, 0.5}}};
  std::shared_ptr<Safety> safety_;
  std::unique_ptr<LimitedControlBoard> board_;
  std::vector<std::string> reports_;
  const int joint_[1] = {0};
};

TEST_F(SafetyTest, AStopEndsEveryMotionAndRefusesEveryCommand) {
  make({});
  const double target[] = {1.0};
  ASSERT_TRUE(board_->move_to(joint_, target).ok());
  advance(50);
  ASSERT_GT(speed(), 0.1);
  EXPECT_EQ(safety_->reply("the cat is on the table"), "[ok]");
  advance(2);
  EXPECT_EQ(speed(), 0);
  for (const Status& refused : {board_->move_to(joint_, target), board_->set_positions(joint_, target),
                                board_->set_velocities(joint_, target), board_->set_torques(joint_, target),
                                board_->set_duty_cycles(joint_, target), board_->home(joint_),
                                board_->set_control_mode(joint_, ControlMode::kIdle)}) {
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(
        refused.error().message,
        "the emergency stop is on (the cat is on the table): 'nido node call robot estop clear' ends it");
  }
  EXPECT_TRUE(board_->stop(joint_).ok());
  advance(50);
  EXPECT_EQ(speed(), 0);
  EXPECT_EQ(safety_->reply("state"), "[is] state stopped \"the cat is on the table\" () [ok]");
  EXPECT_EQ(safety_->reply("clear"), "[ok]");
  advance(1);
  EXPECT_TRUE(board_->move_to(joint_, target).ok());
  advance(500);
  EXPECT_NEAR(device_.read_joints()->position_rad.at(0), 1.0, 1e-6);
  ASSERT_EQ(reports_.size(), 2U);
}

TEST_F(SafetyTest, AStreamedSpeedEndsToo) {
  make({});
  const double speeds[] = {0.5};
  ASSERT_TRUE(board_->set_velocities(joint_, speeds).ok());
  advance(3);
  ASSERT_GT(speed(), 0.1);
  safety_->stop("test");
  advance(2);
  EXPECT_EQ(speed(), 0);
}

TEST_F(SafetyTest, AHeartThatStopsBeatingStopsTheRobot) {
  make({.heartbeat_s = 0.5});
  advance(200);
  EXPECT_FALSE(safety_->stopped()) << "nobody has promised to beat";
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(safety_->reply("beat"), "[ok]");
    advance(40);
    EXPECT_FALSE(safety_->stopped());
  }
  advance(20);
  EXPECT_TRUE(safety_->stopped());
  EXPECT_EQ(safety_->reply("clear"), "[ok]");
  advance(100);
  EXPECT_FALSE(safety_->stopped());
}

TEST_F(SafetyTest, AReadOnlyRobotIsLookedAtAndNeverCommanded) {
  make({.read_only = true});
  const double target[] = {1.0};
  const Pid pids[] = {Pid{.kp = 1}};
  EXPECT_FALSE(board_->move_to(joint_, target).ok());
  EXPECT_FALSE(board_->stop(joint_).ok());
  EXPECT_FALSE(board_->set_pids(PidLoop::kPosition, joint_, pids).ok());
  EXPECT_FALSE(board_->set_reference_speeds(joint_, target).ok());
  EXPECT_TRUE(board_->read_joints().ok());
  EXPECT_TRUE(board_->control_modes().ok());
  EXPECT_EQ(safety_->reply("state"), "[is] state readonly \"\" () [ok]");
}

TEST_F(SafetyTest, ABrokenJointDoesNotKeepTheOthersFromStopping) {
  make({});
  const int both[] = {0, 1};
  const double targets[] = {1.0, 1.0};
  ASSERT_TRUE(board_->move_to(both, targets).ok());
  advance(50);
  device_.set_fault(0, true);
  safety_->stop("test");
  advance(2);
  EXPECT_EQ(device_.read_joints()->velocity_rad_s.at(1), 0);
}

TEST_F(SafetyTest, WhoIsInAHurryNeedsNoWords) {
  make({});
  for (const char* line :
       {"", "  ", "stopp", "help!!", "clear it", "beat it", "\xff\xfe", "state of things"}) {
    EXPECT_EQ(safety_->reply(line), "[ok]");
    EXPECT_TRUE(safety_->stopped()) << line;
    EXPECT_EQ(safety_->reply(" clear\r\n"), "[ok]");
    EXPECT_FALSE(safety_->stopped());
  }
  EXPECT_EQ(safety_->reply("\"quotes\\\" \n"), "[ok]");
  EXPECT_EQ(safety_->reply("state"), "[is] state stopped \"'quotes''\" () [ok]");
  EXPECT_EQ(safety_->reply("another reason"), "[ok]");
  EXPECT_EQ(safety_->stopped(), "'quotes''") << "the first reason stays";
}

TEST_F(SafetyTest, EachHeartIsListenedToByItself) {
  make({.heartbeat_s = 0.5});
  safety_->beat("vision");
  safety_->beat("reach");
  for (int i = 0; i < 4; ++i) {
    advance(20);
    safety_->beat("reach");
  }
  ASSERT_TRUE(safety_->stopped());
  EXPECT_EQ(*safety_->stopped(), "no heartbeat of vision for 0.5 s");
}

TEST_F(SafetyTest, AStopCanSwitchTheMotorsOff) {
  make({.action = StopAction::kIdle});
  const double target[] = {1.0};
  ASSERT_TRUE(board_->move_to(joint_, target).ok());
  advance(50);
  safety_->stop("test");
  advance(1);
  EXPECT_EQ(device_.control_modes()->at(0), ControlMode::kIdle);
  EXPECT_EQ(device_.control_modes()->at(1), ControlMode::kIdle);
  safety_->clear();
  advance(1);
  EXPECT_EQ(device_.control_modes()->at(0), ControlMode::kIdle) << "nothing moves by itself";
  EXPECT_TRUE(board_->move_to(joint_, target).ok());
}

// A board on the far side of a network that has gone.
TEST_F(SafetyTest, ADeviceThatDoesNotAnswerIsStoppedAsSoonAsItDoes) {
  make({});
  const double target[] = {1.0};
  ASSERT_TRUE(board_->move_to(joint_, target).ok());
  advance(20);
  FakeFailures gone;
  gone.commands = Error{ErrorCode::kTimeout, "no answer"};
  device_.set_failures(gone);
  safety_->stop("test");
  advance(20);
  EXPECT_GT(speed(), 0.01);
  device_.set_failures({});
  advance(60);
  EXPECT_EQ(speed(), 0);
  ASSERT_FALSE(reports_.empty());
  EXPECT_NE(reports_.back().find("arm has not obeyed the emergency stop: no answer"), std::string::npos)
      << reports_.back();
}

}  // namespace
}  // namespace nido::test
