// nido-robot as a process: starts, publishes, answers, ends.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/wrappers/clients.h"
#include "rigs.h"

extern char** environ;

namespace nido::test {
namespace {

constexpr double kPatience_s = 30;

// of these tests alone, and of one at a time
constexpr int kDomain = 43;

// a child that is ended with the test
class Process {
 public:
  explicit Process(std::vector<std::string> arguments) {
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (posix_spawn(&child_, NIDO_ROBOT, nullptr, nullptr, argv.data(), environ) != 0) child_ = -1;
  }
  ~Process() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  bool started() const { return child_ > 0; }
  void signal(int which) const { kill(child_, which); }
  // Exit code, or nothing if the process goes on for so long.
  std::optional<int> wait(double timeout_s) {
    const int handle = static_cast<int>(syscall(SYS_pidfd_open, child_, 0));
    pollfd ended{handle, POLLIN, 0};
    const int ready = poll(&ended, 1, static_cast<int>(timeout_s * 1000));
    close(handle);
    if (ready != 1) return std::nullopt;
    int outcome = 0;
    waitpid(child_, &outcome, 0);
    child_ = -1;
    return WIFEXITED(outcome) ? WEXITSTATUS(outcome) : 128 + WTERMSIG(outcome);
  }

 private:
  pid_t child_ = -1;
};

class RobotProcess : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "nido-robot-test-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& text) {
    const std::filesystem::path path = folder_ / "robot.yaml";
    std::ofstream(path) << text;
    return path.string();
  }
  std::vector<std::string> command(const std::string& config, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"nido-robot", config, "--domain", std::to_string(kDomain)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  // Runs a robot that cannot start, and gives what it says.
  std::pair<int, std::string> run_failing(const std::string& config, std::vector<std::string> more = {}) {
    std::string line = NIDO_ROBOT;
    for (const std::string& argument : command(config, std::move(more))) {
      if (argument != "nido-robot") line += " '" + argument + "'";
    }
    FILE* pipe = popen((line + " 2>&1").c_str(), "r");
    std::string said;
    for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) said += static_cast<char>(c);
    const int outcome = pclose(pipe);
    return {WIFEXITED(outcome) ? WEXITSTATUS(outcome) : -1, said};
  }
  std::unique_ptr<Node> observer() {
    NodeOptions options;
    options.name = "observer" + std::to_string(getpid());
    options.domain = kDomain;
    options.handle_signals = false;
    return required(Node::create(options));
  }

  std::filesystem::path folder_;
};

TEST_F(RobotProcess, ServesTheFakeRobotAndEndsWhenAskedTo) {
  Process robot(command("fake"));
  ASSERT_TRUE(robot.started());
  const auto node = observer();
  const std::string local = "/observer" + std::to_string(getpid());
  const auto arm =
      required(control_board_client(*node, {"/icubSim/right_arm", local + "/right_arm", kPatience_s}));
  EXPECT_EQ(arm->axes(), 16);
  const auto eye = required(camera_client(*node, {"/icubSim/cam/left", local + "/left", kPatience_s}));
  const auto skin = required(touch_client(*node, {"/icubSim/skin/right_hand", local + "/skin", kPatience_s}));
  const auto ears = required(audio_client(*node, {"/icubSim/mic", local + "/mic", kPatience_s}));
  EXPECT_EQ(ears->sample_rate_hz(), 16000);
  const Result<std::string> name = node->call("/icubSim/head/rpc:i", "get name 4", kPatience_s);
  ASSERT_TRUE(name.ok()) << name.error().message;
  EXPECT_NE(name->find("eyes_version"), std::string::npos) << *name;
  // what it was started with can be looked at
  const auto settings =
      required(parse_parameters(required(node->call("/robot/control", "parameters", kPatience_s))
                                    .substr(std::string("[ok]\n").size())));
  const auto start = std::find_if(settings.begin(), settings.end(),
                                  [](const auto& one) { return one.key == "audio.start_s"; });
  ASSERT_NE(start, settings.end());
  EXPECT_EQ(start->value, "1");
  EXPECT_EQ(start->about.unit, "s");
  EXPECT_EQ(start->about.min, 0.0);
  EXPECT_FALSE(start->about.about.empty());
  EXPECT_FALSE(start->live);
  // a motion by rpc is seen in the state
  const int elbow[] = {3};
  const double target[] = {1.0};
  ASSERT_TRUE(arm->move_to(elbow, target).ok());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!(arm->read_joints().ok() && std::abs(arm->read_joints()->position_rad[3] - 1.0) < 1e-6) &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::yield();
  }
  EXPECT_NEAR(arm->read_joints()->position_rad[3], 1.0, 1e-6);
  Image image;
  EXPECT_TRUE(eye->grab(image).ok());
  // poses of all links come to whoever connects
  const auto poses = required(node->open_input<msgs::TFMessage>(local + "/tf:i", Profile::kEvent));
  ASSERT_TRUE(poses->connect("/tf").ok());
  ASSERT_TRUE(poses->wait_for_message(kPatience_s));
  const std::optional<msgs::TFMessage> body = poses->take();
  ASSERT_TRUE(body.has_value());
  const auto& transforms = body->transforms();
  EXPECT_GT(transforms.size(), 53U);
  EXPECT_TRUE(std::any_of(transforms.begin(), transforms.end(),
                          [](const auto& transform) { return transform.child_frame_id() == "r_hand"; }));
  robot.signal(SIGTERM);
  const std::optional<int> code = robot.wait(1.0);
  ASSERT_TRUE(code.has_value()) << "still running 1 s after SIGTERM";
  EXPECT_EQ(*code, 0);
}

// A left arm and a torso with what a real robot's file would say.
std::string careful_robot(const std::string& safety) {
  const std::string urdf = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  std::string text =
      "robot: icubSim\nclock: wall\nbody: {urdf: " + urdf + "}\nsafety:\n" + safety + "devices:\n";
  std::string servers = "servers:\n";
  for (const char* part : {"torso", "left_arm"}) {
    text += fmt::format("  - {{name: {0}, kind: fake/control_board, parameters: {{part: {0}, urdf: {1}}}}}\n",
                        part, urdf);
    servers += fmt::format("  - {{device: {0}, port: {0}}}\n", part);
  }
  return text + servers;
}

TEST_F(RobotProcess, AnEmergencyStopIsSeenAndStaysUntilItIsCleared) {
  Process robot(command(write(careful_robot("  estop: idle\n"))));
  ASSERT_TRUE(robot.started());
  const auto node = observer();
  const auto directory = required(Directory::open(*node));
  const auto is = [&](const std::string& state) {
    return directory->wait(
        [&](const Directory& d) { return d.node("robot") && d.node("robot")->state == state; }, kPatience_s);
  };
  ASSERT_TRUE(is("ready"));
  EXPECT_EQ(required(node->call("/icubSim/estop", "a test", kPatience_s)), "[ok]");
  ASSERT_TRUE(is("failed"));
  const std::string sentence =
      "the emergency stop is on (a test): 'nido node call robot estop clear' ends it";
  EXPECT_EQ(directory->node("robot")->detail, sentence);
  EXPECT_EQ(required(node->call("/icubSim/left_arm/rpc:i", "set pos 3 60", kPatience_s)),
            "[fail] \"" + sentence + "\"");
  EXPECT_NE(required(node->call("/icubSim/left_arm/rpc:i", "get icmd cmod 3", kPatience_s)).find("idl"),
            std::string::npos);
  EXPECT_EQ(required(node->call("/icubSim/estop", "clear", kPatience_s)), "[ok]");
  ASSERT_TRUE(is("ready"));
  EXPECT_EQ(required(node->call("/icubSim/left_arm/rpc:i", "set pos 3 60", kPatience_s)), "[ok]");
}

TEST_F(RobotProcess, ANodeThatIsNotHeardAnyMoreStopsTheRobot) {
  auto carer = observer();
  const std::string name = carer->options().name;
  Process robot(command(write(careful_robot("  heartbeat: {from: [" + name + "], timeout_s: 3}\n"))));
  ASSERT_TRUE(robot.started());
  const auto heard = [&](Node& node) {
    return required(node.call("/icubSim/estop", "state", kPatience_s)) ==
           "[is] state running \"\" (" + name + ") [ok]";
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!heard(*carer) && std::chrono::steady_clock::now() < end) {
    // a computer that is so busy that the carer could not answer in time
    if (required(carer->call("/icubSim/estop", "state", kPatience_s)).find("stopped") != std::string::npos)
      required(carer->call("/icubSim/estop", "clear", kPatience_s));
  }
  ASSERT_LT(std::chrono::steady_clock::now(), end);
  NodeOptions options;
  options.name = name + "b";
  options.domain = kDomain;
  options.handle_signals = false;
  carer.reset();
  const auto other = required(Node::create(options));
  std::string state;
  while (state.find("stopped") == std::string::npos && std::chrono::steady_clock::now() < end) {
    state = required(other->call("/icubSim/estop", "state", kPatience_s));
  }
  EXPECT_NE(state.find("stopped \"no heartbeat of " + name + " for 3 s\""), std::string::npos) << state;
}

TEST_F(RobotProcess, APortThatIsNotWrittenAnyMoreStopsTheRobot) {
  const auto node = observer();
  const std::string port = "/" + node->options().name + "/command:o";
  const auto output = required(node->open_output<msgs::JointCommand>(port, Profile::kCommand));
  Process robot(command(write(careful_robot("  heartbeat: {from: [\"" + port + "\"], timeout_s: 1}\n"))));
  ASSERT_TRUE(robot.started());
  const auto state = [&] { return required(node->call("/icubSim/estop", "state", kPatience_s)); };
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (state() != "[is] state running \"\" (" + port + ") [ok]" && std::chrono::steady_clock::now() < end) {
    ASSERT_TRUE(output->write(msgs::JointCommand()).ok());
    if (state().find("stopped") != std::string::npos)
      required(node->call("/icubSim/estop", "clear", kPatience_s));
  }
  while (state().find("stopped") == std::string::npos && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_NE(state().find("stopped \"no heartbeat of " + port + " for 1 s\""), std::string::npos) << state();
}

TEST_F(RobotProcess, LimitsAndBordersOfARobotFileAreKept) {
  Process robot(command(write(careful_robot(
      "  speed: 0.5\n  limits:\n    - {device: left_arm, joint: l_elbow, max_deg: 80, speed_deg_s: 20}\n"
      "  workspace:\n    - {name: ceiling, links: [l_hand], inside: {z_m: [-1, 0.1]}}\n"))));
  ASSERT_TRUE(robot.started());
  const auto node = observer();
  const auto ask = [&](const char* line) {
    return required(node->call("/icubSim/left_arm/rpc:i", line, kPatience_s));
  };
  EXPECT_EQ(ask("get llim 3").substr(0, 19), "[is] llim 15.5 80.0");
  EXPECT_EQ(ask("get vlim 3").substr(0, 18), "[is] vlim 0.0 10.0");
  const std::string refused = ask("set pos 0 -95");
  EXPECT_EQ(refused.substr(0, 6), "[fail]") << refused;
  EXPECT_NE(refused.find("mm beyond the border 'ceiling' of the workspace: nothing moves"), std::string::npos)
      << refused;
}

TEST_F(RobotProcess, SafetyThatMakesNoSenseIsRefused) {
  const auto refusal = [&](const std::string& safety) {
    const auto [code, said] = run_failing(write(careful_robot(safety)));
    EXPECT_EQ(code, 2) << said;
    return said;
  };
  EXPECT_NE(refusal("  limits: [{device: left_arm, joint: 3, max_deg: 300}]\n").find("wider"),
            std::string::npos);
  EXPECT_NE(refusal("  limits: [{device: left_leg, joint: 3}]\n").find("there is no device 'left_leg'"),
            std::string::npos);
  EXPECT_NE(refusal("  workspace: [{name: a, links: [l_hand]}]\n").find("one of inside, outside, plane"),
            std::string::npos);
  EXPECT_NE(
      refusal("  workspace: [{name: a, links: [l_hand], inside: {x_m: [1, 0]}}]\n").find("smaller one first"),
      std::string::npos);
}

TEST_F(RobotProcess, AWrongKeyIsRefusedWithFileAndLine) {
  const std::string file = write("robot: icubSim\nclock: wall\ncolour: red\ndevices: []\nservers: []\n");
  const auto [code, said] = run_failing(file);
  EXPECT_EQ(code, 2) << said;
  EXPECT_NE(said.find(file + ":3"), std::string::npos) << said;
  EXPECT_NE(said.find("colour"), std::string::npos) << said;
  EXPECT_NE(said.find("clock"), std::string::npos) << "the allowed keys are not named: " << said;
}

TEST_F(RobotProcess, AWrongParameterOfADeviceIsRefusedWithItsLine) {
  const std::string file = write(
      "robot: icubSim\ndevices:\n  - {name: eye, kind: fake/camera,\n     parameters: {width: -3}}\nservers: "
      "[]\n");
  const auto [code, said] = run_failing(file);
  EXPECT_EQ(code, 2) << said;
  EXPECT_NE(said.find(file + ":4"), std::string::npos) << said;
}

TEST_F(RobotProcess, AnUnknownKindIsRefusedWithTheKindsThatThereAre) {
  const std::string file = write("robot: icubSim\ndevices:\n  - {name: eye, kind: fake/nose}\nservers: []\n");
  const auto [code, said] = run_failing(file);
  EXPECT_EQ(code, 2) << said;
  EXPECT_NE(said.find("sim/control_board"), std::string::npos) << said;
}

TEST_F(RobotProcess, AServerOfNothingIsRefused) {
  const std::string file = write(
      "robot: icubSim\ndevices:\n  - {name: eye, kind: fake/camera}\nservers:\n  - {device: ear, port: x}\n");
  const auto [code, said] = run_failing(file);
  EXPECT_EQ(code, 2) << said;
  EXPECT_NE(said.find(file + ":5"), std::string::npos) << said;
  EXPECT_NE(said.find("'ear'"), std::string::npos) << said;
}

TEST_F(RobotProcess, ARobotOrSettingThatDoesNotExistIsNamed) {
  const auto [code, said] = run_failing("unicorn");
  EXPECT_EQ(code, 3) << said;
  EXPECT_NE(said.find("icub_sim"), std::string::npos) << said;
  const auto [code2, said2] = run_failing("fake", {"--set", "speed=3"});
  EXPECT_EQ(code2, 2) << said2;
  EXPECT_NE(said2.find("speed"), std::string::npos) << said2;
}

TEST_F(RobotProcess, ASnapshotThatIsNoneIsRefused) {
  const auto [code, said] = run_failing("icub_sim", {"--set", "start_from=/nowhere/half.json"});
  EXPECT_EQ(code, 3) << said;
  EXPECT_NE(said.find("/nowhere/half.json"), std::string::npos) << said;
  const std::string file = (folder_ / "half.json").string();
  std::ofstream(file) << R"({"format": "nido snapshot 2"})";
  const auto [code2, said2] = run_failing("icub_sim", {"--set", "start_from=" + file});
  EXPECT_EQ(code2, 2) << said2;
  EXPECT_NE(said2.find("is no snapshot of a robot"), std::string::npos) << said2;
}

TEST_F(RobotProcess, ADeviceThatFailsEndsTheProcessWithItsName) {
  const std::string urdf = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  const std::string file = write(
      "robot: icubSim\nclock: wall\ndevices:\n  - name: head\n    kind: fake/control_board\n    parameters: "
      "{part: head, urdf: " +
      urdf + ", fail: reads, fail_after_s: 0.2}\nservers:\n  - {device: head, port: head}\n");
  const auto [code, said] = run_failing(file);
  EXPECT_EQ(code, 1) << said;
  EXPECT_NE(said.find("head"), std::string::npos) << said;
  EXPECT_NE(said.find("told to fail"), std::string::npos) << said;
}

}  // namespace
}  // namespace nido::test
