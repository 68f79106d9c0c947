#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "nido/launcher/paths.h"
#include "nido/launcher/suggest.h"
#include "nido/launcher/terminal.h"
#include "verbs.h"

namespace nido::cli {
namespace fs = std::filesystem;
namespace {

// An experiment is a program nido-experiment-NAME beside nido, which takes --seed --trials --jobs --out --set
// and writes report.json, report.html and pictures. Those without a line here are found too.
struct Experiment {
  std::string name;
  std::string summary;
};
const std::vector<Experiment>& known_experiments() {
  static const std::vector<Experiment> list = {
      {"reach-learning", "trains the reaching network on motor babbling (Figures 6 to 8)"},
      {"self-calibration", "finds out how the body is built by looking at the moving hand"},
      {"reach-accuracy", "distance of the hand from objects that the cameras see (Figure 10)"},
      {"reach-correction", "a person leads the hand to where it should have reached; it learns that"},
      {"grasp-learning", "learns to close the hand by reward and penalty (Figures 13 and 14)"},
      {"grasp-success", "grasps of trained and unseen shapes (Figure 15)"},
      {"goal-learning", "trains the network that chooses what to do (Figure 18)"},
      {"speech", "understands the phrases by voice and noise (Table IV)"},
      {"speech-and-action", "does what it is told on random tables (Figure 19)"},
      {"attention", "keeps its eyes on what moves (Section VI)"},
      {"teaching", "learns things that are shown and named, and what to do with them"},
      {"all", "all of them, one after the other, in one report"},
  };
  return list;
}

constexpr const char* kExperiment = "nido-experiment-";
constexpr const char* kBench = "nido-bench-";

// Names of the programs PREFIXname beside nido, sorted.
std::vector<std::string> names_of(const Places& places, const std::string& prefix) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(places.programs, error)) {
    const std::string file = entry.path().filename().string();
    if (file.starts_with(prefix) && access(entry.path().c_str(), X_OK) == 0) {
      names.push_back(file.substr(prefix.size()));
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string summary_of(const std::string& experiment) {
  for (const auto& known : known_experiments()) {
    if (known.name == experiment) return known.summary;
  }
  return "";
}

// The program takes this process's place: Ctrl-C and the exit code are its own.
int become(const std::string& what, const std::string& prefix, const std::string& name,
           std::vector<std::string> arguments) {
  auto places = find_places();
  if (!places) return print_error(places.error(), false);
  const auto names = names_of(*places, prefix);
  if (names.empty()) {
    return print_error(
        {ErrorCode::kNotFound, fmt::format("no {}s are built beside {}: ./test builds everything", what,
                                           (places->programs / "nido").string())},
        false);
  }
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    const std::string near = nearest_word(name, names);
    return print_error(
        {ErrorCode::kNotFound,
         fmt::format("there is no {} '{}'{}; there are: {}", what, name,
                     near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(names))},
        false);
  }
  arguments.insert(arguments.begin(), (places->programs / (prefix + name)).string());
  std::vector<char*> argv;
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  execv(argv.front(), argv.data());
  return print_error(
      {ErrorCode::kFailed, fmt::format("{} cannot be started: {}", arguments.front(), std::strerror(errno))},
      false);
}

}  // namespace

int experiment_list(const Common& common) {
  auto places = find_places();
  if (!places) return fail(common, places.error());
  const auto names = names_of(*places, kExperiment);
  if (common.json) {
    Json list = Json::array();
    for (const auto& name : names) list.push_back({{"name", name}, {"summary", summary_of(name)}});
    fmt::print("{}\n", list.dump(2));
    return 0;
  }
  if (names.empty())
    fmt::print(stderr, "no experiments are built beside {}\n", (places->programs / "nido").string());
  for (const auto& name : names) fmt::print("{:<20} {}\n", name, summary_of(name));
  return 0;
}

int experiment_run(const ExperimentRequest& request) {
  std::vector<std::string> arguments;
  const auto add = [&arguments](const char* option, const std::string& value) {
    if (value.empty()) return;
    arguments.emplace_back(option);
    arguments.push_back(value);
  };
  add("--seed", request.seed);
  add("--trials", request.trials);
  add("--jobs", request.jobs);
  add("--out", request.out);
  for (const auto& set : request.sets) add("--set", set);
  arguments.insert(arguments.end(), request.others.begin(), request.others.end());
  return become("experiment", kExperiment, request.name, arguments);
}

int dashboard(const Common& common, const std::string& port) {
  return become("program", "nido-", "dashboard",
                {"--domain", std::to_string(common.domain), "--period", "0.1", "--set", "port=" + port});
}

int bench(const std::string& name, const std::vector<std::string>& arguments) {
  return become("benchmark", kBench, name, arguments);
}

}  // namespace nido::cli
