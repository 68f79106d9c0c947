// nido-experiment-grasp-success: how often things of all shapes are held for 3 s after lifting (the paper's
// Fig. 15), by the whole robot: eyes, reach, grasp and goal selection.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "nido/experiment/kept.h"
#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "success_core.h"

namespace nido::grasp {
namespace {

namespace fs = std::filesystem;

struct Request : ExperimentRequest {
  int block = 10;
  std::string hand = "right";
  int domain = kFreeDomain;
};

// Templates for the eyes: what they know, and the bodies of the unseen things, named as the robot can be
// told.
Status write_templates(const fs::path& path) {
  const auto places = find_places();
  if (!places) return places.error();
  const fs::path known = places->config / "objects" / "templates.yaml";
  YAML::Node file;
  try {
    file = YAML::LoadFile(known.string());
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, known.string() + ": " + e.what()};
  }
  YAML::Node cube;
  for (std::size_t i = 0; i < file["objects"].size(); ++i) {
    const YAML::Node object = file["objects"][i];
    if (object["name"].as<std::string>("") == "blue cube") cube.reset(object);
  }
  if (!cube["name"]) return Error{ErrorCode::kInvalidArgument, known.string() + ": there is no blue cube"};
  for (const double edge_m : unseen_boxes_m()) {
    YAML::Node box = YAML::Clone(cube);  // looks like the cube
    YAML::Node solid;
    for (int i = 0; i < 3; ++i) solid["box_m"].push_back(edge_m);
    for (int i = 0; i < 3; ++i) solid["at_m"].push_back(0.0);
    box["body"] = YAML::Node(YAML::NodeType::Sequence);
    box["body"].push_back(solid);
    file["objects"].push_back(box);
  }
  for (const auto& [diameter_m, height_m] : unseen_cylinders_m()) {
    YAML::Node tin;
    tin["name"] = "blue ball";  // taken like one
    tin["colour"] = "blue";
    tin["shape"] = "ball";
    tin["symmetry_deg"] = 0;
    YAML::Node solid;
    solid["cylinder_m"].push_back(diameter_m / 2);
    solid["cylinder_m"].push_back(height_m);
    for (int i = 0; i < 3; ++i) solid["at_m"].push_back(0.0);
    tin["body"].push_back(solid);
    file["objects"].push_back(tin);
  }
  std::ofstream out(path);
  out << file << '\n';
  return out ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path.string()}};
}

// Things first .. first + count - 1, through the app.
Result<std::vector<nlohmann::json>> try_block(const Request& request, int first, int count,
                                              const Lane& lane) {
  const fs::path out = fs::absolute(fs::path(request.out) / fmt::format("things-{:04d}", first));
  const fs::path results = out / "run" / "success.json";
  const auto read = [&]() {
    std::ifstream file(results);
    const auto rows = nlohmann::json::parse(file, nullptr, false);
    return rows.is_array() ? rows.get<std::vector<nlohmann::json>>() : std::vector<nlohmann::json>{};
  };
  std::error_code failure;
  fs::create_directories(out, failure);
  if (failure) return Error{ErrorCode::kFailed, out.string() + ": " + failure.message()};
  const fs::path templates = out / "templates.yaml";
  if (const Status written = write_templates(templates); !written) return written.error();
  const Status done =
      run_app_once({"grasp_success",
                    in_lockstep(request.seed, {"--hand", request.hand, "--set",
                                               fmt::format("grasp_success.first={}", first), "--set",
                                               "vision.templates=" + templates.string(), "--set",
                                               fmt::format("grasp_success.count={}", count)}),
                    out.string()},
                   lane);
  if (!done) return done.error();
  auto rows = read();
  if (static_cast<int>(rows.size()) != count)
    return Error{ErrorCode::kFailed,
                 fmt::format("{}: {} results of {}", results.string(), rows.size(), count)};
  return rows;
}

struct Count {
  int good = 0;
  int all = 0;
  void add(bool is_good) {
    good += is_good ? 1 : 0;
    ++all;
  }
};

Report make_report(const Request& request, const std::vector<nlohmann::json>& rows) {
  Report report;
  report.name = "grasp-success";
  report.title = "Grasping things of all shapes";
  report.summary = fmt::format(
      "A thing is put anywhere on the table where the {} hand takes things, turned any way; the robot is "
      "told to grasp "
      "it, finds it by sight, closes by touch, lifts, and tries again by itself when that fails. It must "
      "stay in the air "
      "for 3 s after the lift. Trained: cube of 5 cm, ball of 6 cm; unseen: boxes of 2.5 to 6 cm, cylinders "
      "of 3 to 6 cm, "
      "bear.",
      request.hand);
  report.command = fmt::format("nido experiment run grasp-success --seed {} --trials {}{}", request.seed,
                               request.trials, request.hand == "right" ? "" : " --hand " + request.hand);
  report.seed = request.seed;
  report.trials = static_cast<long>(rows.size());
  report.robot = "icub_sim";
  report.world = "grasp_success";
  Count all;
  Count first_try;
  Count honest;
  std::map<std::string, Count> by_shape;
  std::map<std::string, Count> by_training;
  int regrasps = 0;
  int slips = 0;
  for (const auto& row : rows) {
    const bool success = row["success"].get<bool>();
    const int closings = row["closings"].get<int>();
    all.add(success);
    first_try.add(success && closings == 1);
    honest.add(success == row["said_so"].get<bool>());
    by_shape[row["shape"].get<std::string>()].add(success);
    by_training[row["trained"].get<bool>() ? "trained" : "unseen"].add(success);
    regrasps += std::max(0, closings - 1);
    slips += row["slips_noticed"].get<int>();
    Row line;
    for (const char* key :
         {"number", "width_m", "height_m", "x_m", "y_m", "yaw_rad", "held_s", "closings", "slips_noticed"})
      line.emplace_back(key, row[key].get<double>());
    line.emplace_back("shape", row["shape"].get<std::string>());
    line.emplace_back("trained", row["trained"].get<bool>());
    line.emplace_back("success", success);
    line.emplace_back("sentence", row["sentence"].get<std::string>());
    report.trials_detail.push_back(line);
  }
  report.add("success_rate", proportion_metric(all.good, all.all));
  Plot plot{"success", "Fig. 15: held for 3 s after lifting", "", "share"};
  plot.y_range = {0.0, 1.1};
  plot.series.resize(1);
  const auto add = [&](const std::string& name, const Count& count) {
    const Metric rate = proportion_metric(count.good, count.all);
    report.add("success_rate." + name, rate);
    plot.series[0].points.push_back({static_cast<double>(plot.bar_names.size()), rate.value});
    plot.bar_names.push_back(name);
  };
  for (const auto& [name, count] : by_shape) add(name, count);
  for (const auto& [name, count] : by_training) add(name, count);
  report.add("success_rate_first_try", proportion_metric(first_try.good, first_try.all));
  report.add("belief_right", proportion_metric(honest.good, honest.all));
  report.add("regrasps", {static_cast<double>(regrasps), "", all.all});
  report.add("slips_noticed", {static_cast<double>(slips), "", all.all});
  report.plots = {plot};
  return report;
}

Status run(const Request& request) {
  Pieces pieces{.what = "grasping", .out = request.out, .jobs = request.jobs, .domain = request.domain};
  pieces.count = (request.trials + request.block - 1) / request.block;
  pieces.total = request.trials;
  using Rows = std::vector<nlohmann::json>;
  return run_pieces<Rows>(
      pieces,
      [&](int piece, const Lane& lane) {
        const int first = piece * request.block;
        return try_block(request, first, std::min(request.block, request.trials - first), lane);
      },
      [&](const std::map<int, Rows>& blocks) {
        Rows rows;
        for (const auto& [block, tried] : blocks) rows.insert(rows.end(), tried.begin(), tried.end());
        return make_report(request, rows);
      },
      [](const Report& report) {
        return fmt::format("{:.0f} % held", 100 * report.metrics.front().second.value);
      });
}

}  // namespace
}  // namespace nido::grasp

int main(int argc, char** argv) {
  nido::grasp::Request request;
  request.trials = 20;
  request.out = "out/grasp-success";
  CLI::App app("How often things of all shapes are held after lifting.", "nido-experiment-grasp-success");
  app.footer("example\n  nido experiment run grasp-success --trials 50 --jobs 2 --out out/grasp-success");
  nido::add_experiment_options(app, request);
  app.add_option("--block", request.block, "things that one start of the robot tries")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  nido::add_hand_option(app, request.hand);
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::grasp::run(request));
}
