// A node for tests of whole runs; what it does is told by its parameter `behaviour`:
//   clock    drives /clock, 10 ms a tick, and can be stopped as a robot can
//   follow   ticks
//   fail     says that it failed, before it is ready
//   late     is never ready
//   die      ends with code 4 at tick 300: the launcher has seen that it was ready
//   judge    tells a story and an outcome at tick `at`, which is done or failed as `outcome` says
//   stubborn ticks, ignores SIGTERM
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>

#include "nido/middleware/typed_port.h"

namespace {
using namespace nido;

msgs::StageEvent event(Time now, const std::string& stage, const std::string& state,
                       const std::string& text) {
  msgs::StageEvent message;
  message.header().stamp().sec(static_cast<std::int32_t>(now.ns / 1000000000));
  message.header().stamp().nanosec(static_cast<std::uint32_t>(now.ns % 1000000000));
  message.stage(stage);
  message.state(state);
  message.text(text);
  return message;
}

Status body(Node& node) {
  auto behaviour = node.parameter<std::string>("behaviour", "follow");
  if (!behaviour) return behaviour.error();
  if (*behaviour == "fail") return Error{ErrorCode::kNotFound, "there is no lens in front of the eye"};
  if (*behaviour == "late") return node.run([](Time) { return Status(); });
  if (*behaviour == "clock") {
    auto input = node.open_input<msgs::JointCommand>("/body/command:i", Profile::kCommand);
    if (!input) return input.error();
    auto estop = node.open_service("/body/estop", [](const std::string& text) { return "[ok] " + text; });
    if (!estop) return estop.error();
    node.set_ready();
    for (Time now{0};; now.ns += 10000000) {
      if (auto status = node.publish_clock(now); !status) return status;
      // about as fast as a simulator
      usleep(1000);
    }
  }
  if (*behaviour == "stubborn") std::signal(SIGTERM, SIG_IGN);
  auto outcome = node.parameter<std::string>("outcome", "done");
  auto at = node.parameter<int>("at", 30);
  auto out = node.parameter<std::string>("out", "");
  std::unique_ptr<Output<msgs::StageEvent>> story;
  std::unique_ptr<Output<msgs::StageEvent>> verdict;
  if (*behaviour == "judge") {
    auto one = node.open_output<msgs::StageEvent>("/judge/stage:o", Profile::kEvent);
    auto two = node.open_output<msgs::StageEvent>("/judge/outcome:o", Profile::kEvent);
    if (!one) return one.error();
    if (!two) return two.error();
    story = std::move(*one);
    verdict = std::move(*two);
  }
  node.set_ready();
  int tick = 0;
  return node.run([&](Time now) -> Status {
    ++tick;
    if (*behaviour == "die" && tick == 300) {
      std::puts("my last words");
      std::fflush(stdout);
      std::_Exit(4);
    }
    if (*behaviour == "stubborn" && tick == 1) node.log_info("stubborn");
    if (*behaviour == "judge" && tick == 10) {
      // what is written before a reader is there is lost
      if (!story->wait_for_readers(1, 20) || !verdict->wait_for_readers(1, 20))
        return Error{ErrorCode::kTimeout, "nobody listens"};
      return story->write(event(now, "seen", "done", "the blue cube is there"));
    }
    if (*behaviour == "judge" && tick == *at) {
      if (!out->empty()) {
        std::ofstream(*out + "/report.json")
            << "{\"schema\": 1, \"outcome\": {\"success\": " << (*outcome == "done" ? "true" : "false")
            << "}}";
      }
      return verdict->write(event(now, "outcome", *outcome, "the cube is " + *outcome));
    }
    return {};
  });
}
}  // namespace

int main(int argc, char** argv) { return node_main(argc, argv, "test_node", body); }
