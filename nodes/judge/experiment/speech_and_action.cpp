// nido-experiment-speech-and-action: runs the whole system again and again, with other seeds and phrases,
// under several conditions, and reports how often it did what it was told (the paper's Section IV, Fig. 19).

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "condition.h"
#include "nido/experiment/kept.h"
#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"
#include "nido/speech/phrases.h"

namespace nido {
namespace {

namespace fs = std::filesystem;

struct Request : ExperimentRequest {
  std::vector<std::string> say = {"all"};
  std::vector<std::string> conditions = {"normal"};
  Condition own{.name = ""};  // by --light, --table-raise, --camera-noise
  std::string app = "speech_and_action";
  std::string world = "random_table";
  std::string robot = "icub_sim";
  std::vector<std::string> app_set;  // KEY=VALUE, for the app
  bool fresh = false;                // forget the trials of an earlier run
  int domain = kFreeDomain;          // of the first job
  double limit_s = 600.0;            // of wall time for one trial
};

// stages in their order, and whether a verb has them
const std::vector<std::pair<std::string, int>>& stages() {
  static const std::vector<std::pair<std::string, int>> list = {
      {"heard", 0},   {"chosen", 0},  {"seen", 0},   {"reached", 1},
      {"grasped", 2}, {"carried", 3}, {"dropped", 3}};
  return list;
}

struct Trial {
  int number = 0;
  std::uint64_t seed = 0;
  std::string phrase;
  std::string condition;
  fs::path folder;
  // filled in when it is over
  bool success = false;
  std::string stage;
  std::string sentence;
  std::map<std::string, double> metrics;
  double wall_s = 0.0;
  double sim_s = 0.0;
};

// What the trial's own report says.
void read_outcome(Trial& trial) {
  std::ifstream file(trial.folder / "run" / "report.json");
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded() || !json.contains("outcome")) {
    trial.stage = "start";
    trial.sentence = fmt::format("there is no report in {}", trial.folder.string());
    return;
  }
  const auto& outcome = json["outcome"];
  trial.success = outcome.value("success", false);
  trial.stage = outcome.value("stage", "");
  trial.sentence = outcome.value("sentence", "");
  trial.sim_s = json["sim_s"].is_number() ? json["sim_s"].get<double>() : 0.0;
  trial.wall_s = json["wall_s"].is_number() ? json["wall_s"].get<double>() : 0.0;
  for (const auto& [name, metric] : json["metrics"].items()) {
    if (metric["value"].is_number()) trial.metrics[name] = metric["value"].get<double>();
  }
}

std::string verb_of(const std::string& phrase) {
  const std::string first = phrase.substr(0, phrase.find(' '));
  for (const Verb verb : kAllVerbs) {
    if (first == verb_name(verb)) return first;
  }
  return "look";
}

int verb_rank(const std::string& phrase) {
  const std::string verb = verb_of(phrase);
  return verb == "reach" ? 1 : verb == "grasp" ? 2 : verb == "drop" ? 3 : 0;
}

std::string key_of(std::string phrase) {
  std::replace(phrase.begin(), phrase.end(), ' ', '_');
  return phrase;
}

// Adds how often the trials of a condition did what was said, in all, by phrase and by stage; the names of
// metrics begin with `prefix`.
void add_condition(Report& report, const std::vector<const Trial*>& trials, const std::string& prefix,
                   const std::string& title) {
  const int count = static_cast<int>(trials.size());
  int successes = 0;
  std::map<std::string, std::pair<int, int>> by_phrase;  // successes, trials
  std::map<std::string, std::pair<int, int>> by_stage;
  std::map<std::string, int> failed_at;
  std::vector<double> factors;
  std::vector<double> durations_s;
  for (const Trial* trial : trials) {
    successes += trial->success ? 1 : 0;
    auto& phrase = by_phrase[trial->phrase];
    phrase.first += trial->success ? 1 : 0;
    ++phrase.second;
    for (const auto& [stage, rank] : stages()) {
      if (rank > verb_rank(trial->phrase)) continue;
      auto& counts = by_stage[stage];
      counts.first += trial->metrics.contains("time_to_" + stage + "_s") ? 1 : 0;
      ++counts.second;
    }
    if (!trial->success) ++failed_at[trial->stage];
    if (const auto factor = trial->metrics.find("real_time_factor"); factor != trial->metrics.end()) {
      factors.push_back(factor->second);
    }
    durations_s.push_back(trial->sim_s);
  }
  report.add(prefix + "success_rate", proportion_metric(successes, count));
  for (const auto& [phrase, counts] : by_phrase) {
    report.add(prefix + "success_rate." + key_of(phrase), proportion_metric(counts.first, counts.second));
  }
  Plot plot{prefix + "stages", "Fig. 19: trials that got so far" + title, "", "share"};
  plot.y_range = {0.0, 1.1};
  plot.series.resize(1);
  for (const auto& [stage, rank] : stages()) {
    const auto found = by_stage.find(stage);
    if (found == by_stage.end()) continue;
    const Metric rate = proportion_metric(found->second.first, found->second.second);
    report.add(prefix + "stage_rate." + stage, rate);
    plot.series[0].points.push_back({static_cast<double>(plot.bar_names.size()), rate.value});
    plot.bar_names.push_back(stage);
  }
  for (const auto& [stage, times] : failed_at) {
    report.add(prefix + "failed_at." + stage, Metric{static_cast<double>(times), "", count});
  }
  if (!factors.empty()) report.add(prefix + "real_time_factor", median_metric(factors, ""));
  if (!durations_s.empty()) report.add(prefix + "duration_s", median_metric(durations_s, "s"));
  if (!plot.bar_names.empty()) report.plots.push_back(plot);
}

Report make_report(const Request& request, const std::vector<Condition>& conditions,
                   const std::map<int, Trial>& trials) {
  Report report;
  report.name = "speech-and-action";
  report.title = "Speech and action on random tables";
  report.summary =
      "The whole system as separate processes: a phrase is spoken, the robot looks, chooses, reaches, grasps "
      "and drops. A trial succeeds only if the judge finds the world as the phrase asked for.";
  report.command = fmt::format("nido experiment run speech-and-action --seed {} --trials {}", request.seed,
                               request.trials);
  report.seed = request.seed;
  report.robot = fs::path(request.robot).stem().string();
  report.world = fs::path(request.world).stem().string();
  report.trials = static_cast<long>(trials.size());
  for (const Condition& condition : conditions) {
    report.summary += fmt::format(" Condition {}: {}.", condition.name, described(condition));
    std::vector<const Trial*> own;
    for (const auto& [number, trial] : trials) {
      if (trial.condition == condition.name) own.push_back(&trial);
    }
    // the first condition's figures have the plain names
    const bool first = &condition == &conditions.front();
    add_condition(report, own, first ? "" : condition.name + ".",
                  conditions.size() > 1 ? ", " + condition.name : "");
  }
  for (const auto& [number, trial] : trials) {
    report.sim_s += trial.sim_s;
    report.trials_detail.push_back({{"trial", static_cast<double>(trial.number)},
                                    {"condition", trial.condition},
                                    {"seed", static_cast<double>(trial.seed)},
                                    {"phrase", trial.phrase},
                                    {"success", trial.success},
                                    {"stage", trial.stage},
                                    {"sim_s", trial.sim_s},
                                    {"wall_s", trial.wall_s},
                                    {"sentence", trial.sentence},
                                    {"folder", trial.folder.filename().string()}});
  }
  return report;
}

// One trial in the app, unless it was made before. `began`: a trial got as far as a report.
Result<Trial> try_once(const Request& request, const std::vector<std::string>& settings, Trial trial,
                       const Lane& lane, std::atomic<bool>& began) {
  std::vector<std::string> arguments = {"--say", trial.phrase, "--seed", std::to_string(trial.seed)};
  arguments.insert(arguments.end(), settings.begin(), settings.end());
  for (const std::string& set : request.app_set) {
    arguments.emplace_back("--set");
    arguments.push_back(set);
  }
  arguments.emplace_back("--set");
  arguments.push_back(fmt::format("wall_limit_s={}", request.limit_s));
  const Status ran = run_app_once({request.app, arguments, trial.folder.string(), "report.json"}, lane);
  if (ran || fs::exists(trial.folder / "run" / "report.json")) {
    began = true;
  } else if (ran.error().code != ErrorCode::kFailed || !began) {
    return ran.error();  // nothing works here
  }
  // an app that did not even begin is a failed trial like another; the next run tries it again
  read_outcome(trial);
  return trial;
}

Status run(Request request) {
  const auto places = find_places();
  if (!places) return places.error();
  // "all": every phrase of the book in turn
  if (request.say == std::vector<std::string>{"all"}) {
    const auto book = PhraseBook::load((places->config / "phrases.yaml").string());
    if (!book) return book.error();
    request.say.clear();
    for (const Phrase& phrase : book->phrases) request.say.push_back(phrase.text);
  }
  if (!request.own.name.empty()) request.conditions.clear();
  std::vector<Condition> conditions;
  if (!request.own.name.empty()) conditions.push_back(request.own);
  for (const std::string& name : request.conditions) {
    const auto condition = condition_of(name);
    if (!condition) return condition.error();
    conditions.push_back(*condition);
  }
  const fs::path out = fs::absolute(request.out);
  std::vector<std::vector<std::string>> settings;  // of nido launch, by condition
  for (const Condition& condition : conditions) {
    auto made = make_condition(*places, condition, request.world, request.robot, out);
    if (!made) return made.error();
    settings.push_back(std::move(*made));
  }

  std::atomic<bool> began{false};
  Pieces pieces{.what = "speech-and-action", .out = request.out, .jobs = request.jobs};
  pieces.domain = request.domain;
  pieces.forget_earlier = request.fresh;
  pieces.count = request.trials * static_cast<int>(conditions.size());
  pieces.total = pieces.count;
  return run_pieces<Trial>(
      pieces,
      [&](int piece, const Lane& lane) {
        // every condition has the same phrases and tables
        const int number = piece % request.trials;
        const auto condition = static_cast<std::size_t>(piece / request.trials);
        Trial trial;
        trial.number = number + 1;
        trial.seed = request.seed + static_cast<std::uint64_t>(number);
        trial.phrase = request.say[static_cast<std::size_t>(number) % request.say.size()];
        trial.condition = conditions[condition].name;
        trial.folder = out / fmt::format("trial-{:03d}-{}", trial.number, trial.condition);
        return try_once(request, settings[condition], std::move(trial), lane, began);
      },
      [&](const std::map<int, Trial>& trials) { return make_report(request, conditions, trials); },
      [](const Report& report) {
        return fmt::format("{:.0f} % of the first condition good", 100 * report.metrics.front().second.value);
      });
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  request.trials = 28;
  request.out = "out/speech-and-action";
  CLI::App app("Runs the whole system on random tables and counts how often it did what it was told.",
               "nido-experiment-speech-and-action");
  app.footer(
      "examples\n  nido experiment run speech-and-action --trials 112 --jobs 2\n"
      "  nido experiment run speech-and-action --trials 28 --jobs 2 --set condition=normal,degraded\n"
      "  nido-experiment-speech-and-action --say 'drop blue cube into basket' --light 0.5");
  nido::add_experiment_options(app, request);
  app.add_option("--say", request.say,
                 "phrases, taken in turn, separated by commas; 'all' for every known one")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--condition", request.conditions,
                 "under which every trial is made, separated by commas: normal, dark, bright, raised, noisy, "
                 "degraded (dark, raised and noisy at once)")
      ->delimiter(',')
      ->capture_default_str();
  for (const auto& [name, value, about] :
       {std::tuple{"--light", &request.own.light, "own condition: the room's light, 1 is normal"},
        {"--table-raise", &request.own.table_raise_m, "own condition: table so much higher, m"},
        {"--camera-noise", &request.own.camera_noise,
         "own condition: standard deviation of the eyes' noise, levels of 255"}}) {
    app.add_option(name, *value, about)->each([&request](const std::string&) { request.own.name = "own"; });
  }
  app.add_option("--app", request.app, "app file or name")->capture_default_str();
  app.add_option("--world", request.world, "world file or name")->capture_default_str();
  app.add_option("--robot", request.robot, "robot file or name")->capture_default_str();
  app.add_option("--app-set", request.app_set,
                 "KEY=VALUE for the app, as of nido launch --set; may come again");
  app.add_flag("--fresh", request.fresh,
               "does trials again that an earlier, interrupted run into the same folder completed");
  nido::add_domain_option(app, request.domain);
  app.add_option("--limit", request.limit_s, "wall time for one trial, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::run(request));
}
