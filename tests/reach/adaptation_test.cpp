// Bodies that change, and people who say how a reach should be.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "kinematic_robot.h"
#include "nido/kinematics/body_corrections.h"
#include "nido/reach/correction_memory.h"
#include "nido/reach/reach_core.h"

namespace nido::reach {
namespace {

Joints home() {
  Joints q = Joints::Zero();
  q.tail<kArmJoints>() << -0.35, 1.05, 0.0, 1.75, 0.0, 0.0, 0.0;
  return q;
}

ReachCore make_core() {
  PlannerOptions planner;
  planner.home = home();
  PalmPosture over;
  over.X_ObjectPalm.linear().col(0) = -Eigen::Vector3d::UnitX();
  over.X_ObjectPalm.linear().col(1) = Eigen::Vector3d::UnitY();
  over.X_ObjectPalm.linear().col(2) = -Eigen::Vector3d::UnitZ();
  over.X_ObjectPalm.translation() = Eigen::Vector3d(0.0, 0.0, 0.09);  // the same however it is turned
  over.turns_rad = {-0.35, 0.0, -0.7, 0.35};
  ReachOptions options;
  options.reach_posture = over;
  options.grasp_postures[""] = over;
  return {MotionPlanner(right_arm(), SeenHandModel(KinematicRobot::mark_Palm_m()), std::nullopt, planner),
          options};
}

ReachStatus run(ReachCore& core, KinematicRobot& robot, const ReachGoal& goal,
                std::vector<std::string>* notes = nullptr) {
  std::optional<ReachGoal> next = goal;
  const double begin_s = robot.time_s();
  ReachStatus status;
  for (int tick = 0; robot.time_s() - begin_s < 60.0; ++tick) {
    ReachInput input;
    input.measured_rad = robot.q();
    if (tick % 3 == 0) input.hand = robot.look(0.0005);
    input.goal = next;
    next.reset();
    const ReachOutput output = core.step(robot.time_s(), input);
    status = output.status;
    if (notes != nullptr && output.note) notes->push_back(*output.note);
    robot.step(output.command_rad);
    if (status.state != ActionState::kRunning) break;
  }
  return status;
}

ReachGoal reach(const Eigen::Vector3d& p_Root_m, const std::string& object = "blue cube") {
  return {1, "reach", object, p_Root_m, {0.05, 0.05, 0.05}, 0.0};
}
ReachGoal correct(const std::string& direction) {
  return {2, "correct", direction, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
}

// Of the palm, as the eyes see it, from where it stands over a thing that they see at p.
Eigen::Vector3d beside_m(const KinematicRobot& robot, const Eigen::Vector3d& p) {
  return robot.seen_palm() - p - Eigen::Vector3d(0, 0, 0.09);
}

TEST(Adaptation, ArrivesWithAForearmThatIsTwoCentimetresLonger) {
  BodyCorrections longer;
  longer.links["r_wrist_1"].p_m = {0.0, 0.0, 0.0};
  const RobotModel drawn = RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf").value();
  // along the forearm, in the drawn wrist's frame
  const BodyLink& wrist = drawn.links()[static_cast<std::size_t>(drawn.link_index("r_wrist_1").value())];
  longer.links["r_wrist_1"].p_m = wrist.X_ParentChild0.linear().transpose() * Eigen::Vector3d(0, 0, -0.02);
  const RobotModel real = load_corrected_model(NIDO_CONFIG_DIR "/robots/icub.urdf", longer).value();
  ReachCore core = make_core();
  KinematicRobot robot(home(), 1, ArmChain::from_model(real, "right").value());
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(-0.28, 0.06, -0.0576), Eigen::Vector3d(-0.30, 0.16, -0.0576),
        Eigen::Vector3d(-0.26, 0.02, -0.0576)}) {
    const ReachStatus status = run(core, robot, reach(p));
    ASSERT_EQ(status.state, ActionState::kDone) << status.reason;
    EXPECT_LT(beside_m(robot, p).norm(), 0.01) << p.transpose() << ": " << beside_m(robot, p).transpose();
  }
}

TEST(Adaptation, NoticesThatItsEyesWereBumpedAndGoesByThem) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  ASSERT_EQ(run(core, robot, reach({-0.28, 0.06, -0.0576})).state, ActionState::kDone);
  robot.bump_eyes({0.01, -0.042, 0.012});
  std::vector<std::string> notes;
  const Eigen::Vector3d p(-0.28, 0.14, -0.0576);
  ASSERT_EQ(run(core, robot, reach(p), &notes).state, ActionState::kDone);
  EXPECT_LT(beside_m(robot, p).norm(), 0.01) << beside_m(robot, p).transpose();
  ASSERT_FALSE(notes.empty());
  EXPECT_NE(notes.front().find("time after time"), std::string::npos) << notes.front();
}

TEST(Adaptation, ASingleWildSightingChangesNothing) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  ASSERT_EQ(run(core, robot, reach({-0.28, 0.06, -0.0576})).state, ActionState::kDone);
  const Eigen::Vector3d before = core.visual_offset_m();
  for (int tick = 0; tick < 30; ++tick) {
    ReachInput input;
    input.measured_rad = robot.q();
    // some other thing of the mark's colour, here and there
    if (tick % 5 == 0) input.hand = HandSighting{robot.time_s(), {-0.3, 0.02 * tick, 0.1}, 0.9};
    robot.step(core.step(robot.time_s(), input).command_rad);
  }
  EXPECT_EQ(core.visual_offset_m(), before);
}

TEST(Adaptation, SeesHowHighTheTableIs) {
  ReachCore core = make_core();
  const auto table_m = [&] { return core.planner().options().table_max_Root_m.z(); };
  const auto see = [&](const std::vector<double>& undersides_m) {
    ReachInput input;
    input.objects.emplace();
    for (const double z_m : undersides_m)
      input.objects->push_back({"blue cube", {-0.3, 0.1, z_m + 0.025}, {0.05, 0.05, 0.05}});
    core.step(0.0, input);
  };
  see({-0.0526, -0.0516});
  EXPECT_NEAR(table_m(), -0.0521, 1e-9) << "two things stand level, 3 cm higher than usual";
  see({0.02});
  EXPECT_NEAR(table_m(), -0.0521, 1e-9) << "one thing alone may be in the hand";
  see({0.02, -0.0826, -0.0830});
  EXPECT_NEAR(table_m(), -0.0828, 1e-9);
  see({-0.5, -0.5});
  EXPECT_NEAR(table_m(), -0.0828, 1e-9) << "on the floor";
}

TEST(Correction, WordsMoveTheHandAndAreRememberedForTheThing) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const Eigen::Vector3d p(-0.28, 0.06, -0.0576);
  ASSERT_EQ(run(core, robot, reach(p)).state, ActionState::kDone);
  const Eigen::Vector3d taught(0.0, -0.015, 0.015);
  for (const char* const word : {"left", "up"}) {
    const ReachStatus status = run(core, robot, correct(word));
    ASSERT_EQ(status.state, ActionState::kDone) << status.reason;
  }
  EXPECT_LT((beside_m(robot, p) - taught).norm(), 0.004) << beside_m(robot, p).transpose();

  // later, with the thing about where it was
  const Eigen::Vector3d there = p + Eigen::Vector3d(0.01, -0.01, 0.0);
  ASSERT_EQ(run(core, robot, {3, "home", "", Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0}).state,
            ActionState::kDone);
  ASSERT_EQ(run(core, robot, reach(there)).state, ActionState::kDone);
  EXPECT_LT((beside_m(robot, there) - taught).norm(), 0.004) << beside_m(robot, there).transpose();

  // another thing there, and the same thing far away, are reached as before
  ASSERT_EQ(run(core, robot, reach(p, "red ball")).state, ActionState::kDone);
  EXPECT_LT(beside_m(robot, p).norm(), 0.004);
  const Eigen::Vector3d far(-0.30, 0.26, -0.0576);
  ASSERT_EQ(run(core, robot, reach(far)).state, ActionState::kDone);
  EXPECT_LT(beside_m(robot, far).norm(), 0.005);
}

TEST(Correction, TheHandThatIsLedAndRestsHasLearned) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const Eigen::Vector3d p(-0.28, 0.06, -0.0576);
  ASSERT_EQ(run(core, robot, reach(p)).state, ActionState::kDone);
  const Eigen::Vector3d before = beside_m(robot, p);
  std::optional<ReachGoal> goal =
      ReachGoal{2, "yield", "", Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
  ReachStatus status;
  for (int tick = 0; tick < 500; ++tick) {
    ReachInput input;
    input.measured_rad = robot.q();
    input.goal = goal;
    goal.reset();
    Joints push = Joints::Zero();
    if (tick > 20 && tick < 60) push(kTorsoJoints) = -0.002;  // somebody lifts it by the shoulder's pitch
    robot.push(push);
    const ReachOutput output = core.step(robot.time_s(), input);
    status = output.status;
    if (tick > 1 && status.state != ActionState::kRunning) break;
    robot.step(output.command_rad);
  }
  ASSERT_EQ(status.state, ActionState::kDone) << status.reason;
  const Eigen::Vector3d led = beside_m(robot, p) - before;
  ASSERT_GT(led.norm(), 0.01);
  ASSERT_EQ(core.corrections().size(), 1U);
  robot.push(Joints::Zero());
  ASSERT_EQ(run(core, robot, {3, "home", "", Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0}).state,
            ActionState::kDone);
  ASSERT_EQ(run(core, robot, reach(p)).state, ActionState::kDone);
  EXPECT_LT((beside_m(robot, p) - before - led).norm(), 0.006) << beside_m(robot, p).transpose();
}

TEST(Correction, IsRefusedWhereThereIsNothingToCorrect) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  EXPECT_EQ(run(core, robot, correct("left")).state, ActionState::kFailed);
  ASSERT_EQ(run(core, robot, reach({-0.28, 0.06, -0.0576})).state, ActionState::kDone);
  const ReachStatus status = run(core, robot, correct("sideways"));
  EXPECT_EQ(status.state, ActionState::kFailed);
  EXPECT_NE(status.reason.find("allowed: left"), std::string::npos) << status.reason;
  EXPECT_EQ(core.corrections().size(), 0U);
}

TEST(CorrectionMemory, IsExactWhereItLearnedAndNothingFarAway) {
  CorrectionMemory memory;
  const Eigen::Vector3d a(-0.3, 0.05, -0.05);
  const Eigen::Vector3d b(-0.3, 0.12, -0.05);
  ASSERT_TRUE(memory.learn("reach", "blue cube", a, {0.02, 0.0, 0.0}));
  ASSERT_TRUE(memory.learn("reach", "blue cube", b, {0.0, 0.01, 0.0}));
  EXPECT_TRUE(memory.offset_m("reach", "blue cube", b).isApprox(Eigen::Vector3d(0.0, 0.01, 0.0), 1e-9));
  ASSERT_TRUE(memory.learn("reach", "blue cube", a, {0.0, 0.0, 0.03}));  // in place of what it knew here
  EXPECT_TRUE(memory.offset_m("reach", "blue cube", a).isApprox(Eigen::Vector3d(0.0, 0.0, 0.03), 1e-9));
  EXPECT_EQ(memory.size(), 2U);
  EXPECT_LT(memory.offset_m("reach", "blue cube", {-0.3, 0.35, -0.05}).norm(), 0.0015);
  EXPECT_TRUE(memory.offset_m("reach", "red cube", a).isZero());
  EXPECT_TRUE(memory.offset_m("pregrasp", "blue cube", a).isZero());
  EXPECT_FALSE(memory.learn("reach", "blue cube", a, {0.0, 0.5, 0.0}));
  EXPECT_TRUE(memory.offset_m("reach", "blue cube", a).isApprox(Eigen::Vector3d(0.0, 0.0, 0.03), 1e-9));
}

TEST(CorrectionMemory, KeepsInAFile) {
  std::string name = std::filesystem::temp_directory_path() / "nido-corrections-XXXXXX";
  const std::filesystem::path folder = mkdtemp(name.data());
  CorrectionMemory memory;
  ASSERT_TRUE(memory.learn("reach", "blue cube", {-0.3, 0.05, -0.05}, {0.02, 0.0, 0.001}));
  ASSERT_TRUE(memory.save(folder / "corrections.yaml"));
  const auto back = CorrectionMemory::load(folder / "corrections.yaml");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(back->offset_m("reach", "blue cube", {-0.3, 0.05, -0.05})
                  .isApprox(Eigen::Vector3d(0.02, 0, 0.001), 1e-9));
  std::ofstream(folder / "bad.yaml") << "corrections:\n  - {action: reach, object: cube, p_Root_m: [1, 2]}\n";
  const auto bad = CorrectionMemory::load(folder / "bad.yaml");
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().message.find("bad.yaml:2:"), std::string::npos) << bad.error().message;
  EXPECT_FALSE(CorrectionMemory::load(folder / "none.yaml"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace nido::reach
