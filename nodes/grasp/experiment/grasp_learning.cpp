// nido-experiment-grasp-learning: the Jordan network learns to close the hand by reward and penalty, through
// ports and under physics (the paper's Figs. 13 and 14). --weights DIR writes grasp.txt, which nido-grasp
// uses: the network of the seed whose closings hold best in --validate further attempts without exploring,
// all over the table and beside a basket.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "nido/experiment/domain.h"
#include "nido/experiment/kept.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::grasp {
namespace {

constexpr double kPaperAttempts = 4;  // until the first maximal reward
constexpr int kPaperRun = 15;         // attempts of a run
constexpr double kRadPerDeg = 0.017453292519943295;
// validation: places that no run learned at, the same for all
constexpr std::uint64_t kValidationSeeds = 1'000'000;

struct Request : ExperimentRequest {
  int attempts = kPaperRun;
  int domain = kFreeDomain;
  std::vector<std::string> objects = {"blue cube"};
  std::string weights;
  std::string hand = "right";
  double pull_N = 0;
  double off_m = 0.006;
  double turn_deg = 20;
  int validate = 0;
  bool until_max = false;
};

struct Attempt {
  std::string object;
  std::string trouble;  // not tried
  double reward = 0;
};

// What became of one seed.
struct Run {
  std::uint64_t seed = 0;
  std::vector<Attempt> attempts;
  std::vector<Attempt> validation;  // without exploring and learning, at other places
  [[nodiscard]] double validation_reward() const {
    std::vector<double> rewards;
    for (const Attempt& attempt : validation)
      if (attempt.trouble.empty()) rewards.push_back(attempt.reward);
    return rewards.empty() ? 0.0 : mean(rewards);
  }
  // Attempts until the first maximal reward; one more than there were if it never came.
  [[nodiscard]] int to_max() const {
    int tried = 0;
    for (const Attempt& attempt : attempts) {
      if (!attempt.trouble.empty()) continue;
      ++tried;
      if (attempt.reward >= 1.0) return tried;
    }
    return tried + 1;
  }
};

std::filesystem::path folder_of(const Request& request, std::uint64_t seed) {
  return std::filesystem::absolute(std::filesystem::path(request.out) / fmt::format("seed-{}", seed));
}

std::string command_of(const Request& request) {
  const Request usual;
  std::string command =
      fmt::format("nido experiment run grasp-learning --seed {} --trials {}", request.seed, request.trials);
  if (request.attempts != usual.attempts) command += fmt::format(" --attempts {}", request.attempts);
  if (request.objects != usual.objects)
    command += fmt::format(" --objects '{}'", fmt::join(request.objects, ","));
  if (request.pull_N != usual.pull_N) command += fmt::format(" --pull {}", request.pull_N);
  if (request.off_m != usual.off_m) command += fmt::format(" --off {}", request.off_m);
  if (request.turn_deg != usual.turn_deg) command += fmt::format(" --turn {}", request.turn_deg);
  if (request.validate != usual.validate) command += fmt::format(" --validate {}", request.validate);
  if (request.until_max) command += " --until-max";
  if (request.hand != usual.hand) command += " --hand " + request.hand;
  if (!request.weights.empty()) command += " --weights config/weights";
  return command;
}

// The robot, or the world, of the hand that learns.
std::string for_hand(const std::string& name, const Request& request) {
  return request.hand == "left" ? name + "_left" : name;
}

// One run of the app in `out`, with settings of its own besides those of all; its attempts.
Result<std::vector<Attempt>> run_attempts(const Request& request, const std::filesystem::path& out,
                                          std::uint64_t seed, const Lane& lane, int attempts,
                                          const std::vector<std::string>& settings,
                                          const std::string& world) {
  std::vector<std::string> arguments = in_lockstep(
      seed, {"--world", world, "--hand", request.hand, "--robot", for_hand("icub_sim_touch", request)});
  std::vector<std::string> sets = {fmt::format("grasp_trials.attempts={}", attempts),
                                   fmt::format("grasp_trials.objects=[{}]", fmt::join(request.objects, ", ")),
                                   fmt::format("grasp_trials.pull_N={}", request.pull_N),
                                   fmt::format("grasp_trials.off_m={}", request.off_m),
                                   fmt::format("grasp_trials.turn_rad={}", request.turn_deg * kRadPerDeg)};
  sets.insert(sets.end(), settings.begin(), settings.end());
  for (const std::string& set : sets) {
    arguments.emplace_back("--set");
    arguments.push_back(set);
  }
  if (const Status done = run_app_once({"grasp_learning", arguments, out.string()}, lane); !done)
    return done.error();
  std::ifstream file(out / "run" / "trials.json");
  const auto rows = nlohmann::json::parse(file, nullptr, false);
  if (!rows.is_array())
    return Error{ErrorCode::kFailed, (out / "run" / "trials.json").string() + ": no list of attempts"};
  std::vector<Attempt> results;
  for (const auto& row : rows)
    results.push_back({row.value("object", ""), row.value("trouble", ""), row.value("reward", 0.0)});
  return results;
}

// One learning run through the app, and one that only tests.
Result<Run> learn(const Request& request, std::uint64_t seed, const Lane& lane) {
  const std::filesystem::path out = folder_of(request, seed);
  auto learned = run_attempts(
      request, out, seed, lane, request.attempts,
      {fmt::format("grasp_trials.until_max={}", request.until_max), "grasp.command=" + command_of(request)},
      for_hand("grasp_trial", request));
  if (!learned) return learned.error();
  Run run{seed, std::move(*learned), {}};
  if (request.validate > 0) {
    auto tested = run_attempts(
        request, out / "validation", request.seed + kValidationSeeds, lane, request.validate,
        {"grasp.mode=test", "grasp.weights=" + (out / "run" / "grasp.txt").string(), "grasp_trials.x_m=-0.32",
         "grasp_trials.y_m=0.06", "grasp_trials.spread_m=0.06", "grasp_trials.beside=side basket"},
        "grasp_validation");
    if (!tested) return tested.error();
    run.validation = std::move(*tested);
  }
  return run;
}

// Fig. 13: reward by attempt, of the first seed and in the mean of all.
Plot reward_plot(const std::vector<Run>& runs) {
  Plot plot{"reward", "Fig. 13: reward of each attempt", "attempt",
            "share of the test that the object was held"};
  Series first{fmt::format("seed {}", runs.front().seed)};
  Series all{fmt::format("mean of {} seeds", runs.size())};
  all.dashed = true;
  for (std::size_t i = 0; i < runs.front().attempts.size(); ++i) {
    const double attempt = static_cast<double>(i) + 1;
    if (runs.front().attempts[i].trouble.empty())
      first.points.push_back({attempt, runs.front().attempts[i].reward});
    std::vector<double> rewards;
    for (const Run& run : runs) {
      if (i < run.attempts.size() && run.attempts[i].trouble.empty())
        rewards.push_back(run.attempts[i].reward);
    }
    if (!rewards.empty()) all.points.push_back({attempt, mean(rewards)});
  }
  plot.series = {first};
  if (runs.size() > 1) plot.series.push_back(all);
  plot.y_range = {0.0, 1.05};
  return plot;
}

Report make_report(const Request& request, std::vector<Run> runs) {
  std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.seed < b.seed; });
  Report report;
  report.name = "grasp-learning";
  report.title = "Learning to grasp by reward";
  report.summary =
      "The open hand is brought over a table, an object is put under it, the Jordan network closes the "
      "fingers, the arm "
      "lifts, and gravity tests for 250 time steps of 10 ms. The share of them that the object stays up is "
      "the reward. Every "
      "seed begins with an untaught network.";
  if (request.pull_N > 0) {
    report.summary += fmt::format(" During the test a pull from changing sides grows from nothing to {} N.",
                                  request.pull_N);
  }
  report.seed = request.seed;
  report.robot = for_hand("icub_sim_touch", request);
  report.world = for_hand("grasp_trial", request);
  report.command = command_of(request);
  report.trials = static_cast<long>(runs.size());
  std::vector<double> first_max;
  int learned = 0;
  int used = 0;
  int grabbed = 0;
  int not_tried = 0;
  for (const Run& run : runs) {
    first_max.push_back(run.to_max());
    learned += run.to_max() <= kPaperRun ? 1 : 0;
    Row row = {{"seed", static_cast<double>(run.seed)},
               {"attempts_to_max_reward", static_cast<double>(run.to_max())}};
    if (!run.validation.empty()) row.emplace_back("validation_reward", run.validation_reward());
    for (std::size_t i = 0; i < run.attempts.size(); ++i) {
      const Attempt& attempt = run.attempts[i];
      if (!attempt.trouble.empty()) {
        ++not_tried;
        row.emplace_back(fmt::format("trouble[{}]", i + 1), attempt.trouble);
        continue;
      }
      row.emplace_back(fmt::format("reward[{}]", i + 1), attempt.reward);
      ++used;
      grabbed += attempt.reward >= 1.0 ? 1 : 0;
    }
    report.trials_detail.push_back(row);
  }
  report.add("attempts_to_max_reward.median", median_metric(first_max, "", kPaperAttempts));
  report.add("max_reward_within_15", proportion_metric(learned, static_cast<int>(runs.size())));
  report.add("boxes_used", {static_cast<double>(used), "", used});
  report.add("boxes_grabbed", {static_cast<double>(grabbed), "", used});
  report.add("boxes_lost", {static_cast<double>(used - grabbed), "", used});
  report.add("boxes_not_tried", {static_cast<double>(not_tried), "", used + not_tried});
  Plot boxes{"boxes", "Fig. 14: boxes used, grabbed and lost, all seeds", "", "boxes"};
  boxes.bar_names = {"used", "grabbed", "lost"};
  boxes.series.resize(1);
  boxes.series[0].points = {{0, static_cast<double>(used)},
                            {1, static_cast<double>(grabbed)},
                            {2, static_cast<double>(used - grabbed)}};
  report.plots = {reward_plot(runs), boxes};
  return report;
}

// The network of the seed that held best without exploring, as nido-grasp has saved it; the first of equals.
Status copy_weights(const Request& request, const std::vector<Run>& runs) {
  const auto best = std::max_element(runs.begin(), runs.end(), [](const Run& a, const Run& b) {
    return a.validation_reward() != b.validation_reward() ? a.validation_reward() < b.validation_reward()
                                                          : a.seed > b.seed;
  });
  const auto from = folder_of(request, best->seed) / "run" / "grasp.txt";
  const auto to = std::filesystem::path(request.weights) / "grasp.txt";
  std::error_code failure;
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, failure);
  if (failure) return Error{ErrorCode::kFailed, to.string() + ": " + failure.message()};
  fmt::print("{}: seed {}, validation reward {:.3f}\n", to.string(), best->seed, best->validation_reward());
  return {};
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  const int jobs = std::min(request.jobs, request.trials);
  const auto domains = take_domains(request.domain, jobs);
  if (!domains) return domains.error();
  const auto report_of = [&](const std::vector<Run>& done) {
    Report report = make_report(request, done);
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return report;
  };
  std::mutex mutex;
  std::vector<Run> runs;
  const InterruptFlag interrupt;
  ProgressBar progress("learning", request.trials);
  Status failure =
      side_by_side(request.trials, *domains, interrupt, [&](int piece, const Lane& lane) -> Status {
        auto learned = learn(request, request.seed + static_cast<std::uint64_t>(piece), lane);
        if (!learned) return learned.error();
        const std::scoped_lock lock(mutex);
        runs.push_back(std::move(*learned));
        progress.update(static_cast<long>(runs.size()),
                        fmt::format("seed {}: {} attempts", runs.back().seed, runs.back().to_max()));
        return report_of(runs).save(request.out);
      });
  if (failure && !interrupt.raised() && !request.weights.empty()) failure = copy_weights(request, runs);
  const bool nothing = runs.empty();
  return end_of_run(nothing ? Report{} : report_of(runs), request.out, nothing, interrupt.raised(), failure);
}

}  // namespace
}  // namespace nido::grasp

int main(int argc, char** argv) {
  nido::grasp::Request request;
  request.out = "out/grasp-learning";
  CLI::App app("The hand learns to close by reward and penalty.", "nido-experiment-grasp-learning");
  app.footer("example\n  nido experiment run grasp-learning --seed 1 --trials 10 --jobs 2 --out out/grasp");
  nido::add_experiment_options(app, request);
  app.add_option("--attempts", request.attempts, "of each run")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--weights", request.weights,
                 "folder to write grasp.txt to: of the seed that was validated best, or of the first");
  app.add_option("--validate", request.validate,
                 "attempts without exploring after each run, all over the table beside a basket; the best "
                 "network is taken")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  app.add_option("--pull", request.pull_N, "N, at the object at the end of the test; 0: gravity alone")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--off", request.off_m,
                 "m, how far from where the hand expects it an object is put, in x and y")
      ->check(CLI::Range(0.0, 0.05))
      ->capture_default_str();
  app.add_option("--turn", request.turn_deg, "degrees, how far turned")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app.add_flag("--until-max", request.until_max, "each run ends with its first whole reward");
  app.add_option("--objects", request.objects, "taken in turn: blue cube, red ball, teddy bear")
      ->delimiter(',')
      ->capture_default_str();
  nido::add_hand_option(app, request.hand);
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::grasp::run(request));
}
