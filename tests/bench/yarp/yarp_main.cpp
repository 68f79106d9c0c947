// nido-bench-yarp: round trips and pictures through the gateway, beside YARP's own programs (docs/bench.md).

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench_options.h"
#include "child.h"
#include "nido/gateway/gateway.h"
#include "nido/middleware/image_port.h"
#include "nido/middleware/node.h"
#include "report.h"
#include "yarp_line.h"

namespace nido::bench {
namespace {

constexpr std::uint32_t kWidth = 640;
constexpr std::uint32_t kHeight = 480;
constexpr double kTurn_s = 1.0;
constexpr int kTripsATurn = 250;

// what a control board answers, and what YARP's rpcserver is told to
constexpr const char* kAnswer = "[is] enc 12.5 [tsta] 7 1.25 [ok]";

struct YarpOptions : Options {
  std::string prefix;  // of a YARP installation; empty: where `yarp` is found
  std::string role;    // of a child
  int turns = 5;
};

Result<std::unique_ptr<Node>> make_node(const std::string& name, int domain) {
  NodeOptions options;
  options.name = name;
  options.domain = domain;
  return Node::create(options);
}

// a robot's process: a service, and pictures as fast as they go
Status be_robot(int domain) {
  auto node = make_node("bench_robot", domain);
  if (!node) return node.error();
  auto service =
      (*node)->open_service("/bench/rpc:i", [](const std::string&) { return std::string(kAnswer); });
  if (!service) return service.error();
  auto pictures = ImageOutput::open(**node, "/bench/image:o");
  if (!pictures) return pictures.error();
  const ImageFormat format{kWidth, kHeight, kWidth * 3, "rgb8", "eye"};
  tell_parent("ready");
  end_with_parent();
  for (std::uint8_t shade = 0;; ++shade) {
    if (!(*pictures)->port().wait_for_readers(1, 0.05)) continue;
    auto place = (*pictures)->begin(format, (*node)->now());
    if (!place) return place.error();
    std::fill(place->begin(), place->end(), shade);
    if (Status sent = (*pictures)->send(); !sent) return sent;
  }
}

Status be_gateway(int domain) {
  auto node = make_node("bench_gateway", domain);
  if (!node) return node.error();
  auto loop = yarp::EventLoop::create();
  if (!loop) return loop.error();
  gateway::GatewayOptions options;
  options.register_if_taken = false;
  for (int tried = 0; tried < 20; ++tried) {
    options.ports.names_port = 21'000 + (static_cast<int>(getpid()) * 13 + tried * 607) % 20'000;
    auto gateway = gateway::Gateway::open(**node, **loop, options);
    if (!gateway) continue;
    tell_parent("names " + std::to_string(options.ports.names_port));
    end_with_parent();
    (*loop)->run();
    return {};
  }
  return Error{ErrorCode::kTaken, "no port number is free"};
}

// A command of the shell and what it starts, ended together.
class ShellJob {
 public:
  explicit ShellJob(const std::string& command) : pid_(fork()) {
    if (pid_ != 0) return;
    setpgid(0, 0);
    const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, fd);
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  ~ShellJob() {
    if (pid_ <= 0) return;
    kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  ShellJob(const ShellJob&) = delete;
  ShellJob& operator=(const ShellJob&) = delete;

 private:
  pid_t pid_;
};

// YARP's own programs, with names from the gateway.
class Baseline {
 public:
  Baseline(const std::string& prefix, int names_port)
      : home_(std::filesystem::temp_directory_path() / ("nido-bench-yarp-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(home_);
    std::ofstream(home_ / "yarp.conf") << "127.0.0.1 " << names_port << " yarp\n";
    std::string environment = "export YARP_CONFIG_HOME=" + home_.string() + "; ";
    if (!prefix.empty()) {
      environment += "export PATH='" + prefix + "/bin':$PATH LD_LIBRARY_PATH='" + prefix +
                     "/lib' YARP_DATA_DIRS='" + prefix + "/share/yarp'; ";
    }
    server_ =
        std::make_unique<ShellJob>(environment + "yes '" + kAnswer + "' | yarp rpcserver /bench/yarp/rpc");
    camera_ = std::make_unique<ShellJob>(
        environment +
        "exec yarpdev --device deviceBundler --wrapper_device frameGrabber_nws_yarp "
        "--attached_device fakeFrameGrabber --name /bench/yarp/cam --freq 100000 --period 0.0001 "
        "--width 640 --height 480 --mode none");
  }
  ~Baseline() {
    server_.reset();
    camera_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(home_, ignored);
  }
  Baseline(const Baseline&) = delete;
  Baseline& operator=(const Baseline&) = delete;

 private:
  std::filesystem::path home_;
  std::unique_ptr<ShellJob> server_;
  std::unique_ptr<ShellJob> camera_;
};

Result<YarpLine> open_patiently(int names_port, const std::string& port, yarp::Carrier carrier) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  for (;;) {
    Result<YarpLine> line = YarpLine::open(names_port, port, carrier);
    if (line || std::chrono::steady_clock::now() > end) return line;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

// One of the two that are compared.
struct Contender {
  std::string who;
  std::string rpc;     // name of a port
  std::string camera;  // name of a port
  std::vector<double> trips_us{};
  std::vector<double> turns_us{};  // median of each turn
  std::vector<double> pictures_s{};
};

Status ask_for_a_turn(YarpLine& line, Contender& contender) {
  const std::string question = yarp::message(
      yarp::Carrier::kTcp,
      yarp::encode({yarp::Value::word("get"), yarp::Value::word("enc"), yarp::Value::of(std::int64_t{3})},
                   yarp::Dialect::k3),
      {}, true);
  std::vector<double> turn_us;
  for (int i = 0; i < kTripsATurn; ++i) {
    const long long asked_ns = now_ns();
    if (!line.ask(question)) return Error{ErrorCode::kTimeout, contender.who + ": no answer"};
    turn_us.push_back(static_cast<double>(now_ns() - asked_ns) * 1e-3);
  }
  contender.turns_us.push_back(quantile(turn_us, 0.5));
  contender.trips_us.insert(contender.trips_us.end(), turn_us.begin(), turn_us.end());
  return {};
}

Status look_for_a_turn(int names_port, Contender& contender) {
  Result<YarpLine> line = open_patiently(names_port, contender.camera, yarp::Carrier::kFastTcp);
  if (!line) return line.error();
  if (!line->reverse() || line->take() == 0) {
    return Error{ErrorCode::kTimeout, contender.who + ": no picture came"};
  }
  const long long begun_ns = now_ns();
  double elapsed_s = 0;
  int pictures = 0;
  for (; elapsed_s < kTurn_s; ++pictures) {
    if (line->take() == 0) return Error{ErrorCode::kTimeout, contender.who + ": pictures ended"};
    elapsed_s = static_cast<double>(now_ns() - begun_ns) * 1e-9;
  }
  contender.pictures_s.push_back(pictures / elapsed_s);
  return {};
}

Status measure(const YarpOptions& options, Report& report) {
  const std::string domain = std::to_string(options.domain);
  Child robot({"--role", "robot", "--domain", domain});
  Child gateway({"--role", "gateway", "--domain", domain});
  // between lines of its log
  std::optional<std::string> told = gateway.hear(20);
  while (told && !told->starts_with("names ")) told = gateway.hear(20);
  if (!told || !robot.hear(20)) return Error{ErrorCode::kTimeout, "the gateway did not start"};
  const int names_port = std::stoi(told->substr(6));

  std::vector<Contender> contenders = {{"nido's gateway", "/bench/rpc:i", "/bench/image:o"}};
  std::vector<YarpLine> lines;
  Result<YarpLine> own = open_patiently(names_port, contenders[0].rpc, yarp::Carrier::kTcp);
  if (!own) return own.error();
  lines.push_back(std::move(*own));
  const std::string which = options.prefix.empty() ? "command -v yarp yarpdev > /dev/null"
                                                   : "test -x '" + options.prefix + "/bin/yarp' -a -x '" +
                                                         options.prefix + "/bin/yarpdev'";
  std::optional<Baseline> baseline;
  if (std::system(which.c_str()) == 0) {
    baseline.emplace(options.prefix, names_port);
    Result<YarpLine> line = open_patiently(names_port, "/bench/yarp/rpc", yarp::Carrier::kTcp);
    if (!line) return line.error();
    lines.push_back(std::move(*line));
    contenders.push_back({"YARP's own programs", "/bench/yarp/rpc", "/bench/yarp/cam"});
  } else {
    report.leave_out(
        "YARP's own programs",
        "no yarp and yarpdev there; --yarp PREFIX says where. Published figures of YARP 3.12: 76 to "
        "118 us p50 a round trip of RPC over tcp, 1932 to 2168 pictures a second over fast_tcp");
  }
  for (int turn = -1; turn < options.turns; ++turn) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (Status asked = ask_for_a_turn(lines[i], contenders[i]); !asked) return asked;
    }
    for (Contender& contender : contenders) {
      if (Status looked = look_for_a_turn(names_port, contender); !looked) return looked;
    }
    if (turn >= 0) continue;
    for (Contender& contender : contenders) contender = {contender.who, contender.rpc, contender.camera};
  }
  for (const Contender& contender : contenders) {
    report.add_quantiles(contender.who, "rpc", contender.trips_us, "us");
    report.add(contender.who, "pictures", quantile(contender.pictures_s, 0.5), "1/s",
               contender.pictures_s.size());
  }
  if (contenders.size() < 2) return {};
  std::vector<double> slower;
  std::vector<double> fewer;
  for (std::size_t i = 0; i < contenders[0].turns_us.size(); ++i) {
    slower.push_back(contenders[0].turns_us[i] / contenders[1].turns_us[i]);
    fewer.push_back(contenders[1].pictures_s[i] / contenders[0].pictures_s[i]);
  }
  report.add("gateway to YARP", "rpc_p50_ratio", quantile(slower, 0.5), "1", slower.size());
  report.add("gateway to YARP", "picture_time_ratio", quantile(fewer, 0.5), "1", fewer.size());
  return {};
}

int run(int argc, char** argv) {
  YarpOptions options;
  CLI::App app{"Round trips and pictures through the gateway, beside YARP's own programs.",
               "nido bench yarp"};
  options.add_to(app);
  app.add_option("--yarp", options.prefix, "folder of a YARP 3 installation: PREFIX/bin/yarp")
      ->type_name("PREFIX");
  app.add_option("--turns", options.turns, "turns of a second of pictures and 250 round trips each")
      ->check(CLI::Range(1, 1000))
      ->type_name("N");
  app.add_option("--role", options.role, "")->group("");
  CLI11_PARSE(app, argc, argv);
  if (!options.role.empty()) {
    live_no_longer_than_parent();
    return exit_code(options.role == "robot" ? be_robot(options.domain) : be_gateway(options.domain));
  }
  Report report("yarp");
  const Status measured = measure(options, report);
  if (measured) report.print(options.json);
  return exit_code(measured);
}

}  // namespace
}  // namespace nido::bench

int main(int argc, char** argv) { return nido::bench::run(argc, argv); }
