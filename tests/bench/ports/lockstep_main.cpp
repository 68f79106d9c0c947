// nido-bench-lockstep: what a tick of the lockstep costs with so many nodes, beside a bare barrier of as many
// processes over Unix sockets (docs/bench.md).
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "bench_options.h"
#include "child.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "report.h"

namespace nido::bench {

namespace {

Result<std::unique_ptr<Node>> make_node(const std::string& name, int domain, const std::string& members) {
  NodeOptions options;
  options.name = name;
  options.domain = domain;
  options.clock = ClockMode::kLockstep;
  options.handle_signals = false;
  options.connections = {{"/owner/state:o", "/" + name + "/state:i"}};
  if (!members.empty()) options.parameters["lockstep"]["nodes"] = YAML::Load("[" + members + "]");
  return Node::create(std::move(options));
}

// Takes what the owner wrote and writes something itself, every tick.
Status be_member(const std::string& name, int domain) {
  auto node = make_node(name, domain, "");
  if (!node) return node.error();
  auto in = (*node)->open_input<msgs::String>("/" + name + "/state:i", Profile::kState);
  auto out = (*node)->open_output<msgs::String>("/" + name + "/command:o", Profile::kCommand);
  if (!in || !out) return Error{ErrorCode::kFailed, "no ports"};
  std::thread end([&node] {
    while (hear_parent()) {
    }
    (*node)->stop();
  });
  (*node)->set_ready();
  auto status = (*node)->run([&](Time) -> Status {
    auto state = (*in)->take_latest();
    return state ? (*out)->write(*state) : Status();
  });
  end.join();
  return status;
}

// A process that answers a byte with a byte; its standard input is the socket.
int be_bare(int fd) {
  char byte = 0;
  while (recv(fd, &byte, 1, 0) == 1 && send(fd, &byte, 1, MSG_NOSIGNAL) == 1) {
  }
  return 0;
}

class BareBarrier {
 public:
  explicit BareBarrier(int members) {
    for (int i = 0; i < members; ++i) {
      int ends[2];
      if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) continue;  // the other end is inherited
      fds_.push_back(ends[0]);
      children_.push_back(
          std::make_unique<Child>(std::vector<std::string>{"--bare", std::to_string(ends[1])}));
      close(ends[1]);
    }
  }
  ~BareBarrier() {
    for (const int fd : fds_) {
      shutdown(fd, SHUT_RDWR);
      close(fd);
    }
  }
  BareBarrier(const BareBarrier&) = delete;
  BareBarrier& operator=(const BareBarrier&) = delete;
  void round() const {
    char byte = 1;
    for (const int fd : fds_) send(fd, &byte, 1, MSG_NOSIGNAL);
    for (const int fd : fds_) recv(fd, &byte, 1, 0);
  }

 private:
  std::vector<int> fds_;
  std::vector<std::unique_ptr<Child>> children_;
};

Status measure(int members, int rounds, int domain, Report& report) {
  std::string names;
  std::vector<std::unique_ptr<Child>> children;
  for (int i = 0; i < members; ++i) {
    const std::string name = "member" + std::to_string(i);
    names += (i == 0 ? "" : ", ") + name;
    children.push_back(std::make_unique<Child>(
        std::vector<std::string>{"--member", name, "--domain", std::to_string(domain)}));
  }
  auto node = make_node("owner", domain, names);
  if (!node) return node.error();
  auto out = (*node)->open_output<msgs::String>("/owner/state:o", Profile::kState);
  auto in = (*node)->open_input<msgs::String>("/owner/command:i", Profile::kCommand, 1000);
  if (!out || !in) return Error{ErrorCode::kFailed, "no ports"};
  for (int i = 0; i < members; ++i) {
    if (auto status = (*in)->connect("/member" + std::to_string(i) + "/command:o"); !status) return status;
  }
  msgs::String message;
  message.data(std::string(64, 'x'));
  std::int64_t tick = 0;
  const auto tick_once = [&]() -> Status {
    if (auto status = (*out)->write(message); !status) return status;
    if (auto status = (*node)->publish_clock(Time{++tick * 10'000'000}); !status) return status;
    while ((*in)->take()) {
    }
    return {};
  };
  const BareBarrier bare(members);
  std::vector<double> own_us;
  std::vector<double> bare_us;
  std::vector<double> ratios;
  constexpr int kBatch = 50;
  for (int round = -1; round < rounds; ++round) {
    std::vector<double> own_turn_us;
    std::vector<double> bare_turn_us;
    for (int i = 0; i < kBatch; ++i) {
      const long long begin_ns = now_ns();
      if (auto status = tick_once(); !status) return status;
      own_turn_us.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-3);
    }
    for (int i = 0; i < kBatch; ++i) {
      const long long begin_ns = now_ns();
      bare.round();
      bare_turn_us.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-3);
    }
    if (round < 0) continue;
    ratios.push_back(quantile(own_turn_us, 0.5) / quantile(bare_turn_us, 0.5));
    own_us.insert(own_us.end(), own_turn_us.begin(), own_turn_us.end());
    bare_us.insert(bare_us.end(), bare_turn_us.begin(), bare_turn_us.end());
  }
  const std::string metric = "lockstep_" + std::to_string(members) + "_nodes";
  report.add_quantiles("nido", metric, own_us, "us");
  report.add_quantiles("bare barrier", metric, bare_us, "us");
  report.add("nido to bare barrier", metric + "_p50_ratio", quantile(ratios, 0.5), "1", ratios.size());
  return {};
}

int lockstep_main(int argc, char** argv) {
  Options options;
  int rounds = 10;
  std::vector<int> members = {1, 2, 4, 6};
  std::string member;
  int bare = -1;
  CLI::App app{"Measures a tick of the lockstep. Example: nido bench lockstep --json"};
  options.add_to(app);
  app.add_option("--rounds", rounds, "turns of 50 ticks")->check(CLI::Range(1, 100000));
  app.add_option("--nodes", members, "how many nodes take part, beside the owner")->delimiter(',');
  app.add_option("--member", member)->group("");
  app.add_option("--bare", bare)->group("");
  CLI11_PARSE(app, argc, argv);
  if (bare >= 0) {
    live_no_longer_than_parent();
    return be_bare(bare);
  }
  if (!member.empty()) {
    live_no_longer_than_parent();
    return exit_code(be_member(member, options.domain));
  }
  Report report("lockstep");
  for (const int count : members) {
    if (Status status = measure(count, rounds, options.domain, report); !status) return exit_code(status);
  }
  report.print(options.json);
  return 0;
}

}  // namespace

}  // namespace nido::bench

int main(int argc, char** argv) { return nido::bench::lockstep_main(argc, argv); }
