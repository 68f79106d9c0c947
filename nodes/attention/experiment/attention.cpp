// nido-experiment-attention: how well the robot holds on to things with its eyes, and how well it tells which
// pixels they are (the paper's Section VI), beside two simpler ways in the same scenes.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "nido/experiment/domain.h"
#include "nido/experiment/kept.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido::attention {
namespace {

namespace fs = std::filesystem;
using Rows = std::vector<nlohmann::json>;

struct Request : ExperimentRequest {
  int domain = kFreeDomain;
  int block = 4;
  bool baseline = true;
};

// What one way of finding the surface did in the scenes.
struct Played {
  Rows rows;
  std::vector<double> work_s;  // wall time of each pair of pictures
};

nlohmann::json read_json(const fs::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file, nullptr, false);
}

// Scenes first .. first + count - 1, added to what was played before.
Status play(const Request& request, const Lane& lane, const std::string& method, int first, int count,
            Played& played) {
  const fs::path out = fs::absolute(fs::path(request.out) / fmt::format("{}-{:03d}", method, first));
  const Status done =
      run_app_once({"attention",
                    in_lockstep(request.seed, {"--set", "attention.method=" + method, "--set",
                                               fmt::format("attention_trials.first={}", first), "--set",
                                               fmt::format("attention_trials.count={}", count)}),
                    out.string()},
                   lane);
  if (!done) return done.error();
  const auto rows = read_json(out / "run" / "attention.json");
  if (!rows.is_array() || static_cast<int>(rows.size()) != count) {
    return Error{ErrorCode::kFailed, fmt::format("{}: {} results of {}", (out / "run").string(),
                                                 rows.is_array() ? rows.size() : 0, count)};
  }
  for (auto row : rows) {
    row["picture"] =
        fs::relative(out / "run" / row["picture"].get<std::string>(), fs::absolute(request.out)).string();
    row["method"] = method;
    played.rows.push_back(row);
  }
  const auto times = read_json(out / "run" / "times.json");
  if (times.is_object()) {
    for (const double s : times["work_s"]) played.work_s.push_back(s);
  }
  return {};
}

using Choice = std::function<bool(const nlohmann::json&)>;

std::vector<double> values(const Rows& rows, const char* key, const Choice& choice) {
  std::vector<double> out;
  for (const auto& row : rows) {
    if (choice(row)) out.push_back(row[key].get<double>());
  }
  return out;
}

Report make_report(const Request& request, const Played& field, const Played& colour) {
  Report report;
  report.name = "attention";
  report.title = "Holding on to a thing with the eyes";
  report.summary =
      "The robot is told once roughly where to look. From then on it keeps the surface that it found there "
      "in "
      "the middle of both pictures and says which pixels belong to it, without knowledge of colour, shape or "
      "motion. Things rest on the table or move freely above it, alone or among others. The judge compares "
      "with the true pose: distance of the thing's centre from the middle of both pictures, and overlap "
      "(intersection over union) of the segment with the true silhouette, for every pair of pictures from "
      "1.5 s on. Beside it: disparity alone (the same pictures, no field, no memory), and back-projection of "
      "the colours that were in the middle at the start (the same scenes, its own run).";
  report.command =
      fmt::format("nido experiment run attention --seed {} --trials {}", request.seed, request.trials);
  report.seed = request.seed;
  report.trials = static_cast<long>(field.rows.size());
  report.robot = "icub_sim";
  report.world = "attention";
  const auto all = [](const nlohmann::json&) { return true; };
  const auto still = [](const nlohmann::json& row) { return !row["moving"].get<bool>(); };
  const auto moving = [](const nlohmann::json& row) { return row["moving"].get<bool>(); };
  const auto add = [&](const std::string& name, const Rows& rows, const char* key, const std::string& unit,
                       const Choice& choice) {
    const auto samples = values(rows, key, choice);
    if (!samples.empty()) report.add(name, mean_metric(samples, unit));
  };
  add("fixation_error_px", field.rows, "fixation_error_px", "px", all);
  add("iou_static", field.rows, "iou", "", still);
  add("iou_moving", field.rows, "iou", "", moving);
  if (!field.work_s.empty()) {
    // the interval belongs to the median's time
    const auto [low_s, high_s] = median_interval(field.work_s);
    Metric fps{1 / median(field.work_s), "1/s", static_cast<long>(field.work_s.size())};
    fps.ci95 = {{1 / high_s, 1 / low_s}};
    report.add("fps", fps);
  }
  add("fixation_error_px.static", field.rows, "fixation_error_px", "px", still);
  add("fixation_error_px.moving", field.rows, "fixation_error_px", "px", moving);
  for (const bool clutter : {false, true}) {
    const auto both = [clutter](const Choice& choice) {
      return [clutter, choice](const nlohmann::json& row) {
        return choice(row) && row["clutter"].get<bool>() == clutter;
      };
    };
    const std::string tail = clutter ? ".clutter" : ".alone";
    add("iou_static" + tail, field.rows, "iou", "", both(still));
    add("iou_moving" + tail, field.rows, "iou", "", both(moving));
  }
  long lost = 0;
  long pairs = 0;
  for (const auto& row : field.rows) {
    lost += row["lost"].get<long>();
    pairs += row["pairs"].get<long>();
  }
  report.add("lost_share",
             {pairs > 0 ? static_cast<double>(lost) / static_cast<double>(pairs) : 0.0, "", pairs});
  add("iou_static.disparity_alone", field.rows, "iou_threshold", "", still);
  add("iou_moving.disparity_alone", field.rows, "iou_threshold", "", moving);
  add("fixation_error_px.colour", colour.rows, "fixation_error_px", "px", all);
  add("iou_static.colour", colour.rows, "iou", "", still);
  add("iou_moving.colour", colour.rows, "iou", "", moving);

  Plot plot{"overlap", "Overlap with the true silhouette", "", "intersection over union"};
  plot.y_range = {0.0, 1.0};
  plot.series.resize(1);
  for (const auto& [name, metric] : report.metrics) {
    if (name.rfind("iou_", 0) != 0 || name.ends_with(".alone") || name.ends_with(".clutter")) continue;
    plot.series[0].points.push_back({static_cast<double>(plot.bar_names.size()), metric.value});
    plot.bar_names.push_back(name.substr(4));
  }
  report.plots = {plot};
  for (const Played* played : {&field, &colour}) {
    for (const auto& row : played->rows) {
      Row line;
      line.emplace_back("method", row["method"].get<std::string>());
      for (const char* key : {"number", "pairs", "lost", "fixation_error_px", "iou", "iou_threshold"})
        line.emplace_back(key, row[key].get<double>());
      line.emplace_back("thing", row["thing"].get<std::string>());
      line.emplace_back("moving", row["moving"].get<bool>());
      line.emplace_back("clutter", row["clutter"].get<bool>());
      report.trials_detail.push_back(line);
      if (played == &field && report.pictures.size() < 24) {
        report.pictures.push_back(
            {row["picture"].get<std::string>(),
             fmt::format("scene {}, {} {}: overlap {:.2f}; segment magenta, truth white",
                         row["number"].get<int>(), row["moving"].get<bool>() ? "moving" : "static",
                         row["thing"].get<std::string>(), row["iou"].get<double>())});
      }
    }
  }
  return report;
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  Played field;
  Played colour;
  Status failure;
  const auto domains = take_domains(request.domain, 1);
  if (!domains) return domains.error();
  const auto report_now = [&] {
    Report report = make_report(request, field, colour);
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return report;
  };
  const InterruptFlag interrupt;
  const Lane lane{domains->front().number(), interrupt};
  const int runs = request.baseline ? 2 : 1;
  ProgressBar progress("scenes", static_cast<long>(request.trials) * runs);
  for (int first = 0; first < request.trials && failure && !interrupt.raised(); first += request.block) {
    const int count = std::min(request.block, request.trials - first);
    failure = play(request, lane, "field", first, count, field);
    if (failure && request.baseline && !interrupt.raised())
      failure = play(request, lane, "colour", first, count, colour);
    if (field.rows.empty()) continue;
    if (const Status saved = report_now().save(request.out); !saved && failure) failure = saved;
    progress.update(static_cast<long>(field.rows.size() + colour.rows.size()));
  }
  return end_of_run(report_now(), request.out, field.rows.empty(), interrupt.raised(), failure);
}

}  // namespace
}  // namespace nido::attention

int main(int argc, char** argv) {
  nido::attention::Request request;
  request.trials = 16;
  request.out = "out/attention";
  CLI::App app("How well the robot keeps its eyes on things, and tells which pixels they are.",
               "nido-experiment-attention");
  app.footer("example\n  nido experiment run attention --trials 8 --out out/attention");
  nido::add_experiment_options(app, request);
  app.add_option("--block", request.block, "scenes that one start of the robot plays")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--baseline", request.baseline, "play all scenes again with colours alone")
      ->capture_default_str();
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::attention::run(request));
}
