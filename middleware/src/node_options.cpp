#include <cstdlib>
#include <map>

#include "nido/middleware/node.h"

namespace nido {

namespace {

constexpr const char* kUsage =
    "--node FILE, or --name NAME, --domain N, --clock wall|simulated|lockstep, --period SECONDS, --seed N, "
    "--set KEY=VALUE, --connect OUT=IN";

Error refuse(const std::string& sentence) { return {ErrorCode::kInvalidArgument, sentence}; }

// where in a file a YAML value stands
std::string place_of(const std::string& file, const YAML::Node& node) {
  return file + ":" + std::to_string(node.Mark().line + 1);
}

Result<ClockMode> clock_from(const std::string& word) {
  if (word == "wall") {
    return ClockMode::kWall;
  }
  if (word == "simulated") {
    return ClockMode::kSimulated;
  }
  if (word == "lockstep") {
    return ClockMode::kLockstep;
  }
  return refuse("clock '" + word + "' is unknown; there are wall, simulated and lockstep");
}

// "cameras.width=640": into the map of parameters
Status set_parameter(YAML::Node parameters, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    return refuse("--set " + assignment + ": expected KEY=VALUE, such as cameras.width=640");
  }
  const std::string key = assignment.substr(0, equals);
  YAML::Node place;
  place.reset(parameters);
  std::size_t begin = 0;
  for (auto dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
    YAML::Node inner = place[key.substr(begin, dot - begin)];
    if (inner.IsDefined() && !inner.IsMap()) {
      return refuse("--set " + assignment + ": " + key.substr(0, dot) +
                    " is a value, not a group of parameters");
    }
    place.reset(inner);
    begin = dot + 1;
  }
  try {
    place[key.substr(begin)] = YAML::Load(assignment.substr(equals + 1));
  } catch (const YAML::Exception& failure) {
    return refuse("--set " + assignment + ": " + failure.what());
  }
  return {};
}

Result<std::pair<std::string, std::string>> connection_from(const std::string& file,
                                                            const YAML::Node& entry) {
  try {
    if (entry.IsMap() && entry.size() == 2 && entry["out"] && entry["in"]) {
      return std::pair(entry["out"].as<std::string>(), entry["in"].as<std::string>());
    }
    if (entry.IsSequence() && entry.size() == 2) {
      return std::pair(entry[0].as<std::string>(), entry[1].as<std::string>());
    }
  } catch (const YAML::Exception&) {
  }
  return refuse(place_of(file, entry) + ": a connection is '{out: /a/b:o, in: /c/d:i}', found '" +
                YAML::Dump(entry) + "'");
}

Status read_file(const std::string& file, NodeOptions& options) {
  YAML::Node top;
  try {
    top = YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    return Error{ErrorCode::kNotFound, "node file " + file + " cannot be read"};
  } catch (const YAML::Exception& failure) {
    return refuse("node file " + file + ": " + failure.what());
  }
  if (!top.IsMap()) {
    return refuse("node file " + file + " holds no 'key: value' lines");
  }
  for (const auto& entry : top) {
    const auto key = entry.first.as<std::string>();
    try {
      if (key == "name") {
        options.name = entry.second.as<std::string>();
      } else if (key == "domain") {
        options.domain = entry.second.as<int>();
      } else if (key == "clock") {
        const auto clock = clock_from(entry.second.as<std::string>());
        if (!clock) {
          return refuse(place_of(file, entry.second) + ": " + clock.error().message);
        }
        options.clock = *clock;
      } else if (key == "period_s") {
        options.period_s = entry.second.as<double>();
      } else if (key == "seed") {
        options.seed = entry.second.as<std::uint64_t>();
      } else if (key == "parameters") {
        if (!entry.second.IsMap() && !entry.second.IsNull()) {
          return refuse(place_of(file, entry.second) + ": parameters are 'key: value' lines");
        }
        if (entry.second.IsMap()) {
          options.parameters = entry.second;
        }
      } else if (key == "connections") {
        for (const auto& item : entry.second) {
          auto connection = connection_from(file, item);
          if (!connection) {
            return connection.error();
          }
          options.connections.push_back(*connection);
        }
      } else {
        return refuse(
            place_of(file, entry.first) + ": '" + key +
            "' is not allowed; there are name, domain, clock, period_s, seed, parameters, connections");
      }
    } catch (const YAML::Exception&) {
      return refuse(place_of(file, entry.second) + ": " + key + " cannot be '" + YAML::Dump(entry.second) +
                    "'");
    }
  }
  return {};
}

template <class T>
Status read_number(const std::string& option, const std::string& text, T& place) {
  try {
    place = YAML::Load(text).as<T>();
    return {};
  } catch (const YAML::Exception&) {
    return refuse(option + " " + text + ": a number is expected");
  }
}

}  // namespace

Result<NodeOptions> Node::options_from_args(int argc, char** argv, const std::string& default_name) {
  NodeOptions options;
  options.name = default_name;
  options.parameters = YAML::Node(YAML::NodeType::Map);
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody sets the environment here
  if (const char* domain = std::getenv("ROS_DOMAIN_ID"); domain != nullptr && *domain != '\0') {
    if (auto status = read_number("ROS_DOMAIN_ID", domain, options.domain); !status) {
      return status.error();
    }
  }
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    const bool is_known = option == "--node" || option == "--name" || option == "--domain" ||
                          option == "--clock" || option == "--period" || option == "--seed" ||
                          option == "--set" || option == "--connect";
    if (!is_known) {
      return refuse("'" + option + "' is not understood; there are " + kUsage);
    }
    if (i + 1 >= argc) {
      return refuse(option + " needs a value; there are " + kUsage);
    }
    const std::string value = argv[++i];
    Status status;
    if (option == "--node") {
      status = read_file(value, options);
    } else if (option == "--name") {
      options.name = value;
    } else if (option == "--domain") {
      status = read_number(option, value, options.domain);
    } else if (option == "--clock") {
      const auto clock = clock_from(value);
      if (!clock) {
        return clock.error();
      }
      options.clock = *clock;
    } else if (option == "--period") {
      status = read_number(option, value, options.period_s);
    } else if (option == "--seed") {
      status = read_number(option, value, options.seed);
    } else if (option == "--set") {
      status = set_parameter(options.parameters, value);
    } else {
      const auto equals = value.find('=');
      if (equals == std::string::npos) {
        return refuse("--connect " + value + ": expected OUT=IN, such as /vision/objects:o=/reach/objects:i");
      }
      options.connections.emplace_back(value.substr(0, equals), value.substr(equals + 1));
    }
    if (!status) {
      return status.error();
    }
  }
  return options;
}

}  // namespace nido
