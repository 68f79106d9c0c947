// nido-experiment-speech-and-action: runs the whole system again and again, with other seeds and phrases, and
// reports how often it did what it was told (the paper's Section IV, Fig. 19).

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "nido/experiment/domain.h"
#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"
#include "nido/speech/phrases.h"

extern char** environ;

namespace nido {
namespace {

namespace fs = std::filesystem;

struct Request : ExperimentRequest {
  std::vector<std::string> say = {"all"};
  std::string app = "speech_and_action";
  std::string world = "random_table";
  std::string robot;
  std::vector<std::string> app_set;  // KEY=VALUE, for the app
  bool fresh = false;                // forget the trials of an earlier run
  int domain = kFreeDomain;          // of the first job
  double limit_s = 600.0;            // of wall time for one trial
};

// stages in their order, and whether a verb has them
const std::vector<std::pair<std::string, int>>& stages() {
  static const std::vector<std::pair<std::string, int>> list = {
      {"heard", 0},   {"chosen", 0},  {"seen", 0},   {"reached", 1},
      {"grasped", 2}, {"carried", 3}, {"dropped", 3}};
  return list;
}

struct Trial {
  int number = 0;
  std::uint64_t seed = 0;
  std::string phrase;
  fs::path folder;
  // filled in when it is over
  bool success = false;
  std::string stage;
  std::string sentence;
  std::map<std::string, double> metrics;
  double wall_s = 0.0;
  double sim_s = 0.0;
};

// A running trial.
struct Running {
  pid_t child = 0;
  Trial trial;
  int domain = 0;
  std::chrono::steady_clock::time_point started;
  bool told_to_stop = false;
};

// What a trial is known by, so that one of an earlier run is used again only if it was the same.
std::string fingerprint(const Request& request, const Trial& trial) {
  return fmt::format("seed {}\nphrase {}\napp {}\nworld {}\nrobot {}\nset {}\n", trial.seed, trial.phrase,
                     request.app, request.world, request.robot, fmt::join(request.app_set, " "));
}
fs::path fingerprint_file(const Trial& trial) { return trial.folder.string() + ".done"; }

// In a process group of its own: Ctrl-C at the terminal reaches it once, through us.
Result<pid_t> start(const std::vector<std::string>& arguments, const fs::path& log) {
  std::vector<char*> argv;
  for (const auto& argument : arguments)
    argv.push_back(const_cast<char*>(argument.c_str()));  // NOLINT: spawn's type
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    return Error{ErrorCode::kNotFound, fmt::format("cannot start {}: is it built?", arguments[0])};
  }
  return child;
}

// What the trial's own report says.
void read_outcome(Trial& trial) {
  std::ifstream file(trial.folder / "report.json");
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded() || !json.contains("outcome")) {
    trial.stage = "start";
    trial.sentence = fmt::format("there is no report in {}", trial.folder.string());
    return;
  }
  const auto& outcome = json["outcome"];
  trial.success = outcome.value("success", false);
  trial.stage = outcome.value("stage", "");
  trial.sentence = outcome.value("sentence", "");
  trial.sim_s = json["sim_s"].is_number() ? json["sim_s"].get<double>() : 0.0;
  trial.wall_s = json["wall_s"].is_number() ? json["wall_s"].get<double>() : 0.0;
  for (const auto& [name, metric] : json["metrics"].items()) {
    if (metric["value"].is_number()) trial.metrics[name] = metric["value"].get<double>();
  }
}

std::string verb_of(const std::string& phrase) {
  const std::string first = phrase.substr(0, phrase.find(' '));
  for (const Verb verb : kAllVerbs) {
    if (first == verb_name(verb)) return first;
  }
  return "look";
}

int verb_rank(const std::string& phrase) {
  const std::string verb = verb_of(phrase);
  return verb == "reach" ? 1 : verb == "grasp" ? 2 : verb == "drop" ? 3 : 0;
}

std::string key_of(std::string phrase) {
  std::replace(phrase.begin(), phrase.end(), ' ', '_');
  return phrase;
}

Report make_report(const Request& request, const std::vector<Trial>& trials) {
  Report report;
  report.name = "speech-and-action";
  report.title = "Speech and action on random tables";
  report.summary =
      "The whole system as separate processes: a phrase is spoken, the robot looks, chooses, reaches, grasps "
      "and drops. A "
      "trial succeeds only if the judge finds the world as the phrase asked for.";
  report.command = fmt::format("nido experiment run speech-and-action --seed {} --trials {}", request.seed,
                               request.trials);
  report.seed = request.seed;
  report.robot = request.robot.empty() ? "icub_sim" : fs::path(request.robot).stem().string();
  report.world = fs::path(request.world).stem().string();
  report.trials = static_cast<long>(trials.size());

  int successes = 0;
  std::map<std::string, std::pair<int, int>> by_phrase;  // successes, trials
  std::map<std::string, std::pair<int, int>> by_stage;
  std::map<std::string, int> failed_at;
  std::vector<double> factors;
  std::vector<double> durations_s;
  for (const Trial& trial : trials) {
    successes += trial.success ? 1 : 0;
    auto& phrase = by_phrase[trial.phrase];
    phrase.first += trial.success ? 1 : 0;
    ++phrase.second;
    for (const auto& [stage, rank] : stages()) {
      if (rank > verb_rank(trial.phrase)) continue;
      auto& counts = by_stage[stage];
      counts.first += trial.metrics.contains("time_to_" + stage + "_s") ? 1 : 0;
      ++counts.second;
    }
    if (!trial.success) ++failed_at[trial.stage];
    if (const auto factor = trial.metrics.find("real_time_factor"); factor != trial.metrics.end()) {
      factors.push_back(factor->second);
    }
    durations_s.push_back(trial.sim_s);
    report.sim_s += trial.sim_s;
    report.trials_detail.push_back({{"trial", static_cast<double>(trial.number)},
                                    {"seed", static_cast<double>(trial.seed)},
                                    {"phrase", trial.phrase},
                                    {"success", trial.success},
                                    {"stage", trial.stage},
                                    {"sim_s", trial.sim_s},
                                    {"wall_s", trial.wall_s},
                                    {"sentence", trial.sentence},
                                    {"folder", trial.folder.filename().string()}});
  }
  report.add("success_rate", proportion_metric(successes, static_cast<int>(trials.size())));
  for (const auto& [phrase, counts] : by_phrase) {
    report.add("success_rate." + key_of(phrase), proportion_metric(counts.first, counts.second));
  }
  Plot plot{"stages", "Fig. 19: trials that got so far", "", "share"};
  plot.y_range = {0.0, 1.1};
  plot.series.resize(1);
  for (const auto& [stage, rank] : stages()) {
    const auto found = by_stage.find(stage);
    if (found == by_stage.end()) continue;
    const Metric rate = proportion_metric(found->second.first, found->second.second);
    report.add("stage_rate." + stage, rate);
    plot.series[0].points.push_back({static_cast<double>(plot.bar_names.size()), rate.value});
    plot.bar_names.push_back(stage);
  }
  for (const auto& [stage, count] : failed_at) {
    report.add("failed_at." + stage,
               Metric{static_cast<double>(count), "", static_cast<long>(trials.size())});
  }
  if (!factors.empty()) report.add("real_time_factor", median_metric(factors, ""));
  if (!durations_s.empty()) report.add("duration_s", median_metric(durations_s, "s"));
  if (!plot.bar_names.empty()) report.plots.push_back(plot);
  return report;
}

class Experiment {
 public:
  // `domains`: one for each job
  Experiment(Request request, std::vector<DomainLease> domains, fs::path nido)
      : request_(std::move(request)), domains_(std::move(domains)), nido_(std::move(nido)) {}

  Status run() {
    started_ = std::chrono::steady_clock::now();
    std::error_code error;
    fs::create_directories(request_.out, error);
    if (error) return Error{ErrorCode::kFailed, fmt::format("cannot make the folder {}", request_.out)};
    if (!request_.fresh) take_earlier_trials();
    const InterruptFlag interrupt;
    ProgressBar progress("speech-and-action", request_.trials);
    Status failure;
    while (failure.ok() && (!running_.empty() || (skip_done() < request_.trials && !interrupt.raised()))) {
      while (failure.ok() && !interrupt.raised() && skip_done() < request_.trials &&
             static_cast<int>(running_.size()) < request_.jobs) {
        failure = start_next();
      }
      collect();
      stop_late_ones(interrupt.raised());
      const auto good =
          std::count_if(trials_.begin(), trials_.end(), [](const Trial& t) { return t.success; });
      if (static_cast<long>(trials_.size()) != shown_) {
        shown_ = static_cast<long>(trials_.size());
        progress.update(shown_, fmt::format("{} good", good));
        if (Status saved = save(); !saved && failure.ok()) failure = saved;
      }
      constexpr timespec kPause{0, 50'000'000};
      nanosleep(&kPause, nullptr);
    }
    if (!failure) {
      stop_all();
      return failure;
    }
    if (Status saved = save(); !saved) return saved;
    if (interrupt.raised())
      return Error{ErrorCode::kInterrupted, "interrupted: the report has what was done"};
    return {};
  }

  [[nodiscard]] Report report() const {
    auto sorted = trials_;
    std::sort(sorted.begin(), sorted.end(),
              [](const Trial& a, const Trial& b) { return a.number < b.number; });
    Report result = make_report(request_, sorted);
    result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
    return result;
  }

 private:
  Status save() const { return report().save(request_.out); }

  [[nodiscard]] Trial trial_of(int index) const {
    Trial trial;
    trial.number = index + 1;
    trial.seed = request_.seed + static_cast<std::uint64_t>(index);
    trial.phrase = request_.say[static_cast<std::size_t>(index) % request_.say.size()];
    trial.folder = fs::absolute(fs::path(request_.out) / fmt::format("trial-{:03d}", trial.number));
    return trial;
  }

  // the trials that are complete already, of an earlier run into the same folder
  void take_earlier_trials() {
    for (int index = 0; index < request_.trials; ++index) {
      Trial trial = trial_of(index);
      std::ifstream file(fingerprint_file(trial));
      const std::string found(std::istreambuf_iterator<char>(file), {});
      if (found != fingerprint(request_, trial)) continue;
      read_outcome(trial);
      trials_.push_back(std::move(trial));
      done_.insert(index);
    }
    if (!done_.empty())
      fmt::print(stderr, "{} trials are there already (--fresh for new ones)\n", done_.size());
  }

  // the next trial that is not there
  int skip_done() {
    while (done_.contains(next_)) ++next_;
    return next_;
  }

  Status start_next() {
    Running job;
    job.trial = trial_of(next_);
    std::error_code ignored;
    fs::remove(fingerprint_file(job.trial), ignored);
    job.started = std::chrono::steady_clock::now();
    std::set<int> used;
    for (const Running& other : running_) used.insert(other.domain);
    for (const DomainLease& domain : domains_) {
      if (!used.contains(domain.number())) job.domain = domain.number();
    }
    ++next_;
    std::vector<std::string> arguments = {nido_.string(),
                                          "launch",
                                          request_.app,
                                          "--say",
                                          job.trial.phrase,
                                          "--seed",
                                          std::to_string(job.trial.seed),
                                          "--world",
                                          request_.world,
                                          "--domain",
                                          std::to_string(job.domain),
                                          "--out",
                                          job.trial.folder.string()};
    if (!request_.robot.empty()) {
      arguments.emplace_back("--robot");
      arguments.push_back(request_.robot);
    }
    for (const std::string& set : request_.app_set) {
      arguments.emplace_back("--set");
      arguments.push_back(set);
    }
    const auto child = start(arguments, job.trial.folder.string() + ".log");
    if (!child) return child.error();
    job.child = *child;
    running_.push_back(std::move(job));
    return {};
  }

  void collect() {
    for (auto job = running_.begin(); job != running_.end();) {
      int status = 0;
      if (waitpid(job->child, &status, WNOHANG) != job->child) {
        ++job;
        continue;
      }
      // an interrupted trial says nothing
      const bool counts = !job->told_to_stop || job_is_late(*job);
      if (counts) {
        read_outcome(job->trial);
        std::ofstream(fingerprint_file(job->trial)) << fingerprint(request_, job->trial);
        trials_.push_back(job->trial);
      }
      job = running_.erase(job);
    }
  }

  [[nodiscard]] bool job_is_late(const Running& job) const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - job.started).count() >
           request_.limit_s;
  }

  void stop_late_ones(bool all) {
    for (Running& job : running_) {
      if (job.told_to_stop || !(all || job_is_late(job))) continue;
      kill(job.child, SIGINT);
      job.told_to_stop = true;
    }
  }

  void stop_all() {
    stop_late_ones(true);
    for (const Running& job : running_) {
      int status = 0;
      waitpid(job.child, &status, 0);
    }
    running_.clear();
  }

  Request request_;
  std::vector<DomainLease> domains_;
  fs::path nido_;
  std::chrono::steady_clock::time_point started_;
  int next_ = 0;
  std::set<int> done_;  // by an earlier run
  long shown_ = -1;
  std::vector<Running> running_;
  std::vector<Trial> trials_;
};

Status run(Request request) {
  const auto places = find_places();
  if (!places) return places.error();
  // "all": every phrase of the book in turn
  if (request.say == std::vector<std::string>{"all"}) {
    const auto book = PhraseBook::load((places->config / "phrases.yaml").string());
    if (!book) return book.error();
    request.say.clear();
    for (const Phrase& phrase : book->phrases) request.say.push_back(phrase.text);
  }
  auto domains = take_domains(request.domain, std::min(request.jobs, request.trials));
  if (!domains) return domains.error();
  Experiment experiment(request, std::move(*domains), places->programs / "nido");
  const Status status = experiment.run();
  if (const Status saved = save_and_print(experiment.report(), request.out); !saved) return saved;
  return status;
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  request.trials = 28;
  request.out = "out/speech-and-action";
  CLI::App app("Runs the whole system on random tables and counts how often it did what it was told.",
               "nido-experiment-speech-and-action");
  app.footer(
      "example\n  nido experiment run speech-and-action --trials 112 --jobs 2\n"
      "  nido-experiment-speech-and-action --say 'drop blue cube into basket' --trials 20 --jobs 2");
  nido::add_experiment_options(app, request);
  app.add_option("--say", request.say,
                 "phrases, taken in turn, separated by commas; 'all' for every known one")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--app", request.app, "app file or name")->capture_default_str();
  app.add_option("--world", request.world, "world file or name")->capture_default_str();
  app.add_option("--robot", request.robot, "robot file or name (default: the app's)");
  app.add_option("--app-set", request.app_set,
                 "KEY=VALUE for the app, as of nido launch --set; may come again");
  app.add_flag("--fresh", request.fresh,
               "does trials again that an earlier run into the same folder completed");
  nido::add_domain_option(app, request.domain);
  app.add_option("--limit", request.limit_s, "wall time for one trial, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::run(request));
}
