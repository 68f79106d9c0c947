// nido-experiment-reach-accuracy: how near the hand comes to things at random places that only the cameras
// see (the paper's Fig. 10), with the paper's network alone and with the learned controller.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "changed_body.h"
#include "nido/experiment/kept.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::reach {
namespace {

struct Request : ExperimentRequest {
  int block = 31;
  std::string hand = "right";
  std::string change = "none";  // of the body, that nobody tells the robot of
  int domain = kFreeDomain;
};

struct Controller {
  const char* name;    // parameter of reach
  const char* prefix;  // of its metrics
  const char* title;
};
constexpr Controller kControllers[] = {{"learned", "", "learned controller"},
                                       {"network", "paper_network.", "the paper's network alone"}};

// One start of the robot: balls at places that its seed draws.
struct Block {
  Controller controller;
  std::uint64_t seed = 1;
  int balls = 0;
};

std::vector<Block> blocks(const Request& request) {
  std::vector<Block> all;
  for (const Controller& controller : kControllers) {
    for (int first = 0; first < request.trials; first += request.block) {
      all.push_back({controller, request.seed + 1000 * static_cast<std::uint64_t>(first / request.block),
                     std::min(request.block, request.trials - first)});
    }
  }
  return all;
}

std::filesystem::path changed_folder(const Request& request) {
  return std::filesystem::absolute(std::filesystem::path(request.out) / "body");
}

Result<nlohmann::json> trials_of(const Request& request, const Block& block, const std::string& robot,
                                 const Lane& lane) {
  const std::filesystem::path out = std::filesystem::absolute(
      std::filesystem::path(request.out) / fmt::format("{}-{}", block.controller.name, block.seed));
  const std::filesystem::path file = out / "trials.json";
  const Status ran =
      run_app_once({"reach_accuracy",
                    in_lockstep(block.seed, {"--robot", robot, "--hand", request.hand, "--set",
                                             fmt::format("trials.trials={}", block.balls), "--set",
                                             fmt::format("trials.file={}", file.string()), "--set",
                                             fmt::format("reach.controller={}", block.controller.name)}),
                    out.string()},
                   lane);
  if (!ran) return ran.error();
  std::ifstream stream(file);
  auto json = nlohmann::json::parse(stream, nullptr, false);
  const bool readable = json.is_object() && json.contains("trials") && json["trials"].is_array();
  if (!readable) return Error{ErrorCode::kFailed, file.string() + ": no results"};
  return json;
}

// What came of the blocks, by their numbers.
using Results = std::map<int, nlohmann::json>;

Report make_report(const Request& request, const Results& done) {
  Report report;
  report.name = "reach-accuracy";
  report.title = fmt::format("How near the {} hand comes", request.hand);
  report.summary =
      "A ball hangs at random places in the air. The robot finds it with its cameras and brings the mark on "
      "the back of its "
      "hand to the ball's middle; the simulator tells how far off the mark really is. The ball touches "
      "nothing. Once with the "
      "network of the paper alone, once with the learned model of the seen hand in inverse kinematics and "
      "the eyes' correction.";
  if (request.change != "none") {
    report.summary += fmt::format(
        " The body was changed ({}) and the robot was not told: `hand_error_m.first` is the first ball of "
        "each "
        "start, the other figures are those of the balls after it.",
        request.change == "eyes" ? "both eyes tilted by 6 degrees" : "the forearm is 2 cm longer");
  }
  report.command = fmt::format("nido experiment run reach-accuracy --seed {} --trials {}{}{}", request.seed,
                               request.trials, request.hand == "right" ? "" : " --hand " + request.hand,
                               request.change == "none" ? "" : " --change " + request.change);
  report.seed = request.seed;
  report.trials = request.trials;
  report.robot = "icub_sim_babbling";
  report.world = "empty";
  const std::vector<Block> all = blocks(request);
  for (const Controller& controller : kControllers) {
    nlohmann::json trials = nlohmann::json::array();
    std::vector<double> first_errors;  // of a changed body
    for (const auto& [block, result] : done) {
      if (std::string_view(all[static_cast<std::size_t>(block)].controller.name) != controller.name) continue;
      report.sim_s += result.value("sim_s", 0.0);
      bool first = request.change != "none";
      for (const auto& trial : result["trials"]) {
        if (first && trial.contains("hand_error_m")) {
          first_errors.push_back(trial["hand_error_m"].get<double>());
        } else {
          trials.push_back(trial);
        }
        first = false;
      }
    }
    std::vector<double> errors;
    std::vector<double> seen_errors;
    std::array<Plot, 3> plots;
    const char* const axes[] = {"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      plots[axis] = {
          fmt::format("{}-{}", controller.name, axes[axis]),
          fmt::format("Fig. 10: {}, wanted and reached {} (root frame)", controller.title, axes[axis]),
          "ball", fmt::format("{} (m)", axes[axis])};
      plots[axis].series = {{"ball", {}, false}, {"hand", {}, false}};
    }
    int not_seen = 0;
    for (const auto& trial : trials) {
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
    if (n == 0) continue;  // not yet
    if (!first_errors.empty()) report.add(prefix + "hand_error_m.first", median_metric(first_errors, "m"));
    report.add(prefix + "hand_error_m.median", median_metric(errors, "m"));
    report.add(prefix + "hand_error_m.p95", {quantile(errors, 0.95), "m", n});
    report.add(prefix + "hand_error_m.max", {*std::ranges::max_element(errors), "m", n});
    report.add(prefix + "seen_error_m.median", median_metric(seen_errors, "m"));
    report.add(prefix + "not_seen", {static_cast<double>(not_seen), "", n + not_seen});
    for (Plot& plot : plots) report.plots.push_back(std::move(plot));
  }
  return report;
}

Status run(const Request& request) {
  std::string robot = "icub_sim_babbling";
  if (request.change != "none") {
    auto changed = write_changed_robot(request.change, request.hand, changed_folder(request));
    if (!changed) return changed.error();
    robot = std::move(*changed);
  }
  const std::vector<Block> all = blocks(request);
  Pieces pieces{.what = "balls", .out = request.out, .jobs = request.jobs, .domain = request.domain};
  pieces.count = static_cast<int>(all.size());
  pieces.total = 2L * request.trials;
  pieces.progress = [](const Report& report) { return static_cast<long>(report.trials_detail.size()); };
  return run_pieces<nlohmann::json>(
      pieces,
      [&](int piece, const Lane& lane) {
        return trials_of(request, all[static_cast<std::size_t>(piece)], robot, lane);
      },
      [&](const Results& done) { return make_report(request, done); });
}

}  // namespace
}  // namespace nido::reach

int main(int argc, char** argv) {
  nido::reach::Request request;
  request.trials = 62;
  request.jobs = 2;
  request.out = "out/reach-accuracy";
  CLI::App app("How near the hand comes to what the eyes see.", "nido-experiment-reach-accuracy");
  app.footer(
      "example\n  nido experiment run reach-accuracy --seed 1 --trials 62 --out out/accuracy\n"
      "  nido experiment run reach-accuracy --hand left");
  nido::add_experiment_options(app, request);
  app.add_option("--block", request.block, "balls that one start of the robot gets")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  nido::add_hand_option(app, request.hand);
  app.add_option(
         "--change", request.change,
         "of the body, that the robot is not told of: its forearm becomes 2 cm longer, or its eyes are "
         "knocked by 6 degrees")
      ->check(CLI::IsMember({"none", "forearm", "eyes"}))
      ->capture_default_str();
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::reach::run(request));
}
