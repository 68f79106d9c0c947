// nido-experiment-reach-correction: a person leads the hand to where it should have reached; how far off it
// is before and after.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "nido/experiment/kept.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::reach {
namespace {

struct Request : ExperimentRequest {
  int block = 10;
  std::string hand = "right";
  int domain = kFreeDomain;
};

// What came of each start of the robot, by its number.
using Results = std::map<int, nlohmann::json>;

Result<nlohmann::json> lead(const Request& request, int block, int count, const Lane& lane) {
  const auto out =
      std::filesystem::absolute(std::filesystem::path(request.out) / fmt::format("block-{:02d}", block));
  const Status ran =
      run_app_once({"reach_correction",
                    in_lockstep(request.seed + 1000 * static_cast<std::uint64_t>(block),
                                {"--hand", request.hand, "--set", fmt::format("trials.trials={}", count)}),
                    out.string()},
                   lane);
  if (!ran) return ran.error();
  const auto file = out / "run" / "led_trials.json";
  std::ifstream stream(file);
  auto json = nlohmann::json::parse(stream, nullptr, false);
  const bool readable = json.is_object() && json.contains("trials") && json["trials"].is_array();
  if (!readable) return Error{ErrorCode::kFailed, file.string() + ": no results"};
  return json;
}

Report make_report(const Request& request, const Results& blocks) {
  Report report;
  report.name = "reach-correction";
  report.title = "What the hand learns from being led";
  report.summary = fmt::format(
      "The {} hand reaches for a ball. A person pushes it 2 to 4 cm to the side or down with a fist and "
      "leaves it "
      "there, while the arm yields; the hand goes home and reaches for the same ball again. The error is the "
      "palm's distance from where the person left it: of the reach before, and of the one after. The "
      "simulator "
      "moves the arm by contact alone and tells where the palm really is.",
      request.hand);
  report.command = fmt::format("nido experiment run reach-correction --seed {} --trials {}{}", request.seed,
                               request.trials, request.hand == "right" ? "" : " --hand " + request.hand);
  report.seed = request.seed;
  report.robot = "icub_sim_babbling";
  report.world = "empty";
  std::vector<double> before_m;
  std::vector<double> after_m;
  int others = 0;
  for (const auto& [block, result] : blocks) {
    report.sim_s += result.value("sim_s", 0.0);
    for (const auto& trial : result["trials"]) {
      Row row = {{"block", static_cast<double>(block)}, {"outcome", trial.value("outcome", "")}};
      if (trial.contains("after_m")) {
        before_m.push_back(trial["before_m"].get<double>());
        after_m.push_back(trial["after_m"].get<double>());
        row.emplace_back("before_m", before_m.back());
        row.emplace_back("after_m", after_m.back());
      } else {
        ++others;
      }
      report.trials_detail.push_back(row);
    }
  }
  report.trials = static_cast<long>(report.trials_detail.size());
  report.add("not_reached", {static_cast<double>(others), "", report.trials});
  if (after_m.empty()) return report;
  const auto n = static_cast<long>(after_m.size());
  report.add("error_before_m.median", median_metric(before_m, "m"));
  report.add("error_after_m.median", median_metric(after_m, "m"));
  report.add("error_after_m.p95", {quantile(after_m, 0.95), "m", n});
  report.add("error_after_m.max", {*std::ranges::max_element(after_m), "m", n});
  return report;
}

Status run(const Request& request) {
  Pieces pieces{.what = "reaches", .out = request.out, .jobs = request.jobs, .domain = request.domain};
  pieces.count = (request.trials + request.block - 1) / request.block;
  pieces.total = request.trials;
  return run_pieces<nlohmann::json>(
      pieces,
      [&](int block, const Lane& lane) {
        return lead(request, block, std::min(request.block, request.trials - block * request.block), lane);
      },
      [&](const Results& blocks) { return make_report(request, blocks); });
}

}  // namespace
}  // namespace nido::reach

int main(int argc, char** argv) {
  nido::reach::Request request;
  request.trials = 20;
  request.jobs = 2;
  request.out = "out/reach-correction";
  CLI::App app("Leads the hand to where it should have reached.", "nido-experiment-reach-correction");
  app.footer("example\n  nido experiment run reach-correction --trials 20 --out out/correction");
  nido::add_experiment_options(app, request);
  app.add_option("--block", request.block, "reaches that one start of the robot makes")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  nido::add_hand_option(app, request.hand);
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::reach::run(request));
}
