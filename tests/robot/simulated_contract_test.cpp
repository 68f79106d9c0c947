// The contracts, run on the simulated family.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>

#include "control_board_contract.h"
#include "nido/simulator/devices/simulated_camera.h"
#include "nido/simulator/devices/simulated_depth_camera.h"
#include "nido/simulator/devices/simulated_sensors.h"
#include "sensor_contracts.h"
#include "simulated_rig.h"
#include "simulated_sensor_rigs.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(Simulated, ControlBoardContract,
                         testing::Values([] { return std::make_unique<SimulatedRig>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedUnderLimits, ControlBoardContract, testing::Values([] {
                           auto rig = std::make_unique<SimulatedRig>();
                           rig->put_limits();
                           return rig;
                         }));

INSTANTIATE_TEST_SUITE_P(Simulated, CameraContract,
                         testing::Values([] { return std::make_unique<SimulatedCameraRig>(); }));

INSTANTIATE_TEST_SUITE_P(Simulated, TouchContract,
                         testing::Values([] { return std::make_unique<SimulatedTouchRig>(); }));

// A small ball is pressed a millimetre into a taxel of the forearm, and taken away again.
class SimulatedSkinRig final : public TouchRig {
 public:
  ITouch& touch() override { return *touch_; }
  void advance() override {
    const Status stepped = robot_->step_to(robot_->now_ns() + kPeriod_ns);
    if (!stepped) throw std::runtime_error(stepped.error().message);
  }
  [[nodiscard]] int pads() const override { return 384; }
  // of the middle row, in front and behind
  [[nodiscard]] int pressed_pad() const override { return 8 * 12 + 5; }
  [[nodiscard]] int far_pad() const override { return 12 * 12 + 5; }
  bool press(int pad, bool pressed) override {
    sim::SimulatedWorld world(robot_);
    if (!pressed) return world.command("world del ssph 1") == "[ok]";
    const sim::SkinPatch& patch = robot_->simulation().skin().front();
    const auto taxel = std::find_if(patch.taxels.begin(), patch.taxels.end(),
                                    [pad](const sim::Taxel& one) { return one.value == pad; });
    constexpr double kRadius_m = 0.02;
    const Eigen::Vector3d p_World_m = required(robot_->simulation().X_WorldLink(patch.link)) *
                                      (taxel->p_Link_m + (kRadius_m - 0.001) * taxel->out_Link);
    return world.command("world mk ssph 0.02 " + std::to_string(-p_World_m.y()) + " " +
                         std::to_string(p_World_m.z() + 0.5976) + " " +
                         std::to_string(-p_World_m.x() - 0.026) + " 1 0 0") == "[ok]";
  }

 private:
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::unique_ptr<ITouch> touch_ = required(sim::SimulatedSkin::create(robot_, "left_forearm"));
};
INSTANTIATE_TEST_SUITE_P(SimulatedSkin, TouchContract,
                         testing::Values([] { return std::make_unique<SimulatedSkinRig>(); }));

TEST(SimulatedSkin, OtherPatchesAreRefusedByTheirNames) {
  const auto nobody = sim::SimulatedSkin::create(simulated_robot(), "left_ear");
  ASSERT_FALSE(nobody.ok());
  EXPECT_NE(nobody.error().message.find("left_forearm, left_arm, right_forearm, right_arm, torso"),
            std::string::npos)
      << nobody.error().message;
}

TEST(SimulatedCamera, APictureIsThatOfTheMomentWhenTheShutterOpened) {
  // two robots in the same world turn their heads; one is drawn at once, the other while it moves on
  const std::string world = "table: {top_center_m: [-0.4, 0, -0.0826], size_m: [0.4, 0.7]}\n";
  const int joints[] = {0, 2};
  const double targets[] = {-0.5, 0.6};
  std::array<Image, 2> images;
  for (const bool at_once : {true, false}) {
    const auto robot = simulated_robot(world);
    const auto head = required(sim::SimulatedControlBoard::create(robot, "head"));
    const auto eye = required(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, {}));
    ASSERT_TRUE(head->move_to(joints, targets).ok());
    ASSERT_TRUE(robot->step_to(30 * kPeriod_ns).ok());
    if (!at_once) {
      ASSERT_TRUE(eye->open_shutter().ok());
      ASSERT_TRUE(robot->step_to(40 * kPeriod_ns).ok());
    }
    ASSERT_TRUE(eye->grab(images.at(at_once ? 0 : 1)).ok());
  }
  EXPECT_EQ(images[0].stamp_ns, 30 * kPeriod_ns);
  EXPECT_EQ(images[1].stamp_ns, 30 * kPeriod_ns);
  EXPECT_TRUE(images[0].rgb == images[1].rgb) << "the pictures differ";
}

TEST(SimulatedCamera, NoiseIsItsOwnAndRepeatable) {
  const auto robot = simulated_robot();
  const auto picture = [&](std::uint64_t seed) {
    const auto eye = required(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, {}, {0.5, 3.0, seed}));
    Image image;
    EXPECT_TRUE(eye->grab(image).ok());
    return image.rgb;
  };
  EXPECT_TRUE(picture(1) == picture(1));
  EXPECT_FALSE(picture(1) == picture(2));
  EXPECT_FALSE(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, {}, {-1, 0, 1}).ok());
}

TEST(SimulatedCamera, FaultsSpoilThePicturesOfOneEyeUntilTheyAreCleared) {
  const auto robot = simulated_robot();
  const auto head = required(sim::SimulatedControlBoard::create(robot, "head"));
  const auto left = required(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, {}));
  const auto right = required(sim::SimulatedCamera::create(robot, sim::Eye::kRight, {}));
  sim::SimulatedWorld world(robot);
  const int yaw[] = {2};
  const double far_rad[] = {0.8};
  ASSERT_TRUE(head->move_to(yaw, far_rad).ok());
  std::int64_t now_ns = 0;
  const auto picture = [&](ICamera& eye) {
    EXPECT_TRUE(robot->step_to(now_ns += 3 * kPeriod_ns).ok());
    Image image;
    EXPECT_TRUE(eye.grab(image).ok());
    return image.rgb;
  };
  ASSERT_EQ(world.command("world fault cam left stuck"), "[ok]");
  const auto first = picture(*left);
  EXPECT_TRUE(picture(*left) == first) << "the head moves, the picture does not";
  EXPECT_FALSE(picture(*right) == picture(*right)) << "the other eye sees";
  ASSERT_EQ(world.command("world fault cam left none"), "[ok]");
  ASSERT_EQ(world.command("world fault cam left stuck"), "[ok]");
  EXPECT_FALSE(picture(*left) == first) << "stuck anew, at a later picture";
  ASSERT_EQ(world.command("world fault cam left off"), "[ok]");
  const auto black = picture(*left);
  EXPECT_EQ(black.size(), first.size());
  EXPECT_EQ(std::count(black.begin(), black.end(), 0), static_cast<std::ptrdiff_t>(black.size()));
  ASSERT_EQ(world.command("world fault cam left slow"), "[ok]");
  const auto slow = picture(*left);
  for (int i = 1; i < 5; ++i) EXPECT_TRUE(picture(*left) == slow) << i;
  EXPECT_FALSE(picture(*left) == slow) << "every fifth is new";
  ASSERT_EQ(world.command("world fault clear"), "[ok]");
  Image clean;
  Image grainy;
  ASSERT_TRUE(left->grab(clean).ok());
  ASSERT_EQ(world.command("world fault cam left noise"), "[ok]");
  ASSERT_TRUE(left->grab(grainy).ok());
  double sum = 0;
  for (std::size_t i = 0; i < clean.rgb.size(); ++i)
    sum += std::abs(static_cast<double>(clean.rgb[i]) - grainy.rgb[i]);
  EXPECT_GT(sum / static_cast<double>(clean.rgb.size()), 20) << "levels";
  ASSERT_EQ(world.command("world fault clear"), "[ok]");
  ASSERT_TRUE(left->grab(grainy).ok());
  EXPECT_TRUE(grainy.rgb == clean.rgb);
}

// A recorded run: commands to the boards and the world, and what came of them, step by step.
class RecordedRun {
 public:
  explicit RecordedRun(const std::filesystem::path& scenes) {
    sim::SimulationOptions options;
    options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
    options.world_path = std::string(NIDO_CONFIG_DIR) + "/worlds/table.yaml";
    options.scene_folder = scenes;
    robot_ = required(sim::SimulatedRobot::create(options, {}));
    for (const char* part : {"head", "torso", "left_arm", "right_arm"})
      boards_.push_back(required(sim::SimulatedControlBoard::create(robot_, part)));
    for (const sim::Eye eye : {sim::Eye::kLeft, sim::Eye::kRight})
      eyes_.push_back(required(sim::SimulatedCamera::create(
          robot_, eye, {}, {.noise_levels = 3, .seed = eye == sim::Eye::kLeft ? 1U : 2U})));
  }

  std::string world(const std::string& line) { return sim::SimulatedWorld(robot_).command(line); }
  // Time before the part of the run that is to be the same.
  void wait(int periods) { EXPECT_TRUE(robot_->step_to(robot_->now_ns() + periods * kPeriod_ns).ok()); }

  // Steps `from` to `to`: state, readings and pictures of each.
  std::vector<std::string> go(int from, int to) {
    std::vector<std::string> seen;
    for (int step = from; step < to; ++step) {
      command(step);
      wait(1);
      std::string what = std::to_string(robot_->simulation().state_hash()) + " " + world("world hash");
      for (const auto& board : boards_) {
        for (const double torque_Nm : required(board->read_joints()).torque_Nm)
          what += " " + std::to_string(torque_Nm);
      }
      for (const auto& eye : eyes_) {
        if (step % 3 != 0) continue;
        Image image;
        EXPECT_TRUE(eye->grab(image).ok());
        what += " " + std::to_string(std::hash<std::string_view>()(
                          {reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()}));
      }
      seen.push_back(std::move(what));
    }
    return seen;
  }

 private:
  void command(int step) {
    const std::array<int, 3> joints = {0, 1, 2};
    const double swing = 0.2 * std::sin(0.05 * step);
    bool done = true;
    if (step % 20 == 0) done = boards_[0]->move_to(joints, std::array{-0.3 + swing, 0.0, swing}).ok();
    if (step % 25 == 5) done = boards_[1]->move_to(joints, std::array{swing, 0.0, 0.1}).ok();
    if (step == 10) {
      done = boards_[3]->set_control_mode(joints, ControlMode::kVelocity).ok() &&
             boards_[3]->set_velocities(joints, std::array{-0.4, 0.1, 0.0}).ok();
    }
    if (step == 20) done = world("world fault cam left slow") == "[ok]";
    if (step == 31) done = world("world mk sph 0.03 0.1 0.9 0.35 0 1 0") == "[ok]";
    if (step == 35) done = world("world fault left_arm 0 weak") == "[ok]";
    if (step == 37) done = world("world fault cam right noise") == "[ok]";
    if (step == 51) done = world("world force sph 1 0.3 0 0.2 0.1") == "[ok]";
    EXPECT_TRUE(done) << "at step " << step;
  }

  std::shared_ptr<sim::SimulatedRobot> robot_;
  std::vector<std::unique_ptr<sim::SimulatedControlBoard>> boards_;
  std::vector<std::unique_ptr<sim::SimulatedCamera>> eyes_;
};

// the second half of a run, from a snapshot in its middle: the same states and pictures, in the same process
// and in a new one's robot that has lived otherwise
TEST(SimulatedRobot, ARunRestoredHalfWayIsTheSameRun) {
  const std::filesystem::path scenes = std::filesystem::path(testing::TempDir()) / "nido_half_way";
  std::filesystem::remove_all(scenes);
  RecordedRun run(scenes);
  const std::vector<std::string> first_half = run.go(0, 40);
  ASSERT_EQ(run.world("world snapshot half file"), "[ok]");
  const std::vector<std::string> second_half = run.go(40, 70);
  EXPECT_NE(second_half.front(), second_half.back());
  ASSERT_EQ(run.world("world restore half"), "[ok]");
  EXPECT_TRUE(run.go(40, 70) == second_half) << "in the same robot";

  RecordedRun again(scenes);
  EXPECT_TRUE(again.go(0, 40) == first_half) << "from the start";
  RecordedRun other(scenes);
  other.wait(17);
  ASSERT_EQ(other.world("world restore half"), "[ok]");
  EXPECT_TRUE(other.go(40, 70) == second_half) << "in another robot";
  std::filesystem::remove_all(scenes);
}

// a stuck eye shows the moment in which it stuck, also when nobody knows that moment but a snapshot's file
TEST(SimulatedCamera, AStuckEyesPictureIsPartOfASnapshot) {
  const std::filesystem::path scenes = std::filesystem::path(testing::TempDir()) / "nido_stuck_eye";
  std::filesystem::remove_all(scenes);
  sim::SimulationOptions options;
  options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  options.world_path = std::string(NIDO_CONFIG_DIR) + "/worlds/table.yaml";
  options.scene_folder = scenes;
  struct Seer {
    explicit Seer(const sim::SimulationOptions& of, const sim::Camera& optics = {})
        : robot(required(sim::SimulatedRobot::create(of, {}))),
          eye(required(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, optics))) {}
    std::vector<std::uint8_t> look() {
      Image image;
      EXPECT_TRUE(eye->grab(image).ok());
      return image.rgb;
    }
    void world(const std::string& line) { EXPECT_EQ(sim::SimulatedWorld(robot).command(line), "[ok]"); }
    std::shared_ptr<sim::SimulatedRobot> robot;
    std::unique_ptr<sim::SimulatedCamera> eye;
  };

  Seer first(options);
  first.world("world fault cam left stuck");
  const auto stuck = first.look();
  first.world("world light brightness 0.5");
  const auto hash = first.robot->simulation().complete_hash();
  first.world("world snapshot dark file");
  ASSERT_TRUE(first.look() == stuck);
  first.world("world fault clear");
  const auto dark = first.look();
  ASSERT_FALSE(dark == stuck) << "the light did change";
  first.world("world fault cam left stuck");
  ASSERT_TRUE(first.look() == dark) << "stuck anew, in the dark";
  first.world("world restore dark");
  EXPECT_TRUE(first.look() == stuck) << "the picture of the first time";

  Seer second(options);
  EXPECT_NE(second.robot->simulation().complete_hash(), hash);
  second.world("world restore dark");
  EXPECT_EQ(second.robot->simulation().complete_hash(), hash);
  EXPECT_TRUE(second.look() == stuck) << "from the file";
  second.world("world reset");
  second.world("world fault cam left stuck");
  second.world("world light brightness 0.5");
  EXPECT_FALSE(second.look() == stuck) << "a reset forgets the picture";

  Seer small(options, {.width = 160, .height = 120});
  small.world("world restore dark");
  EXPECT_EQ(small.look().size(), std::size_t{160} * 120 * 3) << "the picture of another camera is no use";
  std::filesystem::remove_all(scenes);
}

TEST(SimulatedCamera, ThePortsLightIsSeen) {
  const auto robot = simulated_robot();
  const auto eye = required(sim::SimulatedCamera::create(robot, sim::Eye::kLeft, {}));
  sim::SimulatedWorld world(robot);
  const auto mean = [&] {
    Image image;
    EXPECT_TRUE(eye->grab(image).ok());
    double sum = 0;
    for (const std::uint8_t level : image.rgb) sum += level;
    return sum / static_cast<double>(image.rgb.size());
  };
  const double normal = mean();
  ASSERT_EQ(world.command("world light brightness 0.25"), "[ok]");
  EXPECT_NEAR(mean() / normal, 0.5, 0.1) << "a quarter of the light: half the coded value";
  ASSERT_EQ(world.command("world reset"), "[ok]");
  EXPECT_NEAR(mean(), normal, 0.01);
}

// a plate across the view: every pixel's depth is where its ray meets the plate's near face
TEST(SimulatedDepthCamera, MeasuresWhereAKnownPlateIs) {
  const auto robot = simulated_robot();
  sim::Camera optics;
  const auto camera = required(sim::SimulatedDepthCamera::create(robot, sim::Eye::kLeft, optics));
  sim::SimulatedWorld world(robot);
  // 0.3 m wide and high, 0.02 m thick, turned; the eye looks forward (port z) at 0.94 m of height
  ASSERT_EQ(world.command("world mk sbox 0.3 0.3 0.02 0.03 0.93 0.55 1 0 0"), "[ok]");
  ASSERT_EQ(world.command("world rot sbox 1 10 25 5"), "[ok]");
  ASSERT_TRUE(robot->step_to(2 * kPeriod_ns).ok());
  DepthPicture picture;
  ASSERT_TRUE(camera->measure(picture).ok());
  EXPECT_EQ(picture.stamp_ns, 2 * kPeriod_ns);
  ASSERT_EQ(picture.width, optics.width);
  const std::vector<std::string> labels = required(camera->labels());
  const auto plate =
      static_cast<std::uint16_t>(std::find(labels.begin(), labels.end(), "sbox 1") - labels.begin() + 1);
  ASSERT_LE(plate, labels.size());
  const Eigen::Isometry3d X_PlateCamera = robot->simulation().object("sbox 1")->X_WorldObject.inverse() *
                                          robot->simulation().X_WorldCamera(sim::Eye::kLeft);
  const Eigen::Vector3d eye = X_PlateCamera.translation();
  int pixels = 0;
  int wrong_label = 0;
  double worst_m = 0;
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      const Eigen::Vector3d ray_Camera((u + 0.5 - optics.cx_px) / optics.fx_px,
                                       (v + 0.5 - optics.cy_px) / optics.fy_px, 1);
      const Eigen::Vector3d ray = X_PlateCamera.linear() * ray_Camera;
      const double z_m = (std::copysign(0.01, eye.z()) - eye.z()) / ray.z();
      const Eigen::Vector3d hit = eye + z_m * ray;
      const double inside_m = 0.15 - std::max(std::abs(hit.x()), std::abs(hit.y()));
      const auto i = static_cast<std::size_t>(v * picture.width + u);
      if (inside_m > 0.003) {
        ++pixels;
        wrong_label += picture.label[i] == plate ? 0 : 1;
        worst_m = std::max(worst_m, std::abs(picture.z_m[i] - z_m));
      }
    }
  }
  EXPECT_GT(pixels, 5000);
  EXPECT_EQ(wrong_label, 0);
  EXPECT_LT(worst_m, 1e-5);
  EXPECT_NE(world.command("world labels").find("(" + std::to_string(plate) + " \"sbox 1\")"),
            std::string::npos);
}

TEST(SimulatedControlBoard, NamesThePartsThatThereAre) {
  const auto board = sim::SimulatedControlBoard::create(simulated_robot(), "tail");
  ASSERT_FALSE(board.ok());
  EXPECT_NE(board.error().message.find("'tail'"), std::string::npos);
  EXPECT_NE(board.error().message.find("right_leg"), std::string::npos);
}

TEST(SimulatedRobot, TimeGoesOnWhenTheWorldIsReset) {
  const auto robot = simulated_robot();
  ASSERT_TRUE(robot->step_to(5 * kPeriod_ns).ok());
  robot->simulation().reset();
  ASSERT_TRUE(robot->step_to(7 * kPeriod_ns).ok());
  EXPECT_EQ(robot->now_ns(), 7 * kPeriod_ns);
}

TEST(SimulatedWorld, AsksTheClockWhileTheSimulationMayGoOn) {
  const auto robot = simulated_robot();
  sim::SimulatedWorld world(robot);
  EXPECT_EQ(world.command("world pause").substr(0, 6), "[fail]");
  // a clock that steps the robot itself, as one in another thread does while the port waits
  robot->set_clock([&](const std::string& line) {
    EXPECT_TRUE(robot->step_to(robot->now_ns() + kPeriod_ns).ok());
    return "[ok] " + line;
  });
  EXPECT_EQ(world.command("world step 0.03"), "[ok] step 3");
  EXPECT_EQ(robot->now_ns(), kPeriod_ns);
  EXPECT_EQ(world.command("world num box"), "0");
}

TEST(SimulatedWorld, AnswersTheVocabulary) {
  sim::SimulatedWorld world(simulated_robot());
  EXPECT_EQ(world.command("world num box"), "0");
  EXPECT_EQ(world.command("world mk box 0.05 0.05 0.05 0 0.3 0.3 1 0 0"), "[ok]");
  EXPECT_EQ(world.command("world num box"), "1");
  EXPECT_EQ(world.command("world fly").substr(0, 6), "[fail]");
}

}  // namespace
}  // namespace nido::test
