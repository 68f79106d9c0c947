#include "nido/launcher/app.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "nido/launcher/suggest.h"

namespace nido {
namespace {

const Field* field_of(const Schema& schema, const std::string& key) {
  for (const auto& field : schema.fields) {
    if (field.key == key) return &field;
  }
  return nullptr;
}

Error at(const std::string& file, const YAML::Node& node, const std::string& sentence) {
  const YAML::Mark mark = node.Mark();
  if (mark.is_null()) return {ErrorCode::kInvalidArgument, fmt::format("{}: {}", file, sentence)};
  return {ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", file, mark.line + 1, sentence)};
}

// Names in ${...} of one text; nothing if a reference is not closed.
std::optional<std::vector<std::string>> references_in(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t start = text.find("${"); start != std::string::npos; start = text.find("${", start + 1)) {
    const std::size_t end = text.find('}', start);
    if (end == std::string::npos) return std::nullopt;
    names.push_back(text.substr(start + 2, end - start - 2));
  }
  return names;
}

Status check_references(const YAML::Node& node, const std::string& file) {
  if (node.IsScalar()) {
    const auto names = references_in(node.Scalar());
    if (!names) return at(file, node, fmt::format("'{}' has a ${{ without its }}", node.Scalar()));
    for (const auto& name : *names) {
      const auto& known = app_reference_names();
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      const std::string near = nearest_word(name, known);
      return at(
          file, node,
          fmt::format("there is no reference ${{{}}}{}; allowed: {}", name,
                      near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(known)));
    }
  } else if (node.IsSequence()) {
    for (const auto& item : node) {
      if (auto status = check_references(item, file); !status) return status;
    }
  } else if (node.IsMap()) {
    for (const auto& item : node) {
      if (auto status = check_references(item.second, file); !status) return status;
    }
  }
  return {};
}

AppProcess read_process(const YAML::Node& node) {
  AppProcess process;
  process.name = node["name"].as<std::string>();
  process.program = node["program"].as<std::string>();
  process.clock = node["clock"].as<std::string>();
  process.period_s = node["period_s"].as<double>();
  process.ready_timeout_s = node["ready_timeout_s"].as<double>();
  for (const auto& item : node["depends_on"]) process.depends_on.push_back(item.as<std::string>());
  for (const auto& item : node["environment"]) {
    process.environment[item.first.as<std::string>()] = item.second.as<std::string>();
  }
  process.parameters = node["parameters"];
  const YAML::Node restart = node["restart"];
  process.restart.on_failure = restart["policy"].as<std::string>() == "on-failure";
  process.restart.max_restarts = restart["max"].as<int>();
  process.restart.window_s = restart["window_s"].as<double>();
  process.restart.backoff_s = restart["backoff_s"].as<double>();
  process.restart.backoff_max_s = restart["backoff_max_s"].as<double>();
  process.restart.fail_the_run = restart["escalate"].as<std::string>() == "fail";
  return process;
}

// Processes in an order in which each comes after those it depends on; the order of the file otherwise.
Status order_processes(App& app, const YAML::Node& list) {
  std::vector<std::string> names;
  for (const auto& process : app.processes) names.push_back(process.name);
  for (std::size_t i = 0; i < app.processes.size(); ++i) {
    const YAML::Node items = list[i]["depends_on"];
    for (const auto& item : items) {
      const std::string wanted = item.as<std::string>();
      if (std::find(names.begin(), names.end(), wanted) != names.end() && wanted != names[i]) continue;
      const std::string near = nearest_word(wanted, names);
      return at(
          app.file, item,
          wanted == names[i]
              ? fmt::format("process '{}' depends on itself", wanted)
              : fmt::format("process '{}' depends on '{}', which is no process{}; there are: {}", names[i],
                            wanted, near.empty() ? "" : fmt::format("; did you mean '{}'?", near),
                            join_words(names)));
    }
  }
  std::vector<bool> placed(app.processes.size(), false);
  while (app.start_order.size() < app.processes.size()) {
    bool found = false;
    for (std::size_t i = 0; i < app.processes.size() && !found; ++i) {
      if (placed[i]) continue;
      const auto& wants = app.processes[i].depends_on;
      const bool free = std::all_of(wants.begin(), wants.end(), [&](const std::string& wanted) {
        return placed[std::find(names.begin(), names.end(), wanted) - names.begin()];
      });
      if (!free) continue;
      app.start_order.push_back(i);
      placed[i] = true;
      found = true;
    }
    if (!found) {
      std::vector<std::string> left;
      for (std::size_t i = 0; i < placed.size(); ++i) {
        if (!placed[i]) left.push_back(names[i]);
      }
      return at(app.file, list[0],
                fmt::format("these processes wait for each other in a circle: {}", join_words(left)));
    }
  }
  return {};
}

Status check_audio(const App& app) {
  const std::string source = app.audio["source"].as<std::string>();
  if (source == "synthesis" && !app.audio["text"]) {
    return at(app.file, app.audio["source"],
              "'source' of audio is 'synthesis', but there is no 'text' to say (--say TEXT)");
  }
  if (source == "wav" && !app.audio["file"]) {
    return at(app.file, app.audio["source"],
              "'source' of audio is 'wav', but there is no 'file' (--audio FILE)");
  }
  return {};
}

}  // namespace

Result<Override> parse_set(const std::string& text, const YAML::Node& document) {
  const std::string origin = "--set " + text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: expected KEY=VALUE, as in --set seed=3", origin)};
  }
  Override result{text.substr(0, equals), YAML::Node(), origin};
  try {
    result.value = YAML::Load(text.substr(equals + 1));
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: the value is no YAML: {}", origin, e.msg)};
  }
  // a node read from a text of its own would claim to stand in line 1 of the file
  result.value = fill_references(result.value, {});

  const std::string first = result.path.substr(0, result.path.find('.'));
  if (field_of(app_schema(), first) != nullptr) return result;
  const Schema& defaults = *field_of(app_schema(), "defaults")->inner;
  std::vector<std::string> processes;
  if (document.IsMap() && document["processes"] && document["processes"].IsSequence()) {
    for (const auto& item : document["processes"]) {
      if (item.IsMap() && item["name"] && item["name"].IsScalar()) processes.push_back(item["name"].Scalar());
    }
  }
  const bool is_process = std::find(processes.begin(), processes.end(), first) != processes.end();
  // robot=NAME is the default, robot.KEY is of the process of that name: the default has no keys inside
  if (const Field* field = field_of(defaults, first);
      field != nullptr && (!is_process || first == result.path || field->inner != nullptr)) {
    result.path = "defaults." + result.path;
    return result;
  }
  if (is_process) {
    if (first == result.path) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}: '{}' is a whole process: name one of its parameters, as in {}.KEY",
                               origin, first, first)};
    }
    result.path = "processes." + first + ".parameters" + result.path.substr(first.size());
    return result;
  }
  std::vector<std::string> known;
  for (const auto& field : app_schema().fields) known.push_back(field.key);
  for (const auto& field : defaults.fields) known.push_back(field.key);
  known.insert(known.end(), processes.begin(), processes.end());
  const std::string near = nearest_word(first, known);
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("{}: there is no key '{}'{}; allowed: {}", origin, first,
                           near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(known))};
}

Result<App> load_app(const std::string& file, const std::vector<Override>& options,
                     const std::vector<std::string>& sets) {
  auto read = read_yaml(file);
  if (!read) return read.error();
  YAML::Node document = *read;

  std::vector<Override> overrides = options;
  for (const auto& set : sets) {
    auto parsed = parse_set(set, document);
    if (!parsed) return parsed.error();
    overrides.push_back(*parsed);
  }
  for (const auto& override_ : overrides) {
    if (!document.IsMap()) break;  // the check below says so
    if (auto status = apply_override(document, app_schema(), override_); !status) return status.error();
  }
  // the last word on a key is the one to blame
  std::reverse(overrides.begin(), overrides.end());
  auto checked = check_document(document, app_schema(), file, overrides);
  if (!checked) return checked.error();

  App app;
  app.file = file;
  app.document = *checked;
  const YAML::Node& top = app.document;
  app.name = top["name"].as<std::string>();
  app.summary = top["summary"].as<std::string>();
  const YAML::Node defaults = top["defaults"];
  app.robot = defaults["robot"].as<std::string>();
  app.world = defaults["world"].as<std::string>();
  app.seed = defaults["seed"].as<std::uint64_t>();
  app.hand = defaults["hand"].as<std::string>();
  app.rate = defaults["rate"].as<std::string>();
  app.lockstep = defaults["lockstep"].as<bool>();
  if (defaults["domain"]) app.domain = defaults["domain"].as<int>();
  app.for_s = defaults["for_s"].as<double>();
  app.wall_limit_s = defaults["wall_limit_s"].as<double>();
  app.audio = defaults["audio"];
  if (auto status = check_audio(app); !status) return status.error();
  if (top["story"]) app.story = top["story"].as<std::string>();
  if (top["outcome"]) app.outcome = top["outcome"].as<std::string>();

  int owners = 0;
  // the document as it was read knows its lines
  const YAML::Node& read_document = document;
  for (std::size_t i = 0; i < top["processes"].size(); ++i) {
    const YAML::Node item = top["processes"][i];
    app.processes.push_back(read_process(item));
    if (app.processes.back().clock == "owner" && ++owners > 1) {
      return at(file, read_document["processes"][i],
                fmt::format("process '{}' is a second owner of the clock; there can be one",
                            app.processes.back().name));
    }
    for (const auto& part : {item["parameters"], item["environment"]}) {
      if (auto status = check_references(part, file); !status) return status.error();
    }
  }
  if (app.processes.empty())
    return at(file, read_document["processes"], "'processes' is empty: there is nothing to start");
  const std::map<std::string, YAML::Node> hand = {{"hand", YAML::Node(app.hand)}};
  for (std::size_t i = 0; i < top["connections"].size(); ++i) {
    const YAML::Node item = fill_references(top["connections"][i], hand);
    for (const char* end : {"out", "in"}) {
      if (item[end].Scalar().find("${") == std::string::npos) continue;
      return at(file, read_document["connections"][i][end],
                fmt::format("'{}': a connection may hold the reference ${{hand}} and no other",
                            item[end].Scalar()));
    }
    app.connections.emplace_back(item["out"].as<std::string>(), item["in"].as<std::string>());
  }
  if (auto status = order_processes(app, read_document["processes"]); !status) return status.error();
  return app;
}

std::string dump_app(const App& app) {
  YAML::Emitter out;
  out << app.document;
  return std::string(out.c_str()) + "\n";
}

YAML::Node fill_references(const YAML::Node& node, const std::map<std::string, YAML::Node>& values) {
  if (node.IsScalar()) {
    const std::string text = node.Scalar();
    const auto whole = text.size() > 3 && text.starts_with("${") && text.find('}') == text.size() - 1
                           ? values.find(text.substr(2, text.size() - 3))
                           : values.end();
    if (whole != values.end()) return YAML::Clone(whole->second);
    std::string filled;
    std::size_t from = 0;
    for (std::size_t start = text.find("${"); start != std::string::npos; start = text.find("${", from)) {
      const std::size_t end = text.find('}', start);
      if (end == std::string::npos) break;
      filled += text.substr(from, start - from);
      const auto value = values.find(text.substr(start + 2, end - start - 2));
      filled += value != values.end() && value->second.IsScalar() ? value->second.Scalar()
                                                                  : text.substr(start, end - start + 1);
      from = end + 1;
    }
    YAML::Node copy(filled + text.substr(from));
    copy.SetTag(node.Tag());
    return copy;
  }
  if (node.IsSequence()) {
    YAML::Node copy(YAML::NodeType::Sequence);
    for (const auto& item : node) copy.push_back(fill_references(item, values));
    return copy;
  }
  if (node.IsMap()) {
    YAML::Node copy(YAML::NodeType::Map);
    for (const auto& item : node) copy[item.first.Scalar()] = fill_references(item.second, values);
    return copy;
  }
  return YAML::Clone(node);
}

}  // namespace nido
