// nido-experiment-all: every experiment one after the other, and one page with all of their figures beside
// the paper's. Goes on where it was interrupted.
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"

namespace nido {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // metrics stay in their order

struct Experiment {
  const char* name;
  int trials;       // so many by default: the whole set stays under an hour on two cores
  int trials_full;  // so many as the figures in docs rest upon
  double trial_s;   // about, of a quiet machine with two cores, two trials at a time
  std::vector<std::string> options = {};
};

// In the paper's order.
const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> list = {
      {"reach-learning", 2, 2, 50},    {"reach-accuracy", 62, 1000, 2.5},
      {"reach-correction", 10, 50, 4}, {"grasp-learning", 20, 100, 8},
      {"grasp-success", 40, 200, 6},   {"goal-learning", 10, 10, 1.3},
      {"speech", 1, 1, 200},           {"speech-and-action", 28, 112, 20, {"--condition", "normal,degraded"}},
      {"attention", 16, 16, 5},        {"teaching", 20, 20, 10},
      {"self-calibration", 3, 10, 60},
  };
  return list;
}

struct Request : ExperimentRequest {
  bool full = false;
  bool fresh = false;
  std::vector<int> trials_of;  // of each experiment; -1: the default, 0: leave it out
};

// What an experiment was asked for; a report of the same one is not made again.
std::string asked(const std::vector<std::string>& words) {
  return fmt::format("{}\n", fmt::join(words, "\n"));
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Runs a program with this terminal; its exit code. An interruption is passed on.
int run_program(const std::vector<std::string>& words, const fs::path& log, const InterruptFlag& interrupt) {
  std::vector<char*> argv;
  for (const std::string& word : words)
    argv.push_back(const_cast<char*>(word.c_str()));  // NOLINT: exec's type
  argv.push_back(nullptr);
  const pid_t self = getpid();
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // it does not outlive us
    if (getppid() != self) _exit(127);
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (output >= 0) dup2(output, STDOUT_FILENO);  // the figures come again at the end; the progress shows
    execv(argv.front(), argv.data());
    _exit(127);
  }
  if (child < 0) return 127;
  int state = 0;
  while (waitpid(child, &state, 0) < 0 && errno == EINTR) {
    if (interrupt.raised()) kill(child, SIGINT);
  }
  return WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
}

std::optional<double> number(const Json& value) {
  return value.is_number() ? std::optional<double>(value.get<double>()) : std::nullopt;
}

// What an experiment's own report says, as a part of the page of all; nothing if there is none.
std::optional<ReportPart> part_of(const fs::path& out, const std::string& name, Report& all) {
  const Json json = Json::parse(text_of(out / name / "report.json"), nullptr, false);
  if (!json.is_object() || !json.contains("metrics")) return std::nullopt;
  ReportPart part;
  part.title = fmt::format("{}: {}", name, json.value("title", ""));
  part.summary = json.value("summary", "");
  part.command = json.value("command", "");
  part.page = name + "/report.html";
  for (const auto& [metric_name, value] : json["metrics"].items()) {
    Metric metric{number(value["value"]).value_or(std::nan("")), value.value("unit", ""),
                  value.value("n", 1L)};
    if (const Json& range = value["ci95"]; range.is_array() && range.size() == 2) {
      metric.ci95 = {{number(range[0]).value_or(std::nan("")), number(range[1]).value_or(std::nan(""))}};
    }
    metric.paper = number(value["paper"]);
    part.metrics.emplace_back(metric_name, metric);
    all.add(name + "." + metric_name, metric);
  }
  for (const Json& picture : json.value("pictures", Json::array())) {
    part.pictures.push_back({name + "/" + picture.value("file", ""), picture.value("caption", "")});
  }
  all.trials_detail.push_back({{"experiment", name},
                               {"seed", json.value("seed", 0.0)},
                               {"trials", json.value("trials", 0.0)},
                               {"wall_s", json.value("wall_s", 0.0)}});
  return part;
}

int trials_of(const Request& request, std::size_t number) {
  const Experiment& experiment = experiments()[number];
  const int given = request.trials_of[number];
  return given >= 0 ? given : request.full ? experiment.trials_full : experiment.trials;
}

// How long experiments from number `first` on take on a quiet machine.
double expected_s(const Request& request, std::size_t first) {
  double sum_s = 0;
  for (std::size_t i = first; i < experiments().size(); ++i)
    sum_s += trials_of(request, i) * experiments()[i].trial_s;
  return sum_s;
}

Status run(const Request& request, const fs::path& programs) {
  const auto started = std::chrono::steady_clock::now();
  const fs::path out = fs::absolute(request.out);
  const InterruptFlag interrupt;
  std::vector<std::string> failed;
  const auto save = [&] {
    Report report;
    report.name = "all";
    report.title = "The paper's experiments";
    report.summary = failed.empty() ? "Every figure beside the paper's, where the paper gives one."
                                    : fmt::format("Not ended well: {}.", fmt::join(failed, ", "));
    report.command =
        fmt::format("nido experiment run all --seed {}{}", request.seed, request.full ? " --full" : "");
    report.seed = request.seed;
    for (const Experiment& experiment : experiments()) {
      if (auto part = part_of(out, experiment.name, report)) report.parts.push_back(std::move(*part));
    }
    report.trials = static_cast<long>(report.parts.size());
    report.robot = "icub_sim";
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return std::pair(report, report.save(request.out));
  };
  const std::size_t count = experiments().size();
  double spent_s = 0;
  double spent_expected_s = 0;
  double slowness = 1.0;
  for (std::size_t i = 0; i < count && !interrupt.raised(); ++i) {
    const Experiment& experiment = experiments()[i];
    const int trials = trials_of(request, i);
    if (trials == 0) continue;
    const fs::path folder = out / experiment.name;
    const fs::path mark = folder.string() + ".done";
    std::vector<std::string> words = {
        (programs / fmt::format("nido-experiment-{}", experiment.name)).string(),
        "--seed",
        std::to_string(request.seed),
        "--trials",
        std::to_string(trials),
        "--jobs",
        std::to_string(request.jobs),
        "--out",
        folder.string()};
    words.insert(words.end(), experiment.options.begin(), experiment.options.end());
    if (!request.fresh && text_of(mark) == asked(words)) {
      fmt::print(stderr, "{} of {}: {} is there already\n", i + 1, count, experiment.name);
      continue;
    }
    std::error_code ignored;
    fs::remove(mark, ignored);
    if (request.fresh) fs::remove_all(folder, ignored);
    fs::create_directories(folder, ignored);
    // as slow as it was so far, in proportion
    fmt::print(stderr, "{} of {}: {}, {} trials; about {:.0f} min to the end of all\n", i + 1, count,
               experiment.name, trials, expected_s(request, i) * slowness / 60.0);
    const auto began = std::chrono::steady_clock::now();
    const int code = run_program(words, folder / "figures.txt", interrupt);
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (!interrupt.raised()) {
      spent_s += took_s;
      spent_expected_s += trials * experiment.trial_s;
      slowness = spent_s / spent_expected_s;
    }
    if (code == 0) {
      std::ofstream(mark) << asked(words);
    } else if (!interrupt.raised()) {
      // one that fails does not keep the others from their turn
      failed.emplace_back(experiment.name);
      fmt::print(stderr, "{} ended with exit code {}\n", experiment.name, code);
    }
    fmt::print(stderr, "{} of {}: {} took {:.0f} s\n", i + 1, count, experiment.name, took_s);
    if (const auto saved = save(); !saved.second) return saved.second;
  }
  const auto [report, saved] = save();
  if (!saved) return saved;
  if (const Status printed = save_and_print(report, request.out); !printed) return printed;
  if (interrupt.raised()) {
    return Error{ErrorCode::kInterrupted, "interrupted; what is done is kept, the same command goes on"};
  }
  if (!failed.empty())
    return Error{ErrorCode::kFailed, fmt::format("not ended well: {}", fmt::join(failed, ", "))};
  return {};
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  request.jobs = 2;
  request.out = "out/all";
  CLI::App app("All experiments, one after the other, in one report.", "nido-experiment-all");
  app.footer(
      "examples\n  nido experiment run all --out out/all\n"
      "  nido experiment run all --set speech=0 --set grasp-success=200   (trials; 0 leaves one out)");
  nido::add_experiment_options(app, request);
  app.add_flag("--full", request.full, "as many trials as the figures in docs rest upon: hours");
  app.add_flag("--fresh", request.fresh, "does again what an earlier run into the same folder completed");
  request.trials_of.assign(nido::experiments().size(), -1);
  for (std::size_t i = 0; i < nido::experiments().size(); ++i) {
    const nido::Experiment& experiment = nido::experiments()[i];
    app.add_option(fmt::format("--{}", experiment.name), request.trials_of[i],
                   fmt::format("trials of {} (default: {}; with --full {})", experiment.name,
                               experiment.trials, experiment.trials_full))
        ->check(CLI::Range(0, 1000000));
  }
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  const auto places = nido::find_places();
  if (!places) return nido::end_experiment(places.error());
  return nido::end_experiment(nido::run(request, places->programs));
}
