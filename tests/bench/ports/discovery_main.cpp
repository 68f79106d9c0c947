// nido-bench-discovery: how soon processes that start together are connected, how soon a killed one is
// missed, and how soon it is back (docs/bench.md).
#include <CLI/CLI.hpp>
#include <atomic>
#include <thread>

#include "bench_options.h"
#include "child.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "plain_dds.h"
#include "report.h"

namespace nido::bench {

namespace {

constexpr int kPairs = 5;  // outputs of a process, and inputs: ten ports

std::string node_name(int index) { return "process" + std::to_string(index); }
std::string output_name(int index, int port) {
  return "/" + node_name(index) + "/out" + std::to_string(port) + ":o";
}

// A node whose inputs take from the node before it, all in a ring. Says "connected" when both its inputs and
// its outputs are, each time anew when it is asked.
Status be_node(int index, int count, int domain) {
  NodeOptions options;
  options.name = node_name(index);
  options.domain = domain;
  options.handle_signals = false;
  auto node = Node::create(std::move(options));
  if (!node) return node.error();
  std::vector<std::unique_ptr<Output<msgs::JointState>>> outputs;
  std::vector<std::unique_ptr<Input<msgs::JointState>>> inputs;
  for (int i = 0; i < kPairs; ++i) {
    auto out = (*node)->open_output<msgs::JointState>(output_name(index, i), Profile::kState);
    if (!out) return out.error();
    outputs.push_back(std::move(*out));
    auto in = (*node)->open_input<msgs::JointState>("/" + node_name(index) + "/in" + std::to_string(i) + ":i",
                                                    Profile::kState);
    if (!in) return in.error();
    if (auto status = (*in)->connect(output_name((index + count - 1) % count, i)); !status) return status;
    inputs.push_back(std::move(*in));
  }
  (*node)->set_ready();
  do {
    for (const auto& in : inputs) in->wait_for_sources(1, 60.0);
    for (const auto& out : outputs) out->wait_for_readers(1, 60.0);
    tell_parent(std::to_string(now_ns()));
  } while (hear_parent());
  return {};
}

// The same of plain Fast DDS.
Status be_plain(int index, int count, int domain) {
  PlainParticipant participant(domain);
  std::vector<dds::DataWriter*> writers;
  std::vector<dds::DataReader*> readers;
  for (int i = 0; i < kPairs; ++i) {
    writers.push_back(participant.writer(participant.topic<64>(output_name(index, i)), 1));
    readers.push_back(
        participant.reader(participant.topic<64>(output_name((index + count - 1) % count, i)), 1, nullptr));
  }
  const auto is_connected = [&] {
    for (int i = 0; i < kPairs; ++i) {
      dds::PublicationMatchedStatus out;
      dds::SubscriptionMatchedStatus in;
      writers[static_cast<std::size_t>(i)]->get_publication_matched_status(out);
      readers[static_cast<std::size_t>(i)]->get_subscription_matched_status(in);
      if (out.current_count == 0 || in.current_count == 0) return false;
    }
    return true;
  };
  while (!is_connected()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  tell_parent(std::to_string(now_ns()));
  while (hear_parent()) {
  }
  return {};
}

class Swarm {
 public:
  Swarm(std::string kind, int count, int domain) : kind_(std::move(kind)), count_(count), domain_(domain) {
    begin_ns_ = now_ns();
    for (int i = 0; i < count; ++i) children_.push_back(start(i));
  }
  std::unique_ptr<Child> start(int index) const {
    return std::make_unique<Child>(std::vector<std::string>{"--be", kind_, "--index", std::to_string(index),
                                                            "--count", std::to_string(count_), "--domain",
                                                            std::to_string(domain_)});
  }
  // Milliseconds until the last one is.
  Result<double> connected_ms() const {
    long long last_ns = 0;
    for (const auto& child : children_) {
      const auto line = child->hear(60.0);
      if (!line) return Error{ErrorCode::kTimeout, "a process was not connected within a minute"};
      last_ns = std::max(last_ns, std::stoll(*line));
    }
    return static_cast<double>(last_ns - begin_ns_) * 1e-6;
  }
  // The neighbours and the process itself, which has been started again.
  Result<double> again_ms(long long begin_ns) const {
    const auto own = children_.front()->hear(60.0);
    long long last_ns = own ? std::stoll(*own) : 0;
    for (const std::size_t neighbour : {std::size_t{1} % children_.size(), children_.size() - 1}) {
      children_[neighbour]->say("again");
      const auto line = children_[neighbour]->hear(60.0);
      if (!line || !own)
        return Error{ErrorCode::kTimeout, "a process was not connected again within a minute"};
    }
    return static_cast<double>(last_ns - begin_ns) * 1e-6;
  }
  std::unique_ptr<Child>& first() { return children_.front(); }
  // All end at once, not each in its turn.
  ~Swarm() {
    for (const auto& child : children_) child->kill_now();
  }
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

 private:
  const std::string kind_;
  const int count_;
  const int domain_;
  long long begin_ns_ = 0;
  std::vector<std::unique_ptr<Child>> children_;
};

// Kills one of the nodes and starts it again, and looks at that as `nido port list` does.
Status kill_and_restart(Swarm& swarm, int domain, std::vector<double>& gone_ms,
                        std::vector<double>& again_ms) {
  NodeOptions options;
  options.name = "watcher";
  options.domain = domain;
  options.hidden = true;
  options.handle_signals = false;
  auto node = Node::create(std::move(options));
  if (!node) return node.error();
  auto directory = Directory::open(**node);
  if (!directory) return directory.error();
  const std::string port = output_name(0, 0);
  const auto is_there = [&](const Directory& who) { return who.owner_of(port).has_value(); };
  if (!(*directory)->wait(is_there, 30.0)) {
    return Error{ErrorCode::kTimeout, "a port is not listed within half a minute"};
  }
  const long long killed_ns = now_ns();
  swarm.first()->kill_now();
  if (!(*directory)->wait([&](const Directory& who) { return !is_there(who); }, 60.0)) {
    return Error{ErrorCode::kTimeout, "a killed process is still listed after a minute"};
  }
  gone_ms.push_back(static_cast<double>(now_ns() - killed_ns) * 1e-6);
  const long long restarted_ns = now_ns();
  swarm.first() = swarm.start(0);
  const auto again = swarm.again_ms(restarted_ns);
  if (!again) return again.error();
  again_ms.push_back(*again);
  return {};
}

int discovery_main(int argc, char** argv) {
  Options options;
  int count = 20;
  int repeats = 3;
  int index = 0;
  std::string kind;
  CLI::App app{"Measures how soon processes find each other. Example: nido bench discovery --json"};
  options.add_to(app);
  app.add_option("--count", count, "processes")->check(CLI::Range(2, 50));
  app.add_option("--repeats", repeats, "how often")->check(CLI::Range(1, 1000));
  app.add_option("--be", kind)->group("");
  app.add_option("--index", index)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!kind.empty()) {
    live_no_longer_than_parent();
    return exit_code(kind == "nido" ? be_node(index, count, options.domain)
                                    : be_plain(index, count, options.domain));
  }
  Report report("discovery");
  std::vector<double> nido_ms;
  std::vector<double> plain_ms;
  std::vector<double> gone_ms;
  std::vector<double> again_ms;
  for (int i = 0; i < repeats; ++i) {  // in turns
    {
      Swarm swarm("nido", count, options.domain);
      const auto connected = swarm.connected_ms();
      if (!connected) return exit_code(connected.error());
      nido_ms.push_back(*connected);
      if (Status status = kill_and_restart(swarm, options.domain, gone_ms, again_ms); !status) {
        return exit_code(status);
      }
    }
    const Swarm swarm("plain", count, options.domain + 1);
    const auto connected = swarm.connected_ms();
    if (!connected) return exit_code(connected.error());
    plain_ms.push_back(*connected);
  }
  const auto add = [&](const std::string& who, const std::string& metric, const std::vector<double>& ms) {
    report.add(who, metric + "_p50", quantile(ms, 0.5), "ms", ms.size());
    report.add(who, metric + "_worst", quantile(ms, 1.0), "ms", ms.size());
  };
  add("nido", "discovery_all_connected", nido_ms);
  add("plain Fast DDS", "discovery_all_connected", plain_ms);
  add("nido", "discovery_killed_gone", gone_ms);
  add("nido", "discovery_restart_connected", again_ms);
  report.print(options.json);
  return 0;
}

}  // namespace

}  // namespace nido::bench

int main(int argc, char** argv) { return nido::bench::discovery_main(argc, argv); }
