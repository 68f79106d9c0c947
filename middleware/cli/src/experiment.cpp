#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "nido/launcher/paths.h"
#include "nido/launcher/suggest.h"
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
      {"reach-accuracy", "distance of the hand from objects that the cameras see (Figure 10)"},
      {"grasp-learning", "learns to close the hand by reward and penalty (Figures 13 and 14)"},
      {"grasp-success", "grasps of trained and unseen shapes (Figure 15)"},
      {"goal-learning", "trains the network that chooses what to do (Figure 18)"},
      {"speech", "understands the phrases by voice and noise (Table IV)"},
      {"speech-and-action", "does what it is told on random tables (Figure 19)"},
      {"attention", "keeps its eyes on what moves (Section VI)"},
  };
  return list;
}

constexpr const char* kPrefix = "nido-experiment-";

std::vector<Experiment> present_experiments(const Places& places) {
  std::vector<Experiment> present;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(places.programs, error)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(kPrefix) || access(entry.path().c_str(), X_OK) != 0) continue;
    present.push_back({file.substr(std::strlen(kPrefix)), ""});
  }
  for (auto& one : present) {
    for (const auto& known : known_experiments()) {
      if (known.name == one.name) one.summary = known.summary;
    }
  }
  std::sort(present.begin(), present.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return present;
}

}  // namespace

int experiment_list(const Common& common) {
  auto places = find_places();
  if (!places) return fail(places.error());
  const auto present = present_experiments(*places);
  if (common.json) {
    Json list = Json::array();
    for (const auto& one : present) list.push_back({{"name", one.name}, {"summary", one.summary}});
    fmt::print("{}\n", list.dump(2));
    return 0;
  }
  if (present.empty())
    fmt::print(stderr, "no experiments are built beside {}\n", (places->programs / "nido").string());
  for (const auto& one : present) fmt::print("{:<20} {}\n", one.name, one.summary);
  return 0;
}

int experiment_run(const ExperimentRequest& request) {
  auto places = find_places();
  if (!places) return fail(places.error());
  std::vector<std::string> names;
  for (const auto& one : present_experiments(*places)) names.push_back(one.name);
  if (std::find(names.begin(), names.end(), request.name) == names.end()) {
    const std::string near = nearest_word(request.name, names);
    return fail(
        {ErrorCode::kNotFound,
         fmt::format("there is no experiment '{}'{}; there are: {}", request.name,
                     near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(names))});
  }
  std::vector<std::string> arguments = {(places->programs / (kPrefix + request.name)).string()};
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
  std::vector<char*> argv;
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  // it takes this process's place: Ctrl-C and the exit code are its own
  execv(argv.front(), argv.data());
  return fail(
      {ErrorCode::kFailed, fmt::format("{} cannot be started: {}", arguments.front(), std::strerror(errno))});
}

}  // namespace nido::cli
