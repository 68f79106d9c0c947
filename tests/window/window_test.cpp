// The window on a simulated world: on a screen that is played, and on a real display (Xvfb) if there is one.
#include "nido/simulator/window/window.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "nido/simulator/devices/simulated_sensors.h"
#include "nido/simulator/window/view_controller.h"

extern char** environ;

namespace nido::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kPeriod_ns = 10'000'000;

// true as soon as the condition holds; the wall's clock only ends what never comes
bool eventually(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

std::shared_ptr<SimulatedRobot> robot_at_a_table() {
  SimulationOptions options;
  options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  options.world_yaml =
      "table: {top_center_m: [-0.4, 0, -0.0826], size_m: [0.4, 0.7]}\n"
      "objects:\n"
      "  - {object: cube, name: blue cube, colour: blue, position_m: [-0.4, 0.2]}\n";
  auto made = SimulatedRobot::create(options, {});
  if (!made) {
    ADD_FAILURE() << made.error().message;
    std::abort();
  }
  return *made;
}

// moves an arm, so that there is something to compare
void begin_motion(SimulatedRobot& robot) {
  Simulation& simulation = robot.simulation();
  const std::array<int, 3> joints = {0, 1, 3};
  ASSERT_TRUE(simulation
                  .command(simulation.part_index("left_arm"), JointMode::kPosition, joints,
                           std::array<double, 3>{-0.7, 0.4, 1.1})
                  .ok());
}

void step(SimulatedRobot& robot, int periods) {
  ASSERT_TRUE(robot.step_to(robot.now_ns() + periods * kPeriod_ns).ok());
}

// What a person would do, played; shared by the test and the window's thread.
struct Play {
  std::mutex mutex;
  std::vector<InputEvent> events;
  Overlay last;
  int width = 320;
  int height = 240;
  int picture_width = 0;
  bool closed = false;

  void send(InputEvent event) {
    const std::lock_guard lock(mutex);
    events.push_back(event);
  }
  void key(char letter) {
    InputEvent event;
    event.kind = InputEvent::Kind::kKey;
    event.key = letter;
    send(event);
  }
  void mouse(InputEvent::Kind kind, const Eigen::Vector2d& at_px) {
    InputEvent event;
    event.kind = kind;
    event.x_px = at_px.x();
    event.y_px = at_px.y();
    send(event);
  }
  Overlay overlay() {
    const std::lock_guard lock(mutex);
    return last;
  }
};

class PlayedScreen final : public IScreen {
 public:
  explicit PlayedScreen(std::shared_ptr<Play> play) : play_(std::move(play)) {}
  int width() const override {
    const std::lock_guard lock(play_->mutex);
    return play_->width;
  }
  int height() const override {
    const std::lock_guard lock(play_->mutex);
    return play_->height;
  }
  std::vector<InputEvent> poll() override {
    const std::lock_guard lock(play_->mutex);
    return std::exchange(play_->events, {});
  }
  bool closed() const override {
    const std::lock_guard lock(play_->mutex);
    return play_->closed;
  }
  void show(Image& picture, const Overlay& overlay) override {
    const std::lock_guard lock(play_->mutex);
    play_->picture_width = picture.width;
    play_->last = overlay;
  }

 private:
  std::shared_ptr<Play> play_;
};

struct Said {
  std::mutex mutex;
  std::vector<std::string> sentences;
  bool has(const std::string& part) {
    const std::lock_guard lock(mutex);
    return std::any_of(sentences.begin(), sentences.end(),
                       [&](const std::string& one) { return one.find(part) != std::string::npos; });
  }
};

class PlayedWindow : public testing::Test {
 protected:
  void SetUp() override {
    WindowOptions options;
    options.report = [said = said_](const std::string& sentence) {
      const std::lock_guard lock(said->mutex);
      said->sentences.push_back(sentence);
    };
    auto window = Window::open(robot_, options,
                               [play = play_](const WindowOptions&) -> Result<std::unique_ptr<IScreen>> {
                                 return std::unique_ptr<IScreen>(std::make_unique<PlayedScreen>(play));
                               });
    ASSERT_TRUE(window.ok()) << window.error().message;
    window_ = std::move(*window);
    next_picture();
  }
  // All that was sent has been taken, and its picture shown.
  void next_picture() {
    const std::uint64_t before = window_->shown();
    ASSERT_TRUE(eventually([&] { return window_->shown() >= before + 2 || !window_->is_open(); }));
  }
  Eigen::Vector3d cube() { return robot_->simulation().object("blue cube")->X_WorldObject.translation(); }
  Eigen::Vector2d pixel_of(const Eigen::Vector3d& p_World_m) const {
    const Camera camera = ViewController(play_->width, play_->height).camera();
    const Eigen::Vector3d p = camera.X_WorldCamera.inverse() * p_World_m;
    return {camera.fx_px * p.x() / p.z() + camera.cx_px, camera.fy_px * p.y() / p.z() + camera.cy_px};
  }

  std::shared_ptr<SimulatedRobot> robot_ = robot_at_a_table();
  std::shared_ptr<Play> play_ = std::make_shared<Play>();
  std::shared_ptr<Said> said_ = std::make_shared<Said>();
  std::unique_ptr<Window> window_;
};

TEST_F(PlayedWindow, AThingIsPulledAndLetGo) {
  step(*robot_, 30);
  const Eigen::Vector3d before = cube();
  play_->mouse(InputEvent::Kind::kPress, pixel_of(before));
  next_picture();
  EXPECT_TRUE(said_->has("pulls blue cube"));
  play_->mouse(InputEvent::Kind::kMove, pixel_of(before + Eigen::Vector3d(0, 0, 0.35)));
  for (int i = 0; i < 6; ++i) {
    next_picture();
    step(*robot_, 10);
  }
  EXPECT_GT(cube().z(), before.z() + 0.02) << "lifted off the table";
  EXPECT_LT(cube().z(), before.z() + 0.5);
  const Overlay drawn = play_->overlay();
  EXPECT_TRUE(std::any_of(drawn.lines.begin(), drawn.lines.end(), [](const auto& line) {
    return line.arrow;
  })) << "the force is drawn";
  play_->mouse(InputEvent::Kind::kRelease, {0, 0});
  next_picture();
  EXPECT_TRUE(said_->has("lets go of blue cube"));
  step(*robot_, 150);
  EXPECT_LT(cube().z(), before.z() + 0.02) << "falls again";
  EXPECT_TRUE(play_->overlay().lines.empty());
}

TEST_F(PlayedWindow, TableAndRobotAreNotPulled) {
  const Eigen::Vector3d before = cube();
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(-0.5, -0.1, -0.0826), Eigen::Vector3d(0, 0, 0.13)}) {
    play_->mouse(InputEvent::Kind::kPress, pixel_of(point));
    next_picture();
    play_->mouse(InputEvent::Kind::kRelease, pixel_of(point));
  }
  next_picture();
  EXPECT_FALSE(said_->has("pulls"));
  EXPECT_LT((cube() - before).norm(), 1e-3);
}

TEST_F(PlayedWindow, KeysShowWhatTouchesAndTheJoints) {
  step(*robot_, 5);
  EXPECT_TRUE(play_->overlay().rings.empty());
  play_->key('c');
  play_->key('j');
  play_->key('h');
  next_picture();
  const Overlay overlay = play_->overlay();
  EXPECT_FALSE(overlay.rings.empty()) << "the cube touches the table";
  std::set<std::string> words;
  for (const Overlay::Text& text : overlay.texts) words.insert(text.words);
  for (const char* expected : {"l_elbow", "torso_yaw", "closes the window"}) {
    EXPECT_TRUE(std::any_of(words.begin(), words.end(), [&](const std::string& one) {
      return one.find(expected) != std::string::npos;
    })) << expected;
  }
}

TEST_F(PlayedWindow, FollowsTheSizeOfTheScreen) {
  {
    const std::lock_guard lock(play_->mutex);
    play_->width = 200;
    play_->height = 150;
  }
  next_picture();
  const std::lock_guard lock(play_->mutex);
  EXPECT_EQ(play_->picture_width, 200);
}

TEST_F(PlayedWindow, ClosingItEndsTheWindowAlone) {
  play_->key('q');
  ASSERT_TRUE(eventually([this] { return !window_->is_open(); }));
  const std::int64_t before_ns = robot_->now_ns();
  step(*robot_, 10);
  EXPECT_EQ(robot_->now_ns(), before_ns + 10 * kPeriod_ns);
}

TEST_F(PlayedWindow, KeysAskTheClock) {
  // the owner of a clock, who only listens
  auto asked = std::make_shared<Said>();
  robot_->set_clock([asked](const std::string& line) -> std::string {
    const std::lock_guard lock(asked->mutex);
    asked->sentences.push_back(line);
    const bool paused =
        std::find(asked->sentences.begin(), asked->sentences.end(), "pause") != asked->sentences.end();
    return line == "get" ? std::string("[ok] time_s=0 state=") + (paused ? "paused" : "running") : "[ok]";
  });
  play_->key(' ');
  next_picture();
  EXPECT_TRUE(asked->has("pause"));
  play_->key('.');
  next_picture();
  EXPECT_TRUE(asked->has("step 1"));
  play_->key(' ');
  next_picture();
  EXPECT_TRUE(asked->has("run"));
}

TEST(Window, WithoutADisplayThereIsASentence) {
  const char* display = std::getenv("DISPLAY");
  const std::string before = display == nullptr ? "" : display;
  unsetenv("DISPLAY");
  const auto window = Window::open(robot_at_a_table(), {});
  ASSERT_FALSE(window.ok());
  EXPECT_EQ(window.error().code, ErrorCode::kNotFound);
  EXPECT_NE(window.error().message.find("DISPLAY is not set"), std::string::npos) << window.error().message;
  setenv("DISPLAY", ":97", 1);  // nobody is there
  const auto nobody = Window::open(robot_at_a_table(), {});
  ASSERT_FALSE(nobody.ok());
  EXPECT_NE(nobody.error().message.find(":97"), std::string::npos) << nobody.error().message;
  unsetenv("DISPLAY");
  if (!before.empty()) setenv("DISPLAY", before.c_str(), 1);
}

// A display in memory; ended with the test.
class VirtualDisplay {
 public:
  VirtualDisplay() {
    if (!std::filesystem::exists("/usr/bin/Xvfb")) return;
    int number[2];
    if (pipe(number) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, number[1], 9);
    posix_spawn_file_actions_addclose(&actions, number[0]);
    std::string program = "/usr/bin/Xvfb";
    // it chooses a number that is free and writes it
    std::vector<std::string> words = {program, "-displayfd", "9",         "-screen",
                                      "0",     "800x600x24", "-nolisten", "tcp"};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    if (posix_spawn(&child_, program.c_str(), &actions, nullptr, argv.data(), environ) != 0) child_ = -1;
    posix_spawn_file_actions_destroy(&actions);
    close(number[1]);
    std::string text;
    char letter = 0;
    while (child_ > 0 && read(number[0], &letter, 1) == 1 && letter != '\n') text += letter;
    close(number[0]);
    if (!text.empty()) name_ = ":" + text;
  }
  ~VirtualDisplay() { end(); }
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }
  void end() {
    if (child_ <= 0) return;
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
    child_ = -1;
  }

 private:
  pid_t child_ = -1;
  std::string name_;  // empty: none
};

TEST(Window, OnADisplayChangesNothingAndItsEndEndsNothing) {
  VirtualDisplay display;
  if (display.name().empty()) GTEST_SKIP() << "there is no Xvfb (package xvfb)";
  const auto alone = robot_at_a_table();
  begin_motion(*alone);
  step(*alone, 60);

  setenv("DISPLAY", display.name().c_str(), 1);
  const auto watched = robot_at_a_table();
  begin_motion(*watched);
  auto window = Window::open(watched, {});
  unsetenv("DISPLAY");
  ASSERT_TRUE(window.ok()) << window.error().message;
  for (int i = 0; i < 6; ++i) {
    const std::uint64_t before = (*window)->shown();
    step(*watched, 10);
    ASSERT_TRUE(eventually([&] { return (*window)->shown() > before; })) << "no picture came";
  }
  EXPECT_EQ(watched->simulation().state_hash(), alone->simulation().state_hash());
  // the display goes; the simulation stays
  display.end();
  EXPECT_TRUE(eventually([&] { return !(*window)->is_open(); }));
  step(*watched, 5);
  step(*alone, 5);
  EXPECT_EQ(watched->simulation().state_hash(), alone->simulation().state_hash());
}

}  // namespace
}  // namespace nido::sim
