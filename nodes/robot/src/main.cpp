// nido-robot: the robot process. Usage: nido-robot CONFIG [--window] [--domain N] [--set KEY=VALUE]..., or
// --node FILE as the launcher does. docs/robot.md

#include <malloc.h>

#include <string>
#include <vector>

#include "nido/middleware/clock_control.h"
#include "nido/middleware/node.h"
#include "src/robot.h"
#include "src/robot_file.h"
#include "src/settings.h"

namespace nido {
namespace {

// The robot makes the time: the clock is published after each control period, and waited for in lockstep.
Status run_simulated(Node& node, Robot& robot, const RobotFile& file, const RobotSettings& settings,
                     std::int64_t start_ns, ClockControl& clock) {
  const auto period_ns = Time::from_seconds(file.period_s).ns;
  const auto log = [&node](const std::string& sentence) { node.log_info(sentence); };
  if (settings.run.goes_on) {
    // What is said in the first tick of all is not handed out to this process: whether it comes would be
    // chance. So that one is of the period before, and nothing is missing of the first that counts.
    if (Status told = node.publish_clock(Time{start_ns - period_ns}); !told) return told;
    if (Status published = robot.publish(); !published) return published;
  }
  for (std::int64_t now_ns = start_ns;;) {
    if (!settings.snapshot_file.empty() && now_ns == settings.snapshot_at_s * 1'000'000'000) {
      const Result<RobotSnapshot> made = robot.snapshot();
      if (!made) return made.error();
      if (Status kept = write_robot_snapshot(*made, settings.snapshot_file); !kept) return kept;
      log("snapshot " + settings.snapshot_file.string());
    }
    if (Status told = node.publish_clock(Time{now_ns}); !told) return told;
    std::int64_t next_ns = now_ns + period_ns;
    if (robot.has_far_time()) {
      next_ns = robot.wait_for_far_time(now_ns, period_ns, log);
    } else {
      if (Status due = clock.wait(Time{now_ns}); !due) return due;
    }
    if (Status stepped = robot.step_to(next_ns); !stepped) return stepped;
    now_ns = next_ns;
  }
}

Status run(Node& node) {
  const Result<RobotSettings> settings = read_settings(node.options().parameters, node.options().seed);
  if (!settings) return settings.error();
  list_settings(node);
  const Result<RobotFile> file = load_robot_file(settings->robot_file);
  if (!file) return file.error();
  // in an app that takes its time from the robot, one without a simulator makes it too: a far robot's time,
  // or its own seconds
  const bool makes_time = file->simulated_time || node.options().clock != ClockMode::kWall;
  const std::optional<double> rate = file->simulated_time ? settings->rate : 1.0;
  std::int64_t start_ns = makes_time ? 0 : node.now().ns;
  std::optional<RobotSnapshot> before;
  if (!settings->start_from.empty()) {
    auto read = read_robot_snapshot(settings->start_from);
    if (!read) return read.error();
    before = std::move(*read);
    start_ns = before->time_ns;
  }
  std::unique_ptr<ClockControl> clock;  // outlives the robot, whose world port asks it
  const Result<std::unique_ptr<Robot>> robot = Robot::create(node, *file, settings->run, start_ns);
  if (!robot) return robot.error();
  if (before) {
    if (Status restored = (*robot)->go_on_from(*before, settings->start_from.string()); !restored)
      return restored;
    before.reset();
  }
  if (makes_time) {
    auto control = ClockControl::open(node, rate, settings->is_paused);
    if (!control) return control.error();
    clock = std::move(*control);
    (*robot)->set_clock([&clock](const std::string& line) { return clock->command(line); });
  }
  if (settings->window || file->window) {
    if (Status opened = (*robot)->open_window(); !opened) return opened;
  }
  if (!settings->run.goes_on) {
    if (Status published = (*robot)->publish(); !published) return published;
  }
  // reading meshes, textures and the body leaves megabytes behind that nobody needs any more
  malloc_trim(0);
  node.set_ready();
  const Status ended = makes_time ? run_simulated(node, **robot, *file, *settings, start_ns, *clock)
                                  : node.run([&robot](Time now) { return (*robot)->step_to(now.ns); });
  // asked to stop is what a robot process ends with
  if (!ended && ended.error().code == ErrorCode::kInterrupted) return {};
  return ended;
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  // nido-robot CONFIG ... is --set robot_file=CONFIG
  std::vector<std::string> arguments(argv, argv + argc);
  if (argc > 1 && argv[1][0] != '-') {
    arguments[1] = "robot_file=" + arguments[1];
    arguments.insert(arguments.begin() + 1, "--set");
  }
  // and --window is --set window=true
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i] != "--window") continue;
    arguments[i] = "window=true";
    arguments.insert(arguments.begin() + static_cast<std::ptrdiff_t>(i), "--set");
    ++i;
  }
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  return nido::node_main(static_cast<int>(arguments.size()), pointers.data(), "robot", nido::run);
}
