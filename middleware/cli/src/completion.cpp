#include "completion.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "nido/launcher/paths.h"
#include "session.h"

namespace nido::cli {
namespace {

// readline takes a colon for the end of a word and wants only what comes after it; the words are taken from
// the line, where they are whole.
constexpr const char* kBash = R"(# bash completion for nido:  source <(nido completion bash)
_nido() {
  local line=${COMP_LINE:0:COMP_POINT} candidate cut=""
  local -a words
  read -ra words <<< "$line"
  [[ $line == *[[:space:]] ]] && words+=("")
  local word=${words[-1]}
  [[ $word == *:* && $COMP_WORDBREAKS == *:* ]] && cut=${word%"${word##*:}"}
  COMPREPLY=()
  while IFS= read -r candidate; do
    COMPREPLY+=("${candidate#"$cut"}")
  done < <("${words[0]}" complete "${words[@]:1}" 2> /dev/null)
}
complete -o default -F _nido nido
)";

constexpr const char* kZsh = R"(#compdef nido
# zsh completion for nido:  source <(nido completion zsh), or this text as _nido in a folder of $fpath
_nido() {
  local -a candidates
  candidates=("${(@f)$("${words[1]}" complete "${(@)words[2,CURRENT]}" 2> /dev/null)}")
  if [[ -n ${candidates[1]} ]]; then
    compadd -- "${candidates[@]}"
  else
    _files
  fi
}
if [[ ${funcstack[1]} == _nido ]]; then
  _nido "$@"
else
  compdef _nido nido
fi
)";

// What stands at a place of the command line.
enum class Kind {
  kNothing,
  kApp,
  kRobot,
  kWorld,
  kOutput,
  kInput,
  kAnyPort,
  kService,
  kNode,
  kExperiment,
  kBench,
  kClock,
  kShell
};

// By verb, what its positional arguments are; the last one repeats.
const std::map<std::string, std::vector<Kind>> kArguments = {
    {"launch", {Kind::kApp, Kind::kNothing}},
    {"port info", {Kind::kAnyPort, Kind::kNothing}},
    {"port read", {Kind::kOutput, Kind::kNothing}},
    {"port write", {Kind::kInput, Kind::kNothing}},
    {"port rpc", {Kind::kService, Kind::kNothing}},
    {"port connect", {Kind::kOutput, Kind::kInput, Kind::kNothing}},
    {"port disconnect", {Kind::kOutput, Kind::kInput, Kind::kNothing}},
    {"port hz", {Kind::kOutput, Kind::kNothing}},
    {"port bw", {Kind::kOutput, Kind::kNothing}},
    {"port delay", {Kind::kOutput, Kind::kNothing}},
    {"port ping", {Kind::kAnyPort, Kind::kNothing}},
    {"node info", {Kind::kNode, Kind::kNothing}},
    {"node call", {Kind::kNode, Kind::kNothing}},
    {"param list", {Kind::kNode, Kind::kNothing}},
    {"param get", {Kind::kNode, Kind::kNothing}},
    {"param set", {Kind::kNode, Kind::kNothing}},
    {"param save", {Kind::kNode, Kind::kNothing}},
    {"clock", {Kind::kClock, Kind::kNothing}},
    {"record", {Kind::kOutput}},
    {"experiment run", {Kind::kExperiment, Kind::kNothing}},
    {"bench", {Kind::kBench, Kind::kNothing}},
    {"completion", {Kind::kShell, Kind::kNothing}}};

const std::map<std::string, Kind> kOptions = {{"--robot", Kind::kRobot},
                                              {"--world", Kind::kWorld},
                                              {"--lockstep", Kind::kNode},
                                              {"--except", Kind::kOutput}};
const std::map<std::string, std::vector<std::string>> kWords = {{"--clock", {"auto", "wall", "simulated"}},
                                                                {"--compression", {"zstd", "none"}},
                                                                {"--rate", {"max"}},
                                                                {"--hand", {"left", "right"}}};

std::vector<std::string> programs_named(const std::string& prefix) {
  std::vector<std::string> names;
  const auto places = find_places();
  if (!places) return names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(places->programs, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && access(entry.path().c_str(), X_OK) == 0) {
      names.push_back(name.substr(prefix.size()));
    }
  }
  return names;
}

std::vector<std::string> config_named(const std::string& folder) {
  const auto places = find_places();
  return places ? config_names(*places, folder) : std::vector<std::string>();
}

// What is there in the domain now.
std::vector<std::string> names_in_domain(const Common& common, Kind kind) {
  std::vector<std::string> names;
  auto session = join(common);
  if (!session) return names;
  settle(*session->directory);
  for (const auto& node : session->directory->nodes()) {
    if (kind == Kind::kNode) {
      names.push_back(node.name);
      continue;
    }
    for (const auto& port : node.ports) {
      const bool fits = kind == Kind::kAnyPort || (kind == Kind::kOutput && port.direction == "output") ||
                        (kind == Kind::kInput && port.direction == "input") ||
                        (kind == Kind::kService && port.direction == "service");
      if (fits) names.push_back(port.name);
    }
  }
  return names;
}

std::vector<std::string> names_of(Kind kind, const Common& common) {
  switch (kind) {
    case Kind::kNothing:
      return {};
    case Kind::kApp:
      return config_named("apps");
    case Kind::kRobot:
      return config_named("robots");
    case Kind::kWorld:
      return config_named("worlds");
    case Kind::kExperiment:
      return programs_named("nido-experiment-");
    case Kind::kBench:
      return programs_named("nido-bench-");
    case Kind::kClock:
      return {"pause", "run", "step", "rate"};
    case Kind::kShell:
      return {"bash", "zsh"};
    default:
      return names_in_domain(common, kind);
  }
}

CLI::App* verb_named(CLI::App& parent, const std::string& name) {
  const auto found = parent.get_subcommands([&](const CLI::App* one) { return one->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

}  // namespace

int completion(const std::string& shell) {
  fmt::print("{}", shell == "zsh" ? kZsh : kBash);
  return 0;
}

int complete(CLI::App& root, const std::vector<std::string>& words, Common common) {
  const std::string current = words.empty() ? "" : words.back();
  CLI::App* verb = &root;
  std::string path;           // "port read"
  std::size_t arguments = 0;  // positional ones before the current word
  std::string option;         // whose value the current word is
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (!option.empty()) {
      if (option == "--domain") common.domain = std::atoi(word.c_str());
      option.clear();
    } else if (word.starts_with('-')) {
      const auto* known = verb->get_option_no_throw(word.substr(0, word.find('=')));
      const bool takes_value =
          known != nullptr && known->get_type_size() > 0 && word.find('=') == std::string::npos;
      if (takes_value) option = word;
    } else if (CLI::App* inner = arguments == 0 ? verb_named(*verb, word) : nullptr) {
      verb = inner;
      path += (path.empty() ? "" : " ") + word;
    } else {
      ++arguments;
    }
  }
  std::set<std::string> candidates;
  const auto add = [&candidates](const std::vector<std::string>& names) {
    candidates.insert(names.begin(), names.end());
  };
  if (!option.empty()) {
    if (const auto found = kWords.find(option); found != kWords.end()) add(found->second);
    if (const auto found = kOptions.find(option); found != kOptions.end())
      add(names_of(found->second, common));
  } else if (current.starts_with('-')) {
    for (const auto* one : verb->get_options()) {
      if (one->get_group().empty()) continue;
      for (const auto& name : one->get_lnames()) candidates.insert("--" + name);
    }
  } else {
    for (const auto* inner : verb->get_subcommands([](const CLI::App*) { return true; })) {
      if (!inner->get_group().empty()) candidates.insert(inner->get_name());
    }
    if (const auto found = kArguments.find(path); found != kArguments.end()) {
      add(names_of(found->second[std::min(arguments, found->second.size() - 1)], common));
    }
  }
  for (const auto& candidate : candidates) {
    if (candidate.starts_with(current)) fmt::print("{}\n", candidate);
  }
  return 0;
}

}  // namespace nido::cli
