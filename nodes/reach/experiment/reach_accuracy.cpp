// nido-experiment-reach-accuracy: how near the hand comes to things at random places that only the cameras
// see (the paper's Fig. 10), with the paper's network alone and with the learned controller.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nido/experiment/launched_app.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::reach {
namespace {

struct Request : ExperimentRequest {
  int domain = 51;
};

struct Controller {
  const char* name;    // parameter of reach
  const char* prefix;  // of its metrics
  const char* title;
};
constexpr Controller kControllers[] = {{"learned", "", "learned controller"},
                                       {"network", "paper_network.", "the paper's network alone"}};

Result<nlohmann::json> trials_of(const Request& request, const Controller& controller) {
  const std::filesystem::path out = std::filesystem::absolute(request.out);
  const std::filesystem::path file = out / fmt::format("trials_{}.json", controller.name);
  fmt::print("{}: {} balls\n", controller.title, request.trials);
  std::fflush(stdout);
  const Status ran = run_app(
      "reach_accuracy",
      {"--seed", std::to_string(request.seed), "--rate", "max", "--lockstep", "--domain",
       std::to_string(request.domain), "--out", (out / controller.name).string(), "--set",
       fmt::format("trials.trials={}", request.trials), "--set", fmt::format("trials.file={}", file.string()),
       "--set", fmt::format("reach.controller={}", controller.name)},
      (out / fmt::format("{}.log", controller.name)).string());
  std::ifstream stream(file);
  auto json = nlohmann::json::parse(stream, nullptr, false);
  const bool readable = json.is_object() && json.contains("trials") && json["trials"].is_array();
  if (!ran && !(ran.error().code == ErrorCode::kInterrupted && readable)) return ran.error();
  if (!readable) return Error{ErrorCode::kFailed, file.string() + ": no results"};
  return json;
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  std::error_code failure;
  std::filesystem::create_directories(request.out, failure);
  if (failure) return Error{ErrorCode::kFailed, request.out + ": " + failure.message()};
  Report report;
  report.name = "reach-accuracy";
  report.title = "How near the hand comes";
  report.summary =
      "A ball hangs at random places in the air. The robot finds it with its cameras and brings the mark on "
      "the back of its "
      "hand to the ball's middle; the simulator tells how far off the mark really is. The ball touches "
      "nothing. Once with the "
      "network of the paper alone, once with the learned model of the seen hand in inverse kinematics and "
      "the eyes' correction.";
  report.command =
      fmt::format("nido experiment run reach-accuracy --seed {} --trials {}", request.seed, request.trials);
  report.seed = request.seed;
  report.trials = request.trials;
  report.robot = "icub_sim";
  report.world = "empty";
  for (const Controller& controller : kControllers) {
    auto json = trials_of(request, controller);
    if (!json) return json.error();
    report.sim_s += json->value("sim_s", 0.0);
    std::vector<double> errors;
    std::vector<double> seen_errors;
    std::array<Plot, 3> plots;
    const char* const axes[] = {"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      plots[axis] = {fmt::format("{}-{}", controller.name, axes[axis]),
                     fmt::format("{}: wanted and reached {} (root frame)", controller.title, axes[axis]),
                     "ball", fmt::format("{} (m)", axes[axis])};
      plots[axis].series = {{"ball", {}, false}, {"hand", {}, false}};
    }
    int not_seen = 0;
    for (const auto& trial : (*json)["trials"]) {
      Row row = {{"controller", std::string(controller.name)}, {"outcome", trial.value("outcome", "")}};
      if (!trial.contains("hand_error_m")) {
        ++not_seen;
        report.trials_detail.push_back(row);
        continue;
      }
      const auto number = static_cast<double>(errors.size());
      errors.push_back(trial["hand_error_m"].get<double>());
      seen_errors.push_back(trial["seen_error_m"].get<double>());
      row.emplace_back("hand_error_m", errors.back());
      row.emplace_back("seen_error_m", seen_errors.back());
      row.emplace_back("duration_s", trial["duration_s"].get<double>());
      report.trials_detail.push_back(row);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        plots[axis].series[0].points.push_back({number, trial["object"][axis].get<double>()});
        plots[axis].series[1].points.push_back({number, trial["hand"][axis].get<double>()});
      }
    }
    const std::string prefix = controller.prefix;
    const auto n = static_cast<long>(errors.size());
    if (n == 0) return Error{ErrorCode::kFailed, fmt::format("{}: no ball was seen", controller.title)};
    report.add(prefix + "hand_error_m.median", median_metric(errors, "m"));
    report.add(prefix + "hand_error_m.p95", {quantile(errors, 0.95), "m", n});
    report.add(prefix + "hand_error_m.max", {*std::ranges::max_element(errors), "m", n});
    report.add(prefix + "seen_error_m.median", median_metric(seen_errors, "m"));
    report.add(prefix + "not_seen", {static_cast<double>(not_seen), "", n + not_seen});
    for (Plot& plot : plots) report.plots.push_back(std::move(plot));
  }
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return save_and_print(report, request.out);
}

}  // namespace
}  // namespace nido::reach

int main(int argc, char** argv) {
  nido::reach::Request request;
  request.trials = 62;
  request.out = "out/reach-accuracy";
  CLI::App app("How near the hand comes to what the eyes see.", "nido-experiment-reach-accuracy");
  app.footer("example\n  nido experiment run reach-accuracy --seed 1 --trials 62 --out out/accuracy");
  nido::add_experiment_options(app, request);
  app.add_option("--domain", request.domain, "DDS domain of the runs")
      ->check(CLI::Range(0, 101))
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::reach::run(request));
}
