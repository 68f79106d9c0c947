// nido-bench-idle: what a node takes that has nothing to do, beside a bare process of Fast DDS
// (docs/bench.md).
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench_options.h"
#include "child.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "plain_dds.h"
#include "report.h"

namespace nido::bench {

namespace {

Status be_node(int domain) {
  NodeOptions options;
  options.name = "idle";
  options.domain = domain;
  options.handle_signals = false;
  auto node = Node::create(std::move(options));
  if (!node) return node.error();
  auto out = (*node)->open_output<msgs::JointState>("/idle/out:o", Profile::kState);
  auto in = (*node)->open_input<msgs::JointState>("/idle/in:i", Profile::kState);
  if (!out || !in) return Error{ErrorCode::kFailed, "no ports"};
  (*node)->set_ready();
  tell_parent("ready");
  while (hear_parent()) {
  }
  return {};
}

Status be_plain(int domain) {
  PlainParticipant participant(domain);
  participant.writer(participant.topic<64>("idle_out"), 1);
  participant.reader(participant.topic<64>("idle_in"), 1, nullptr);
  tell_parent("ready");
  while (hear_parent()) {
  }
  return {};
}

// Of all its threads.
double processor_s(pid_t pid) {
  double sum_ns = 0;
  std::error_code error;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task", error)) {
    double ran_ns = 0;
    std::ifstream(task.path() / "schedstat") >> ran_ns;
    sum_ns += ran_ns;
  }
  return sum_ns * 1e-9;
}

double megabytes_of(pid_t pid, const std::string& field) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/smaps_rollup");
  std::string word;
  double kilobytes = 0;
  while (file >> word) {
    if (word == field && file >> kilobytes) break;
  }
  return kilobytes / 1024;
}

int idle_main(int argc, char** argv) {
  Options options;
  double seconds = 10;
  std::string who;
  CLI::App app{"Measures a node that does nothing. Example: nido bench idle --json"};
  options.add_to(app);
  app.add_option("--for", seconds, "how long it is watched")->check(CLI::Range(0.5, 3600.0));
  app.add_option("--be", who)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!who.empty()) {
    live_no_longer_than_parent();
    return exit_code(who == "node" ? be_node(options.domain) : be_plain(options.domain));
  }
  const std::vector<std::pair<std::string, std::string>> kinds = {{"nido node", "node"},
                                                                  {"plain Fast DDS", "plain"}};
  std::vector<std::unique_ptr<Child>> children;
  for (const auto& [name, kind] : kinds) {
    // a domain of its own: neither has to do with the other
    children.push_back(std::make_unique<Child>(std::vector<std::string>{
        "--be", kind, "--domain", std::to_string(options.domain + static_cast<int>(children.size()))}));
  }
  for (const auto& child : children) {
    if (!child->hear(20.0)) return exit_code(Error{ErrorCode::kTimeout, "a process did not start"});
  }
  // discovery calms down
  std::this_thread::sleep_for(std::chrono::seconds(1));
  std::vector<double> before_s;
  for (const auto& child : children) before_s.push_back(processor_s(child->pid()));
  const long long begin_ns = now_ns();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double watched_s = static_cast<double>(now_ns() - begin_ns) * 1e-9;
  Report report("idle");
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const pid_t pid = children[i]->pid();
    report.add(kinds[i].first, "idle_resident", megabytes_of(pid, "Rss:"), "MB", 1);
    report.add(kinds[i].first, "idle_proportional", megabytes_of(pid, "Pss:"), "MB", 1);
    report.add(kinds[i].first, "idle_processor", 100 * (processor_s(pid) - before_s[i]) / watched_s, "%", 1);
  }
  report.print(options.json);
  return 0;
}

}  // namespace

}  // namespace nido::bench

int main(int argc, char** argv) { return nido::bench::idle_main(argc, argv); }
