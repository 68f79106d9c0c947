#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "nido/launcher/suggest.h"
#include "nido/middleware/parameter.h"
#include "verbs.h"

namespace nido::cli {
namespace {

Result<Session> join_to(const Common& common, const std::string& node) {
  auto session = join(common);
  if (!session) return session;
  if (auto found = find_node(*session, common, node); !found) return found.error();
  return session;
}

// What the node answers on its control service, without the word in front.
Result<std::string> ask(const Session& session, const Common& common, const std::string& node,
                        const std::string& command) {
  auto answer = session.node->call("/" + node + "/control", command, common.wait_s);
  if (!answer) return answer;
  if (answer->starts_with("[ok]")) return answer->substr(std::min<std::size_t>(answer->size(), 5));
  return Error{ErrorCode::kInvalidArgument,
               answer->starts_with("[fail] ") ? answer->substr(7) : "unexpected answer: " + *answer};
}

Result<std::vector<ParameterDescription>> parameters_of(const Session& session, const Common& common,
                                                        const std::string& node) {
  const auto text = ask(session, common, node, "parameters");
  if (!text) return text.error();
  return parse_parameters(*text);
}

std::string range_of(const ParameterAbout& about) {
  if (!about.choices.empty()) {
    std::vector<std::string> words = about.choices;
    std::replace(words.begin(), words.end(), std::string(), std::string("''"));
    return fmt::format("one of {}", fmt::join(words, ", "));
  }
  if (about.min && about.max) return fmt::format("{} to {}", *about.min, *about.max);
  if (about.min) return fmt::format("at least {}", *about.min);
  if (about.max) return fmt::format("at most {}", *about.max);
  return "";
}

Json json_of(const ParameterDescription& parameter) {
  Json json = {{"key", parameter.key},         {"type", parameter.type},         {"value", parameter.value},
               {"unit", parameter.about.unit}, {"about", parameter.about.about}, {"live", parameter.live}};
  if (parameter.about.min) json["min"] = *parameter.about.min;
  if (parameter.about.max) json["max"] = *parameter.about.max;
  if (!parameter.about.choices.empty()) json["choices"] = parameter.about.choices;
  return json;
}

std::string line_of(const ParameterDescription& parameter, std::size_t key_width) {
  std::string line = fmt::format("{:<{}}  {}", parameter.key, key_width, parameter.value);
  if (!parameter.about.unit.empty()) line += " " + parameter.about.unit;
  line += fmt::format("  ({}{}{}{})", parameter.type, range_of(parameter.about).empty() ? "" : ", ",
                      range_of(parameter.about), parameter.live ? ", can be set now" : "");
  if (!parameter.about.about.empty()) line += "  " + parameter.about.about;
  return line;
}

}  // namespace

int param_list(const Common& common, const std::string& node) {
  auto session = join_to(common, node);
  if (!session) return fail(common, session.error());
  const auto parameters = parameters_of(*session, common, node);
  if (!parameters) return fail(common, parameters.error());
  if (common.json) {
    Json list = Json::array();
    for (const auto& parameter : *parameters) list.push_back(json_of(parameter));
    fmt::print("{}\n", list.dump(2));
    return 0;
  }
  if (parameters->empty()) fmt::print(stderr, "node {} has asked for no parameters\n", node);
  std::size_t width = 0;
  for (const auto& parameter : *parameters) width = std::max(width, parameter.key.size());
  for (const auto& parameter : *parameters) fmt::print("{}\n", line_of(parameter, width));
  return 0;
}

int param_get(const Common& common, const std::string& node, const std::string& key) {
  auto session = join_to(common, node);
  if (!session) return fail(common, session.error());
  const auto parameters = parameters_of(*session, common, node);
  if (!parameters) return fail(common, parameters.error());
  std::vector<std::string> keys;
  for (const auto& parameter : *parameters) {
    keys.push_back(parameter.key);
    if (parameter.key != key) continue;
    fmt::print("{}\n", common.json ? json_of(parameter).dump() : parameter.value);
    return 0;
  }
  const std::string near = nearest_word(key, keys);
  return fail(common, {ErrorCode::kNotFound,
                       fmt::format("node {} has asked for no parameter '{}'{}", node, key,
                                   near.empty() ? "" : fmt::format("; did you mean '{}'?", near))});
}

int param_set(const Common& common, const std::string& node, const std::string& key,
              const std::string& value) {
  auto session = join_to(common, node);
  if (!session) return fail(common, session.error());
  const auto set = ask(*session, common, node, fmt::format("set {} {}", key, value));
  if (!set) return fail(common, set.error());
  if (common.json) fmt::print("{}\n", Json{{"node", node}, {"key", key}, {"value", value}}.dump());
  return 0;
}

int param_save(const Common& common, const std::string& node, const std::string& file) {
  auto session = join_to(common, node);
  if (!session) return fail(common, session.error());
  const auto parameters = parameters_of(*session, common, node);
  if (!parameters) return fail(common, parameters.error());
  std::ofstream out(file);
  out << "# parameters of node " << node << "\n" << YAML::Dump(parameter_tree(*parameters)) << "\n";
  out.close();
  if (!out) return fail(common, {ErrorCode::kFailed, fmt::format("cannot write {}", file)});
  fmt::print("{}\n", common.json ? Json{{"file", file}, {"parameters", parameters->size()}}.dump()
                                 : fmt::format("{} parameters in {}", parameters->size(), file));
  return 0;
}

}  // namespace nido::cli
