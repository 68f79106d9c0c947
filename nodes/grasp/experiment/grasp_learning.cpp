// nido-experiment-grasp-learning: the Jordan network learns to close the hand by reward and penalty, through
// ports and under physics (the paper's Figs. 13 and 14). --weights DIR writes grasp.txt, which nido-grasp
// uses.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "nido/experiment/launched_app.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"

namespace nido::grasp {
namespace {

constexpr double kPaperAttempts = 4;  // until the first maximal reward

struct Request : ExperimentRequest {
  int attempts = 15;
  int domain = 60;
  std::string weights;
};

// The rewards of one learning run, attempt by attempt.
Result<std::vector<double>> learn(const Request& request, std::uint64_t seed) {
  const std::filesystem::path out =
      std::filesystem::absolute(std::filesystem::path(request.out) / fmt::format("seed-{}", seed));
  std::error_code failure;
  std::filesystem::create_directories(out, failure);
  if (failure) return Error{ErrorCode::kFailed, out.string() + ": " + failure.message()};
  const Status done = run_app("grasp_learning",
                              {"--seed", std::to_string(seed), "--rate", "max", "--lockstep", "--domain",
                               std::to_string(request.domain), "--out", (out / "run").string(), "--set",
                               fmt::format("grasp_trials.attempts={}", request.attempts)},
                              (out / "launch.log").string());
  if (!done) return done.error();
  std::ifstream file(out / "run" / "trials.json");
  const auto rows = nlohmann::json::parse(file, nullptr, false);
  if (!rows.is_array())
    return Error{ErrorCode::kFailed, (out / "run" / "trials.json").string() + ": no list of attempts"};
  std::vector<double> rewards;
  for (const auto& row : rows) rewards.push_back(row.value("reward", 0.0));
  return rewards;
}

// Attempts until the first maximal reward; one more than there were if it never came.
int attempts_to_max(const std::vector<double>& rewards) {
  for (std::size_t i = 0; i < rewards.size(); ++i) {
    if (rewards[i] >= 1.0) return static_cast<int>(i) + 1;
  }
  return static_cast<int>(rewards.size()) + 1;
}

Plot reward_plot(const std::vector<double>& rewards) {
  Plot plot{"reward", "Reward of each attempt (first seed)", "attempt",
            "share of the test that the cube was held"};
  Series series{"reward"};
  for (std::size_t i = 0; i < rewards.size(); ++i)
    series.points.push_back({static_cast<double>(i) + 1, rewards[i]});
  plot.series = {series};
  plot.y_range = {0.0, 1.0};
  return plot;
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  Report report;
  report.name = "grasp-learning";
  report.title = "Learning to grasp by reward";
  report.summary =
      "A cube lies before the robot; the hand is brought to it, the Jordan network closes the fingers, the "
      "arm lifts, and "
      "gravity tests for 250 time steps. The share of them that the cube stays up is the reward.";
  report.seed = request.seed;
  report.robot = "icub_sim";
  report.world = "grasp_trial";
  report.command =
      fmt::format("nido experiment run grasp-learning --seed {} --trials {}", request.seed, request.trials);
  std::vector<double> first_max;
  int used = 0;
  int grabbed = 0;
  const InterruptFlag interrupt;
  {
    ProgressBar progress("learning", request.trials);
    for (int trial = 0; trial < request.trials && !interrupt.raised(); ++trial) {
      const std::uint64_t seed = request.seed + static_cast<std::uint64_t>(trial);
      auto rewards = learn(request, seed);
      if (!rewards) {
        if (rewards.error().code == ErrorCode::kInterrupted && !first_max.empty()) break;
        return rewards.error();
      }
      first_max.push_back(attempts_to_max(*rewards));
      Row row = {{"seed", static_cast<double>(seed)}, {"attempts_to_max_reward", first_max.back()}};
      for (std::size_t i = 0; i < rewards->size(); ++i) {
        row.emplace_back(fmt::format("reward[{}]", i + 1), (*rewards)[i]);
        ++used;
        if ((*rewards)[i] >= 1.0) ++grabbed;
      }
      report.trials_detail.push_back(row);
      if (trial == 0) report.plots = {reward_plot(*rewards)};
      progress.update(trial + 1);
    }
  }
  if (first_max.empty()) return Error{ErrorCode::kInterrupted, "interrupted before the first run ended"};
  report.trials = static_cast<long>(first_max.size());
  report.add("attempts_to_max_reward.median", median_metric(first_max, "", kPaperAttempts));
  report.add("boxes_used", {static_cast<double>(used), "", used});
  report.add("boxes_grabbed", {static_cast<double>(grabbed), "", used});
  report.add("boxes_lost", {static_cast<double>(used - grabbed), "", used});
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (const Status saved = report.save(request.out); !saved) return saved;
  if (!request.weights.empty()) {
    const auto from =
        std::filesystem::path(request.out) / fmt::format("seed-{}", request.seed) / "run" / "grasp.txt";
    const auto to = std::filesystem::path(request.weights) / "grasp.txt";
    std::error_code failure;
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, failure);
    if (failure) return Error{ErrorCode::kFailed, to.string() + ": " + failure.message()};
    fmt::print("{}\n", to.string());
  }
  for (const auto& [name, metric] : report.metrics) {
    fmt::print("{:<32} {:.4g}{}\n", name, metric.value,
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
  app.footer("example\n  nido experiment run grasp-learning --seed 2 --trials 5 --out out/grasp");
  nido::add_experiment_options(app, request);
  app.add_option("--attempts", request.attempts, "of each run")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--weights", request.weights, "folder to write grasp.txt of the first seed to");
  app.add_option("--domain", request.domain, "DDS domain")->check(CLI::Range(0, 101))->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::grasp::run(request));
}
