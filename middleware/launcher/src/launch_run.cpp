#include "launch_run.h"

#include <fmt/format.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "emergency_stop.h"
#include "launch_dashboard.h"
#include "launch_recorder.h"
#include "nido/middleware/typed_port.h"

namespace nido {
namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

double seconds_of(const msgs::Time& time) { return time.sec() + time.nanosec() * 1e-9; }

// The domain that people choose for a whole shell; -1: a value that is none.
int domain_of_environment() {
  for (const char* name : {"NIDO_DOMAIN", "ROS_DOMAIN_ID"}) {
    const char* text = std::getenv(name);
    if (text == nullptr || *text == '\0') continue;
    char* end = nullptr;
    const long domain = std::strtol(text, &end, 10);
    return *end == '\0' && domain >= 0 && domain <= 101 ? static_cast<int>(domain) : -1;
  }
  return 0;
}

bool mentions(const YAML::Node& node, const std::string& word) {
  if (node.IsScalar()) return node.Scalar().find(word) != std::string::npos;
  if (!node.IsSequence() && !node.IsMap()) return false;
  return std::any_of(node.begin(), node.end(), [&](const auto& item) {
    return mentions(node.IsMap() ? YAML::Node(item.second) : YAML::Node(item), word);
  });
}

// lines of the story that are kept for those that come later
constexpr std::size_t kStoryKept = 200;

}  // namespace

std::string shown_path(const fs::path& path) {
  std::error_code error;
  const fs::path relative = fs::relative(path, error);
  return error || relative.empty() || relative.string().starts_with("..") ? path.string() : relative.string();
}

LaunchRun::LaunchRun(const LaunchRequest& request, const App& app, const Places& places, int signal_fd)
    : request_(request),
      app_(app),
      places_(places),
      signal_fd_(signal_fd),
      paint_(request.json ? STDERR_FILENO : STDOUT_FILENO) {}

LaunchRun::~LaunchRun() = default;

void LaunchRun::print(const std::string& line) const {
  // with --json stdout belongs to the object
  std::FILE* stream = request_.json ? stderr : stdout;
  fmt::print(stream, "{}\n", line);
  std::fflush(stream);
}

double LaunchRun::wall_s() const {
  return std::chrono::duration<double>(SteadyClock::now() - wall_start_).count();
}

double LaunchRun::sim_s() const { return node_ ? node_->now().seconds() : 0; }

bool LaunchRun::uses(const std::string& reference) const {
  return std::any_of(app_.processes.begin(), app_.processes.end(), [&](const AppProcess& process) {
    return mentions(process.parameters, "${" + reference + "}");
  });
}

const AppProcess& LaunchRun::process_named(const std::string& name) const {
  return *std::find_if(app_.processes.begin(), app_.processes.end(),
                       [&](const AppProcess& process) { return process.name == name; });
}

std::string LaunchRun::log_name(const std::string& process) const {
  return shown_path(folder_.path / "logs" / (process + ".log"));
}

// Everything that can be refused before anything is started.
Status LaunchRun::prepare() {
  settings_.domain = app_.domain >= 0 ? app_.domain : domain_of_environment();
  if (settings_.domain < 0) {
    return Error{ErrorCode::kInvalidArgument, "ROS_DOMAIN_ID or NIDO_DOMAIN is no number from 0 to 101"};
  }
  if (uses("robot_file")) {
    auto robot = find_config(places_, "robots", "robot", app_.robot);
    if (!robot) return robot.error();
    settings_.robot_file = *robot;
  }
  if (uses("world_file")) {
    auto world = find_config(places_, "worlds", "world", app_.world);
    if (!world) return world.error();
    settings_.world_file = *world;
  }
  for (const auto& process : app_.processes) {
    const bool is_path = process.program.find('/') != std::string::npos;
    const fs::path program = is_path ? fs::absolute(process.program) : places_.programs / process.program;
    if (access(program.c_str(), X_OK) != 0) {
      return Error{
          ErrorCode::kNotFound,
          fmt::format("process '{}' of app '{}' needs the program {}, which is not there: is it built?",
                      process.name, app_.name, program.string())};
    }
    programs_[process.name] = program.string();
  }
  auto folder = make_run_folder(app_, request_.out);
  if (!folder) return folder.error();
  folder_ = *folder;
  return {};
}

Status LaunchRun::join() {
  // first the processes without threads, then the middleware, which makes some
  auto supervisor = Supervisor::create((places_.programs / "nido-janitor").string());
  if (!supervisor) return supervisor.error();
  supervisor_ = std::move(*supervisor);

  NodeOptions options;
  options.name = "launcher";
  options.domain = settings_.domain;
  const bool has_clock = std::any_of(app_.processes.begin(), app_.processes.end(),
                                     [](const AppProcess& process) { return process.clock == "owner"; });
  options.clock = has_clock ? ClockMode::kSimulated : ClockMode::kWall;
  options.handle_signals = false;
  auto node = Node::create(options);
  if (!node) {
    if (node.error().code != ErrorCode::kTaken) return node.error();
    return Error{ErrorCode::kTaken,
                 fmt::format("{}; another run lives in domain {}: stop it, or give this one a domain of "
                             "its own, as in --domain {}",
                             node.error().message, settings_.domain, settings_.domain + 1)};
  }
  node_ = std::move(*node);
  auto directory = Directory::open(*node_);
  if (!directory) return directory.error();
  directory_ = std::move(*directory);
  const auto listen = [this](const std::string& port, const std::string& own,
                             std::unique_ptr<Input<msgs::StageEvent>>& input) -> Status {
    if (port.empty()) return {};
    auto opened = node_->open_input<msgs::StageEvent>(own, Profile::kEvent, 256);
    if (!opened) return opened.error();
    input = std::move(*opened);
    return input->connect(port);
  };
  if (auto status = listen(app_.story, "/launcher/story:i", story_); !status) return status;
  if (auto status = listen(app_.outcome, "/launcher/outcome:i", outcome_); !status) return status;
  auto service =
      node_->open_service("/launcher/rpc:i", [this](const std::string& line) { return answer(line); });
  if (!service) return service.error();
  service_ = std::move(*service);
  node_->set_ready();
  return {};
}

Status LaunchRun::start(const AppProcess& process) {
  auto file = write_node_file(app_, process, settings_, places_, folder_);
  if (!file) return file.error();
  SupervisedProcess supervised;
  supervised.name = process.name;
  supervised.command.program = programs_[process.name];
  supervised.command.arguments = {"--node", file->string()};
  supervised.command.environment = process.environment;
  supervised.log_file = (folder_.path / "logs" / (process.name + ".log")).string();
  supervised.restart = process.restart;
  // a simulator begins at time 0 again, and those that it had left in lockstep cannot go back
  if (process.clock == "owner" && app_.lockstep) supervised.restart.on_failure = false;
  if (auto status = supervisor_->start(supervised); !status) return status;
  started_.insert(process.name);
  ready_deadline_[process.name] =
      SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(
                               std::chrono::duration<double>(process.ready_timeout_s));
  return {};
}

// Starts the processes whose predecessors are ready.
Status LaunchRun::start_due() {
  for (const std::size_t index : app_.start_order) {
    const AppProcess& process = app_.processes[index];
    if (started_.contains(process.name)) continue;
    const bool due = std::all_of(process.depends_on.begin(), process.depends_on.end(),
                                 [this](const std::string& other) { return ready_.contains(other); });
    if (!due) continue;
    if (auto status = start(process); !status) return status;
  }
  return {};
}

int LaunchRun::run() {
  Status status = prepare();
  if (status) {
    print(fmt::format("{}: {}", paint_.bold(app_.name), app_.summary));
    print(paint_.dim(fmt::format("  robot {}, world {}, seed {}, rate {}{}, domain {}; writes {}", app_.robot,
                                 app_.world, app_.seed, app_.rate, app_.lockstep ? " in lockstep" : "",
                                 settings_.domain, shown_path(folder_.path))));
    if (!request_.dashboard.empty()) {
      print(paint_.dim(fmt::format("  watch and drive it at http://127.0.0.1:{}/",
                                   process_named(kDashboard).parameters["port"].as<int>())));
    }
    if (keys_.are_there()) print(paint_.dim("  the space bar is the emergency stop"));
    status = join();
  }
  if (!status) {
    return print_error(status.error(), request_.json);
  }
  while (!end_) {
    if (auto started = start_due(); !started) {
      end(exit_code_of(started.error()), started.error().message);
      break;
    }
    step();
  }
  shut_down();
  std::vector<std::pair<std::string, int>> restarts;
  for (const auto& process : app_.processes) {
    restarts.emplace_back(process.name, supervisor_->restarts_of(process.name));
  }
  finish_report(folder_.path, restarts, wall_s());
  const double sim = sim_s();
  const double wall = wall_s();
  service_.reset();
  story_.reset();
  outcome_.reset();
  directory_.reset();
  node_.reset();
  supervisor_.reset();

  const std::string verdict = end_->exit_code == 0     ? paint_.green("success")
                              : end_->exit_code == 130 ? paint_.yellow("stopped")
                                                       : paint_.red("failure");
  print(paint_.dim(fmt::format("  {:.1f} s simulated in {:.1f} s; {}", sim, wall, shown_path(folder_.path))));
  // the last line of a run is its outcome: scripts read it with tail -1
  print(fmt::format("{}: {} {}", paint_.bold("outcome"), verdict + ":", end_->sentence));
  if (request_.json) {
    fmt::print("{}\n", nlohmann::json{{"exit_code", end_->exit_code},
                                      {"sentence", end_->sentence},
                                      {"sim_s", sim},
                                      {"wall_s", wall},
                                      {"out", folder_.path.string()}}
                           .dump());
  }
  return end_->exit_code;
}

void LaunchRun::end(int exit_code, const std::string& sentence) {
  if (!end_) end_ = RunEnd{exit_code, sentence};
}

void LaunchRun::step() {
  for (const auto& event : supervisor_->poll(milliseconds(20), signal_fd_)) on_event(event);
  tell_story();
  look_at_nodes();
  look_at_limits();
  take_keys();
  take_signals();
  tell_status(false);
}

void LaunchRun::take_signals() {
  {
    const std::lock_guard lock(mutex_);
    if (!stop_asked_.empty() && !stopping_) end(130, "stopped " + stop_asked_);
  }
  signalfd_siginfo info{};
  while (read(signal_fd_, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    if (stopping_) {
      supervisor_->kill_all();
    } else {
      print(paint_.yellow("stopping; once more kills at once"));
      end(130,
          fmt::format("stopped by {}",
                      info.ssi_signo == SIGINT ? "Ctrl-C" : strsignal(static_cast<int>(info.ssi_signo))));
    }
  }
}

void LaunchRun::take_keys() {
  bool is_asked = false;
  while (const auto key = keys_.take()) is_asked = is_asked || *key == ' ';
  if (!is_asked) return;
  const auto answers = stop_robots(*node_, *directory_, "the space bar in the launcher");
  for (const auto& [robot, error] : answers) {
    print(paint_.red(
        error.empty()
            ? fmt::format("emergency stop: '{0}' takes no command until 'nido node call {0} estop clear'",
                          robot)
            : fmt::format("emergency stop: '{}' does not answer: {}", robot, error)));
  }
  if (answers.empty()) print(paint_.red("emergency stop: no robot is there"));
}

void LaunchRun::on_event(const SupervisorEvent& event) {
  using Kind = SupervisorEvent::Kind;
  if (event.kind == Kind::kEnded || event.kind == Kind::kGivenUp) last_words_[event.name] = event.text;
  switch (event.kind) {
    case Kind::kOutput:
      if (request_.verbose) {
        print(paint_.dim(fmt::format("{:>14} | ", event.name)) + event.text);
      } else if (event.text.find("] error: ") != std::string::npos) {
        print(paint_.red(event.text));
      }
      return;
    case Kind::kRestarting:
      print(paint_.yellow(event.text));
      for (const auto& line : event.last_lines) print(paint_.dim("    " + line));
      ready_.erase(event.name);
      ready_deadline_.erase(event.name);
      return;
    case Kind::kRestarted: {
      const AppProcess& process = process_named(event.name);
      ready_deadline_[event.name] =
          SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(
                                   std::chrono::duration<double>(process.ready_timeout_s));
      return;
    }
    case Kind::kEnded:
    case Kind::kGivenUp:
      on_death(event);
      return;
  }
}

void LaunchRun::on_death(const SupervisorEvent& event) {
  if (end_) return;
  const AppProcess& process = process_named(event.name);
  const bool was_ready = ready_.erase(event.name) > 0;
  ready_deadline_.erase(event.name);
  // the one that announces the outcome may end when it has written it
  if (was_ready && event.exit.clean() && outcome_) {
    if (outcome_in_report(folder_.path)) {
      report_deadline_ = SteadyClock::now() + std::chrono::seconds(1);
      return;
    }
  }
  // what it said itself goes before what we see from outside
  std::string reason = event.text;
  if (const auto node = directory_->node(event.name);
      node && node->state == "failed" && !node->detail.empty()) {
    reason = fmt::format("process '{}' failed: {}", event.name, node->detail);
  }
  for (auto line = event.last_lines.rbegin(); line != event.last_lines.rend() && reason == event.text;
       ++line) {
    const std::size_t at = line->find("] error: ");
    if (at != std::string::npos)
      reason = fmt::format("process '{}' failed: {}", event.name, line->substr(at + 9));
  }
  if (!was_ready) {
    reason += reason == event.text ? ", before it was ready" : " (before it was ready)";
  } else if (process.clock == "owner" && app_.lockstep) {
    reason += "; it drove the clock that all others wait for, so the run cannot go on";
  }
  print(paint_.red(reason));
  for (const auto& line : event.last_lines) print(paint_.dim("    " + line));
  print(paint_.dim("    (all of it: " + log_name(event.name) + ")"));
  if (event.kind == SupervisorEvent::Kind::kGivenUp && !process.restart.fail_the_run) {
    print(paint_.yellow(fmt::format("the run goes on without '{}'", event.name)));
    return;
  }
  // wrong settings and missing things keep their exit code
  const bool before_ready =
      !was_ready && !event.exit.by_signal && (event.exit.code == 2 || event.exit.code == 3);
  end(before_ready ? event.exit.code : 1, reason);
}

void LaunchRun::look_at_nodes() {
  if (end_ || ready_deadline_.empty()) return;
  const auto waiting = ready_deadline_;
  for (const auto& [name, deadline] : waiting) {
    const auto node = directory_->node(name);
    const bool is_ours = node && static_cast<pid_t>(node->pid) == supervisor_->pid_of(name);
    if (is_ours && node->state == "ready") {
      ready_.insert(name);
      ready_deadline_.erase(name);
      if (all_ready_) print(paint_.yellow(fmt::format("process '{}' is ready again", name)));
    } else if (is_ours && node->state == "failed") {
      // its end, with its last lines, is about to be seen; it must not hang for that
      ready_deadline_[name] = std::min(deadline, SteadyClock::now() + std::chrono::seconds(2));
    }
    if (SteadyClock::now() > deadline) {
      print(paint_.red(fmt::format("process '{}' is not ready", name)));
      for (const auto& line : supervisor_->last_lines(name)) print(paint_.dim("    " + line));
      print(paint_.dim("    (all of it: " + log_name(name) + ")"));
      end(1, is_ours && node->state == "failed"
                 ? fmt::format("process '{}' failed: {}", name, node->detail)
                 : fmt::format("process '{}' was not ready within {} s ({})", name,
                               process_named(name).ready_timeout_s,
                               is_ours ? "it says: " + node->state
                                       : "it has not joined domain " + std::to_string(settings_.domain)));
      return;
    }
  }
  if (!all_ready_ && ready_.size() == app_.processes.size()) {
    all_ready_ = true;
    print(paint_.dim(fmt::format("  {} processes are ready after {:.1f} s", ready_.size(), wall_s())));
  }
}

void LaunchRun::tell_story() {
  while (story_) {
    const auto event = story_->take();
    if (!event) break;
    const std::string line =
        fmt::format("{:8.2f} s  {:<9}", seconds_of(event->header().stamp()), event->stage());
    const nlohmann::json told = {{"t", seconds_of(event->header().stamp())},
                                 {"stage", event->stage()},
                                 {"state", event->state()},
                                 {"object", event->object()},
                                 {"text", event->text()}};
    told_.push_back(told.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    if (told_.size() > kStoryKept) told_.erase(told_.begin());
    std::string text = event->text();
    if (text.empty()) text = fmt::format("{} {}", event->state(), event->object());
    if (event->state() == "failed") {
      print(line + paint_.red(text));
    } else if (event->state() == "done") {
      print(line + paint_.green(text));
    } else {
      print(line + text);
    }
  }
  while (outcome_ && !end_) {
    const auto event = outcome_->take();
    if (!event) break;
    if (event->stage() != "outcome") continue;
    end(event->state() == "done" ? 0 : 1, event->text());
  }
}

void LaunchRun::look_at_limits() {
  if (end_) return;
  // a report without its announcement: the message was lost, or the judge died after writing
  std::error_code ignored;
  if (outcome_ && !report_deadline_ && fs::exists(folder_.path / "report.json", ignored) &&
      outcome_in_report(folder_.path)) {
    report_deadline_ = SteadyClock::now() + std::chrono::seconds(3);
  }
  if (report_deadline_ && SteadyClock::now() > *report_deadline_) {
    if (const auto written = outcome_in_report(folder_.path)) end(written->exit_code, written->sentence);
  } else if (app_.for_s > 0 && sim_s() >= app_.for_s) {
    if (outcome_) {
      end(1, fmt::format("no outcome within {} s of simulated time (--for)", app_.for_s));
    } else {
      end(0, fmt::format("ran for {} s of simulated time", app_.for_s));
    }
  } else if (wall_s() > app_.wall_limit_s) {
    end(1, fmt::format("no outcome within {} s (wall_limit_s)", app_.wall_limit_s));
  }
}

// A run is as good as it was; a success that was recorded with gaps is none.
void LaunchRun::look_at_recording(const SupervisorEvent& event) {
  if (event.name != kRecorder || event.exit.clean()) return;
  std::string reason = event.text;
  for (const auto& line : event.last_lines) {
    const std::size_t at = line.find("] error: ");
    if (at != std::string::npos) reason = line.substr(at + 9);
  }
  print(paint_.red(fmt::format("{}: {}", shown_path(request_.record), reason)));
  if (end_ && end_->exit_code == 0) {
    end_->exit_code = 1;
    end_->sentence += ", but " + reason;
  }
}

void LaunchRun::shut_down() {
  stopping_ = true;
  tell_status(true);
  supervisor_->begin_stop();
  while (!supervisor_->all_gone()) {
    for (const auto& event : supervisor_->poll(milliseconds(50), signal_fd_)) {
      if (event.kind == SupervisorEvent::Kind::kOutput) on_event(event);
      if (event.kind == SupervisorEvent::Kind::kEnded) look_at_recording(event);
    }
    take_signals();
    // what was said last may arrive after the outcome
    tell_story();
    tell_status(false);
  }
  for (const auto& name : supervisor_->killed()) {
    print(paint_.yellow(fmt::format("process '{}' did not end when asked and was killed", name)));
  }
}

int run_launch(const LaunchRequest& request) {
  const auto refuse = [&](const Error& error) { return print_error(error, request.json); };
  auto places = find_places();
  if (!places) return refuse(places.error());
  auto file = find_config(*places, "apps", "app", request.app);
  if (!file) return refuse(file.error());
  auto app = load_app(file->string(), request.options, request.sets);
  if (!app) return refuse(app.error());
  if (request.dump) {
    fmt::print("{}", dump_app(*app));
    return 0;
  }
  if (!request.record.empty()) {
    if (auto status = add_recorder(*app, request.record); !status) return refuse(status.error());
  }
  if (!request.dashboard.empty()) {
    if (auto status = add_dashboard(*app, request.dashboard); !status) return refuse(status.error());
  }
  if (app->audio["source"].as<std::string>() == "wav") {
    const std::string sound = app->audio["file"].as<std::string>();
    std::error_code error;
    if (!fs::is_regular_file(sound, error))
      return refuse({ErrorCode::kNotFound, fmt::format("there is no sound file {}", sound)});
    // the robot process may have another current folder
    app->audio["file"] = fs::canonical(sound).string();
  }
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, number);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  const int signal_fd = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  const int code = LaunchRun(request, *app, *places, signal_fd).run();
  close(signal_fd);
  return code;
}

}  // namespace nido
