// nido-recorder: records the run of an app (`nido launch APP --record FILE.mcap`).
#include <csignal>
#include <ctime>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "nido/launcher/terminal.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/recorder/recorder.h"

namespace {

using namespace nido;

constexpr timespec kPeriod{0, 10'000'000};

// Waits a period; true when the process was asked to end.
bool wait_for_signal(const sigset_t& signals) { return sigtimedwait(&signals, nullptr, &kPeriod) > 0; }

// What is missing in the file, in a sentence; empty if nothing is.
std::string sentence_of(const std::vector<RecordedPort>& ports) {
  std::uint64_t lost = 0;
  std::string worst;
  std::uint64_t most = 0;
  for (const auto& port : ports) {
    lost += port.lost;
    if (port.lost > most) {
      most = port.lost;
      worst = port.name;
    }
  }
  return lost == 0 ? ""
                   : "the recording lacks " + std::to_string(lost) + " messages that were written, " +
                         std::to_string(most) + " of them of " + worst;
}

Status record(Node& node, Node& looker, const sigset_t& signals) {
  const auto file = node.parameter<std::string>("file", "recording.mcap");
  const auto nodes = node.parameter<std::vector<std::string>>("nodes", {});
  const auto ports = node.parameter<std::vector<std::string>>("ports", {});
  const auto except = node.parameter<std::vector<std::string>>("except", {});
  const auto is_simulated = node.parameter<bool>("simulated", true);
  for (const Error* error :
       {file ? nullptr : &file.error(), nodes ? nullptr : &nodes.error(), ports ? nullptr : &ports.error(),
        except ? nullptr : &except.error(), is_simulated ? nullptr : &is_simulated.error()}) {
    if (error != nullptr) return *error;
  }
  auto directory = Directory::open(looker);
  if (!directory) return directory.error();
  const bool in_lockstep = node.options().clock == ClockMode::kLockstep;
  RecorderOptions options;
  options.file = *file;
  options.ports = *ports;
  options.except = *except;
  options.clock = *is_simulated ? RecorderOptions::Clock::kSimulated : RecorderOptions::Clock::kWall;
  auto opened = Recorder::open(looker, **directory, options, in_lockstep ? &node : nullptr);
  if (!opened) return opened.error();
  Recorder& recorder = **opened;
  node.set_ready();

  Status status;
  Status in_ticks;
  std::thread member;
  bool stopped = false;
  while (!stopped && status) {
    // the first tick waits for this node, and this node for everybody's ports
    if (in_lockstep && !member.joinable() && recorder.follows(*nodes)) {
      member = std::thread([&] { in_ticks = node.run([&](Time now) { return recorder.take_tick(now); }); });
    }
    status = recorder.poll();
    stopped = wait_for_signal(signals);
  }
  node.stop();
  if (member.joinable()) member.join();
  if (status) status = in_ticks;
  const Status closing = recorder.close();
  if (status) status = closing;
  if (!status) return status;
  const auto recorded = recorder.ports();
  for (const auto& port : recorded) {
    if (!port.refused.empty()) node.log_warning(port.name + " was not recorded: " + port.refused);
  }
  if (const auto lost = sentence_of(recorded); !lost.empty()) return Error{ErrorCode::kFailed, lost};
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  auto options = Node::options_from_args(argc, argv, "recorder");
  const auto refuse = [](const Error& error) {
    std::cerr << "recorder: " << error.message << "\n";
    return exit_code_of(error);
  };
  if (!options) return refuse(options.error());
  options->handle_signals = false;
  // every tick, whatever the clock's period is
  options->period_s = 0.0001;
  if (options->clock == ClockMode::kSimulated) options->clock = ClockMode::kWall;
  NodeOptions hidden;
  hidden.name = options->name + "_looker";
  hidden.domain = options->domain;
  hidden.handle_signals = false;
  hidden.hidden = true;
  auto node = Node::create(*options);
  if (!node) return refuse(node.error());
  auto looker = Node::create(hidden);
  if (!looker) return refuse(looker.error());
  const Status status = record(**node, **looker, signals);
  if (status) return 0;
  (*node)->set_failed(status.error().message);
  return exit_code_of(status.error());
}
