#include "nido/report/report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

#include "nido/report/statistics.h"

namespace nido {

namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json interval(const std::optional<std::array<double, 2>>& ci95) {
  if (!ci95 || !std::isfinite((*ci95)[0]) || !std::isfinite((*ci95)[1])) return nullptr;
  return Json::array({(*ci95)[0], (*ci95)[1]});
}

// whole or not at all: a reader never meets half a file
Status write_whole(const std::filesystem::path& path, const std::string& content) {
  const std::filesystem::path draft = path.string() + fmt::format(".{}.part", getpid());
  std::ofstream stream(draft, std::ios::binary);
  stream << content;
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(draft, path, error);
  if (!stream || error) {
    std::error_code ignored;
    std::filesystem::remove(draft, ignored);
    return Error{
        ErrorCode::kFailed,
        fmt::format("cannot write {}: is the folder writable and the disk not full?", path.string())};
  }
  return {};
}

}  // namespace

Metric proportion_metric(int successes, int n, std::optional<double> paper) {
  const double value = n > 0 ? static_cast<double>(successes) / n : std::nan("");
  return {value, "", n, wilson_interval(successes, n), paper};
}

Metric median_metric(const std::vector<double>& samples, const std::string& unit,
                     std::optional<double> paper) {
  return {median(samples), unit, static_cast<long>(samples.size()), median_interval(samples), paper};
}

Metric mean_metric(const std::vector<double>& samples, const std::string& unit, std::optional<double> paper) {
  return {mean(samples), unit, static_cast<long>(samples.size()), mean_interval(samples), paper};
}

Status save_and_print(const Report& report, const std::string& folder) {
  if (Status saved = report.save(folder); !saved) return saved;
  std::size_t widest = 0;
  for (const auto& [name, metric] : report.metrics) widest = std::max(widest, name.size());
  for (const auto& [name, metric] : report.metrics) {
    std::string line = fmt::format("{:<{}}  {:.4f}", name, widest, metric.value);
    if (!metric.unit.empty()) line += " " + metric.unit;
    if (metric.ci95) {
      line += fmt::format("  ({:.4f} to {:.4f}, n = {})", (*metric.ci95)[0], (*metric.ci95)[1], metric.n);
    }
    if (metric.paper) line += fmt::format("  [paper {}]", *metric.paper);
    fmt::print("{}\n", line);
  }
  fmt::print("{}/report.html\n", folder);
  return {};
}

std::map<std::string, std::string> standard_versions() {
  return {{"nido", NIDO_VERSION},
          {"compiler", fmt::format("g++ {}", __VERSION__)},
          {"eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"opencv", CV_VERSION}};
}

std::string Report::to_json() const {
  Json json;
  json["schema"] = 1;
  json[is_app ? "app" : "experiment"] = name;
  json["seed"] = seed;
  json["trials"] = trials;
  json["robot"] = robot;
  json["world"] = world;
  json["wall_s"] = number(wall_s);
  json["sim_s"] = number(sim_s);
  json["metrics"] = Json::object();
  for (const auto& [metric_name, metric] : metrics) {
    json["metrics"][metric_name] = {{"value", number(metric.value)},
                                    {"unit", metric.unit},
                                    {"n", metric.n},
                                    {"ci95", interval(metric.ci95)},
                                    {"paper", metric.paper ? number(*metric.paper) : Json(nullptr)}};
  }
  json["trials_detail"] = Json::array();
  for (const Row& row : trials_detail) {
    Json entry = Json::object();
    for (const auto& [key, cell] : row) {
      std::visit(
          [&, &key = key](const auto& value) {
            if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
              entry[key] = number(value);
            } else {
              entry[key] = value;
            }
          },
          cell);
    }
    json["trials_detail"].push_back(entry);
  }
  json["title"] = title.empty() ? name : title;
  json["summary"] = summary;
  json["pictures"] = Json::array();
  for (const Plot& plot : plots)
    json["pictures"].push_back({{"file", plot.name + ".png"}, {"caption", plot.title}});
  for (const Picture& picture : pictures)
    json["pictures"].push_back({{"file", picture.file}, {"caption", picture.caption}});
  json["processes"] = Json::array();
  for (const ProcessRecord& process : processes) {
    json["processes"].push_back({{"name", process.name}, {"restarts", process.restarts}});
  }
  json["versions"] = Json::object();
  for (const auto& [what, version] : versions) json["versions"][what] = version;
  for (const auto& [what, version] : standard_versions()) json["versions"].emplace(what, version);
  json["command"] = command;
  if (outcome) {
    json["outcome"] = {{"success", outcome->success},  {"stage", outcome->stage},
                       {"heard", outcome->heard},      {"goal", outcome->goal},
                       {"object", outcome->object},    {"object_in_basket", outcome->object_in_basket},
                       {"sentence", outcome->sentence}};
  }
  if (!story.empty()) {
    json["story"] = Json::array();
    for (const StoryLine& line : story) {
      json["story"].push_back({{"time_s", number(line.time_s)},
                               {"stage", line.stage},
                               {"state", line.state},
                               {"text", line.text}});
    }
  }
  // whatever bytes a message carried, the file stays valid
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Status Report::save(const std::string& folder) const {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Error{ErrorCode::kFailed, fmt::format("cannot make the folder {}: {}", folder, error.message())};
  }
  for (const Plot& plot : plots) {
    const auto path = std::filesystem::path(folder) / (plot.name + ".png");
    if (Status status = plot_png(plot, path.string()); !status) return status;
  }
  if (Status status = write_whole(std::filesystem::path(folder) / "report.html", to_html()); !status)
    return status;
  return write_whole(std::filesystem::path(folder) / "report.json", to_json());
}

}  // namespace nido
