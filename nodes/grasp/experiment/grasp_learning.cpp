// nido-experiment-grasp-learning: the Jordan network learns to close the hand by reward and penalty, through
// ports and under physics (the paper's Figs. 13 and 14). --weights DIR writes grasp.txt, which nido-grasp
// uses.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "nido/experiment/launched_app.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::grasp {
namespace {

constexpr double kPaperAttempts = 4;  // until the first maximal reward
constexpr int kPaperRun = 15;         // attempts of a run

struct Request : ExperimentRequest {
  int attempts = kPaperRun;
  int domain = 60;
  std::vector<std::string> objects = {"blue cube"};
  std::string weights;
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

std::string command_of(const Request& request, std::uint64_t seed, int trials) {
  std::string command = fmt::format("nido experiment run grasp-learning --seed {} --trials {}", seed, trials);
  if (request.attempts != kPaperRun) command += fmt::format(" --attempts {}", request.attempts);
  if (request.objects.size() != 1 || request.objects[0] != "blue cube")
    command += fmt::format(" --objects '{}'", fmt::join(request.objects, ","));
  return command;
}

// One learning run through the app; the `lane`-th of those that go side by side.
Result<Run> learn(const Request& request, std::uint64_t seed, int lane) {
  const std::filesystem::path out = folder_of(request, seed);
  std::error_code failure;
  std::filesystem::create_directories(out, failure);
  if (failure) return Error{ErrorCode::kFailed, out.string() + ": " + failure.message()};
  const Status done = run_app("grasp_learning",
                              {"--seed", std::to_string(seed), "--rate", "max", "--lockstep", "--domain",
                               std::to_string(request.domain + lane), "--out", (out / "run").string(),
                               "--set", fmt::format("grasp_trials.attempts={}", request.attempts), "--set",
                               fmt::format("grasp_trials.objects=[{}]", fmt::join(request.objects, ", ")),
                               "--set", "grasp.command=" + command_of(request, seed, 1)},
                              (out / "launch.log").string());
  if (!done) return done.error();
  std::ifstream file(out / "run" / "trials.json");
  const auto rows = nlohmann::json::parse(file, nullptr, false);
  if (!rows.is_array())
    return Error{ErrorCode::kFailed, (out / "run" / "trials.json").string() + ": no list of attempts"};
  Run run{seed, {}};
  for (const auto& row : rows)
    run.attempts.push_back({row.value("object", ""), row.value("trouble", ""), row.value("reward", 0.0)});
  return run;
}

// Fig. 13: reward by attempt, of the first seed and in the mean of all.
Plot reward_plot(const std::vector<Run>& runs) {
  Plot plot{"reward", "Reward of each attempt", "attempt", "share of the test that the object was held"};
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
  report.seed = request.seed;
  report.robot = "icub_sim_touch";
  report.world = "grasp_trial";
  report.command = command_of(request, request.seed, request.trials);
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
  Plot boxes{"boxes", "Boxes used, grabbed and lost, all seeds", "", "boxes"};
  boxes.bar_names = {"used", "grabbed", "lost"};
  boxes.series.resize(1);
  boxes.series[0].points = {{0, static_cast<double>(used)},
                            {1, static_cast<double>(grabbed)},
                            {2, static_cast<double>(used - grabbed)}};
  report.plots = {reward_plot(runs), boxes};
  return report;
}

// The network of the first seed, as nido-grasp has saved it.
Status copy_weights(const Request& request) {
  const auto from = folder_of(request, request.seed) / "run" / "grasp.txt";
  const auto to = std::filesystem::path(request.weights) / "grasp.txt";
  std::error_code failure;
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, failure);
  if (failure) return Error{ErrorCode::kFailed, to.string() + ": " + failure.message()};
  fmt::print("{}\n", to.string());
  return {};
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  std::mutex mutex;
  std::vector<Run> runs;
  Status failure;
  int next = 0;
  const InterruptFlag interrupt;
  ProgressBar progress("learning", request.trials);
  const auto work = [&](int lane) {
    while (true) {
      std::uint64_t seed = 0;
      {
        const std::scoped_lock lock(mutex);
        if (!failure || next >= request.trials || interrupt.raised()) return;
        seed = request.seed + static_cast<std::uint64_t>(next++);
      }
      auto learned = learn(request, seed, lane);
      const std::scoped_lock lock(mutex);
      if (!learned) {
        if (failure) failure = learned.error();
        return;
      }
      runs.push_back(std::move(*learned));
      Report report = make_report(request, runs);
      report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
      if (const Status saved = report.save(request.out); !saved && failure) failure = saved;
      progress.update(static_cast<long>(runs.size()),
                      fmt::format("seed {}: {} attempts", seed, runs.back().to_max()));
    }
  };
  {
    std::vector<std::jthread> lanes;
    for (int lane = 0; lane < std::min(request.jobs, request.trials); ++lane) lanes.emplace_back(work, lane);
  }
  const bool interrupted = !failure && failure.error().code == ErrorCode::kInterrupted;
  if (!failure && !(interrupted && !runs.empty())) return failure;
  if (runs.empty()) return Error{ErrorCode::kInterrupted, "interrupted before the first run ended"};
  const Report report = make_report(request, runs);
  if (!request.weights.empty()) {
    if (const Status copied = copy_weights(request); !copied) return copied;
  }
  for (const auto& [name, metric] : report.metrics) {
    fmt::print("{:<32} {:.4g}{}{}\n", name, metric.value,
               metric.ci95 ? fmt::format("  ({:.3g} to {:.3g}, n = {})", (*metric.ci95)[0], (*metric.ci95)[1],
                                         metric.n)
                           : "",
               metric.paper ? fmt::format("  [paper {}]", *metric.paper) : "");
  }
  fmt::print("{}/report.html\n", request.out);
  return {};
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
  app.add_option("--weights", request.weights, "folder to write grasp.txt of the first seed to");
  app.add_option("--objects", request.objects, "taken in turn: blue cube, red ball, teddy bear")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--domain", request.domain, "DDS domain of the first job, the others follow")
      ->check(CLI::Range(0, 101))
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::grasp::run(request));
}
