// The contract of control boards, run on one that is made of joints of several.

#include "control_board_contract.h"
#include "nido/wrappers/joined_board.h"
#include "rigs.h"

namespace nido::test {
namespace {

// Two boards under their limits, and some of their joints in another order: of the second board, of the
// first.
class JoinedRig final : public ControlBoardRig {
 public:
  IControlBoard& board() override { return *joined_; }
  void advance() override {
    first_.advance();
    second_.advance();
  }
  int free_joint() override { return 1; }
  FakeControlBoard& fake(int board) { return board == 0 ? first_.fake() : second_.fake(); }

 private:
  static FakeRig& limited(FakeRig& rig) {
    rig.put_limits();
    return rig;
  }
  FakeRig first_;
  FakeRig second_{{{"thumb", {-0.5, 0.5, 1.0, 1.0}, 0.0, 0.5}, {"index", {-0.5, 0.5, 1.0, 1.0}, 0.0, 0.5}}};
  std::unique_ptr<JoinedBoard> joined_ = required(JoinedBoard::create({{&limited(second_).board(), 1},
                                                                       {&limited(first_).board(), 0},
                                                                       {&first_.board(), 2},
                                                                       {&second_.board(), 0}}));
};
INSTANTIATE_TEST_SUITE_P(FakeJoined, ControlBoardContract,
                         testing::Values([] { return std::make_unique<JoinedRig>(); }));

TEST(JoinedBoard, JointsAreThoseThatWereNamedInTheirOrder) {
  JoinedRig rig;
  const std::vector<std::string> names = {"index", "shoulder", "wrist", "thumb"};
  ASSERT_EQ(rig.board().axes(), 4);
  for (int joint = 0; joint < 4; ++joint) {
    EXPECT_EQ(*rig.board().axis_name(joint), names[static_cast<std::size_t>(joint)]);
  }
  const int both[] = {3, 0, 1};
  const double targets_rad[] = {0.3, -0.2, 0.5};
  const double fast[] = {1, 1, 2};
  ASSERT_TRUE(rig.board().set_reference_speeds(both, fast).ok());
  ASSERT_TRUE(rig.board().move_to(both, targets_rad).ok());
  for (int period = 0; period < 300; ++period) rig.advance();
  const std::vector<double> there_rad = rig.board().read_joints()->position_rad;
  EXPECT_NEAR(there_rad[3], 0.3, 1e-6);
  EXPECT_NEAR(there_rad[0], -0.2, 1e-6);
  EXPECT_NEAR(there_rad[1], 0.5, 1e-6);
  EXPECT_NEAR(rig.fake(1).read_joints()->position_rad[0], 0.3, 1e-6);
  EXPECT_NEAR(rig.fake(0).read_joints()->position_rad[2], 0.0, 1e-6) << "was not named";
}

TEST(JoinedBoard, WhatOneBoardRefusesMovesNone) {
  JoinedRig rig;
  rig.fake(0).set_fault(0, true);
  const int joints[] = {0, 1};
  const double targets_rad[] = {0.4, 1.0};
  const Status refused = rig.board().move_to(joints, targets_rad);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kFailed) << refused.error().message;
  for (int period = 0; period < 200; ++period) rig.advance();
  EXPECT_LT(std::abs(rig.board().read_joints()->position_rad[0]), 0.05);
  // the others still can
  const int alone[] = {0};
  const double target_rad[] = {0.4};
  EXPECT_TRUE(rig.board().move_to(alone, target_rad).ok());
}

TEST(JoinedBoard, RefusesWhatIsNoBoard) {
  FakeRig rig;
  EXPECT_FALSE(JoinedBoard::create({}).ok());
  EXPECT_FALSE(JoinedBoard::create({{nullptr, 0}}).ok());
  EXPECT_FALSE(JoinedBoard::create({{&rig.board(), 3}}).ok());
  EXPECT_FALSE(JoinedBoard::create({{&rig.board(), -1}}).ok());
  EXPECT_FALSE(JoinedBoard::create({{&rig.board(), 1}, {&rig.board(), 1}}).ok());
}

}  // namespace
}  // namespace nido::test
