#include "run_report.h"

#include <fstream>
#include <nlohmann/json.hpp>

namespace nido {
namespace fs = std::filesystem;

std::optional<RunEnd> outcome_in_report(const fs::path& folder) {
  std::ifstream file(folder / "report.json");
  const auto report = nlohmann::json::parse(file, nullptr, false);
  if (report.is_discarded() || !report.is_object() || !report.contains("outcome")) return std::nullopt;
  const auto& outcome = report["outcome"];
  if (!outcome.is_object() || !outcome.contains("success") || !outcome["success"].is_boolean())
    return std::nullopt;
  const bool success = outcome["success"].get<bool>();
  const std::string stage =
      outcome.contains("stage") && outcome["stage"].is_string() ? outcome["stage"].get<std::string>() : "";
  return RunEnd{success ? 0 : 1, success ? "the job is done" : "the job failed at stage '" + stage + "'"};
}

void finish_report(const fs::path& folder, const std::vector<std::pair<std::string, int>>& restarts,
                   double wall_s) {
  const fs::path path = folder / "report.json";
  std::ifstream file(path);
  if (!file) return;
  auto report = nlohmann::ordered_json::parse(file, nullptr, false);
  if (report.is_discarded() || !report.is_object()) return;
  auto processes = nlohmann::ordered_json::array();
  for (const auto& [name, count] : restarts) {
    processes.push_back({{"name", name}, {"restarts", count}});
  }
  report["processes"] = processes;
  report["wall_s"] = wall_s;
  // written beside and moved: a reader sees the old or the new one
  const fs::path fresh = folder / ".report.json.new";
  std::ofstream out(fresh);
  out << report.dump(2) << '\n';
  out.close();
  std::error_code ignored;
  if (out) fs::rename(fresh, path, ignored);
}

}  // namespace nido
