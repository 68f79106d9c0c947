#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/report/plot.h"

namespace nido {

// One number that a run found out.
struct Metric {
  double value = 0.0;                              // NaN becomes null
  std::string unit;                                // "m", "s", "px"; "" for pure numbers
  long n = 1;                                      // samples behind it
  std::optional<std::array<double, 2>> ci95 = {};  // 95 % interval
  std::optional<double> paper = {};                // the paper's figure
};
// A success rate with its Wilson interval.
Metric proportion_metric(int successes, int n, std::optional<double> paper = {});
// Median with its interval; mean with its interval.
Metric median_metric(const std::vector<double>& samples, const std::string& unit,
                     std::optional<double> paper = {});
Metric mean_metric(const std::vector<double>& samples, const std::string& unit,
                   std::optional<double> paper = {});

using Cell = std::variant<bool, double, std::string>;
using Row = std::vector<std::pair<std::string, Cell>>;  // key, value; in the order shown

// A picture beside the report.
struct Picture {
  std::string file;  // relative to the report
  std::string caption;
};

// One line of the story of a run.
struct StoryLine {
  double time_s = 0.0;  // of the run's clock
  std::string stage;
  std::string state;  // "begin", "done", "failed"
  std::string text;
  std::vector<Picture> pictures = {};
};

// Did an app run do its job?
struct Outcome {
  bool success = false;
  std::string stage;   // the last that was done, or the one that failed
  std::string heard;   // phrase
  std::string goal;    // "drop"
  std::string object;  // "blue cube"
  bool object_in_basket = false;
  std::string sentence;  // for people
};

struct ProcessRecord {
  std::string name;
  int restarts = 0;
};

// One experiment in a report of several.
struct ReportPart {
  std::string title;
  std::string summary;
  std::string command;
  std::string page;  // its own report, relative to this one
  std::vector<std::pair<std::string, Metric>> metrics = {};
  std::vector<Picture> pictures = {};  // relative to this report
};

// What a run leaves behind: report.json (schema 1, docs/report.md), report.html and pictures of the plots.
// A plain value.
struct Report {
  bool is_app = false;  // report.json says "app" instead of "experiment"
  std::string name;     // "goal-learning", "speech_and_action"
  std::string title;    // of the page; empty: the name
  std::string summary;  // a paragraph for people
  std::string command;  // that made it
  std::uint64_t seed = 1;
  long trials = 1;
  std::string robot;  // "icub_sim"; empty when none took part
  std::string world;
  double wall_s = 0.0;
  double sim_s = 0.0;  // 0 when there was no simulation
  std::vector<std::pair<std::string, Metric>> metrics;
  std::vector<Row> trials_detail;
  std::vector<ProcessRecord> processes;
  std::map<std::string, std::string> versions;  // standard_versions() are added by save()
  std::optional<Outcome> outcome;
  std::vector<StoryLine> story;
  std::vector<Plot> plots;
  std::vector<Picture> pictures = {};
  std::vector<ReportPart> parts = {};  // page only

  void add(const std::string& metric_name, const Metric& metric) {
    metrics.emplace_back(metric_name, metric);
  }
  [[nodiscard]] std::string to_json() const;
  [[nodiscard]] std::string to_html() const;
  // Makes the folder and writes everything, each file whole or not at all. kFailed with the path.
  [[nodiscard]] Status save(const std::string& folder) const;
};

// Saves the report of an experiment and prints what it found out: a line a metric, with interval and the
// paper's figure where there are some, then where the page is.
[[nodiscard]] Status save_and_print(const Report& report, const std::string& folder);

// nido, compiler and libraries that it was built with.
std::map<std::string, std::string> standard_versions();

}  // namespace nido
