// nido-experiment-teaching: things that a person shows and names, found and named afterwards among five
// others.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "doing.h"
#include "nido/experiment/kept.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"

namespace nido::vision {
namespace {

struct Request : ExperimentRequest {
  int block = 5;
  int doing = 6;
  int domain = kFreeDomain;
};

// What came of each block of lessons, by its number; those about what to do come after those about names, one
// by one.
using Rows = std::map<int, std::vector<nlohmann::json>>;

Result<std::vector<nlohmann::json>> teach(const Request& request, int block, int count, const Lane& lane) {
  const auto out =
      std::filesystem::absolute(std::filesystem::path(request.out) / fmt::format("block-{:02d}", block));
  const Status done = run_app_once({"teaching",
                                    in_lockstep(request.seed + static_cast<std::uint64_t>(block),
                                                {"--set", fmt::format("teaching_trials.count={}", count)}),
                                    out.string()},
                                   lane);
  if (!done) return done.error();
  const auto file = out / "run" / "teaching.json";
  std::ifstream stream(file);
  const auto rows = nlohmann::json::parse(stream, nullptr, false);
  if (!rows.is_array() || static_cast<int>(rows.size()) != count)
    return Error{ErrorCode::kFailed, fmt::format("{}: not {} results", file.string(), count)};
  return rows.get<std::vector<nlohmann::json>>();
}

Row deed_row(const nlohmann::json& deed) {
  Row row;
  for (const char* key : {"thing", "name", "order"}) row.emplace_back(key, deed[key].get<std::string>());
  for (const char* key : {"presentations", "said"}) row.emplace_back(key, deed[key].get<double>());
  for (const char* key : {"learned", "done_right"}) row.emplace_back(key, deed[key].get<bool>());
  row.emplace_back("sentence", deed["sentence"].get<std::string>());
  return row;
}

Report make_report(const Request& request, const Rows& blocks) {
  Report report;
  report.name = "teaching";
  report.title = "Things that are shown and named";
  report.summary =
      "A person puts a thing that the robot does not know before its eyes and says \"this is a banana\". The "
      "robot hears the name, learns colour, shape and size from six pairs of pictures, and afterwards has to "
      "find and name the thing among five others, which it knew before or was taught before. At most three "
      "presentations. Every block of lessons begins with a robot that knows nothing of them. Then other "
      "things "
      "are shown, named, and the person says what to do with them; a robot that is switched on anew hears "
      "the "
      "bare name, and has to do it with the thing in another place.";
  report.command = fmt::format("nido experiment run teaching --seed {} --trials {} --doing {}", request.seed,
                               request.trials, request.doing);
  report.seed = request.seed;
  report.robot = "icub_sim";
  report.world = "teaching";
  int trials = 0;
  int named = 0;
  int others = 0;
  int wrong = 0;
  int deeds = 0;
  int done = 0;
  std::vector<double> deed_presentations;
  std::vector<double> presentations;
  std::vector<double> errors_m;
  for (const auto& [block, rows] : blocks) {
    for (const auto& row : rows) {
      if (row.contains("order")) {
        ++deeds;
        done += row["done_right"].get<bool>() ? 1 : 0;
        deed_presentations.push_back(row["presentations"].get<double>());
        report.trials_detail.push_back(deed_row(row));
        continue;
      }
      const bool right = row["named_right"].get<bool>();
      ++trials;
      named += right ? 1 : 0;
      others += row["others_named_right"].get<int>();
      wrong += row["wrong_names"].get<int>();
      presentations.push_back(row["presentations"].get<double>());
      if (right) errors_m.push_back(row["position_error_m"].get<double>());
      Row line = {{"block", static_cast<double>(block)}};
      for (const char* key : {"thing", "name", "heard", "taught"})
        line.emplace_back(key, row[key].get<std::string>());
      line.emplace_back("named_right", right);
      for (const char* key : {"presentations", "position_error_m", "others_named_right", "wrong_names"})
        line.emplace_back(key, row[key].get<double>());
      report.trials_detail.push_back(line);
    }
  }
  report.trials = trials;
  if (deeds > 0) {
    report.add("done_right", proportion_metric(done, deeds));
    report.add("done_right.presentations", mean_metric(deed_presentations, ""));
  }
  if (trials == 0) return report;
  report.add("named_right", proportion_metric(named, trials));
  report.add("presentations", mean_metric(presentations, ""));
  if (!errors_m.empty()) report.add("position_error_m", median_metric(errors_m, "m"));
  report.add("others_named_right", proportion_metric(others, 5 * trials));
  report.add("wrong_names", {static_cast<double>(wrong), "", 6L * trials});
  return report;
}

Status run(const Request& request) {
  Pieces pieces{.what = "teaching", .out = request.out, .jobs = request.jobs, .domain = request.domain};
  const int blocks = (request.trials + request.block - 1) / request.block;
  pieces.count = blocks + request.doing;
  pieces.total = request.trials + request.doing;
  pieces.progress = [](const Report& report) { return static_cast<long>(report.trials_detail.size()); };
  return run_pieces<std::vector<nlohmann::json>>(
      pieces,
      [&](int block, const Lane& lane) -> Result<std::vector<nlohmann::json>> {
        if (block >= blocks) {
          const int number = block - blocks;
          auto deed = teach_deed(
              draw_deed(request.seed, number), request.seed,
              (std::filesystem::path(request.out) / fmt::format("doing-{:02d}", number)).string(), lane);
          if (!deed) return deed.error();
          return std::vector<nlohmann::json>{std::move(*deed)};
        }
        return teach(request, block, std::min(request.block, request.trials - block * request.block), lane);
      },
      [&](const Rows& rows) { return make_report(request, rows); });
}

}  // namespace
}  // namespace nido::vision

int main(int argc, char** argv) {
  nido::vision::Request request;
  request.trials = 20;
  request.jobs = 2;
  request.out = "out/teaching";
  CLI::App app("Teaches the robot things by showing and naming them.", "nido-experiment-teaching");
  app.footer("example\n  nido experiment run teaching --trials 20 --out out/teaching");
  nido::add_experiment_options(app, request);
  app.add_option("--block", request.block, "things that one robot is taught, at most 6")
      ->check(CLI::Range(1, 6))
      ->capture_default_str();
  app.add_option("--doing", request.doing, "things about which it is taught what to do")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::vision::run(request));
}
