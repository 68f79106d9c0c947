// A node's parameters, and what others can tell it at /NAME/control.
#include <algorithm>
#include <sstream>

#include "node_impl.h"

namespace nido {

void NodeImpl::note_parameter(ParameterDescription description,
                              std::function<Status(const YAML::Node&)> set) {
  {
    const std::lock_guard lock(mutex_);
    const std::string key = description.key;
    parameters_[key] = {std::move(description), std::move(set)};
  }
  book_->changes()->notify();
}

std::vector<ParameterDescription> NodeImpl::parameters() {
  const std::lock_guard lock(mutex_);
  std::vector<ParameterDescription> list;
  for (const auto& [key, parameter] : parameters_) list.push_back(parameter.description);
  return list;
}

Status NodeImpl::set_parameter(const std::string& key, const std::string& text) {
  YAML::Node value;
  try {
    value = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, "'" + text + "' is no value: " + e.msg};
  }
  {
    const std::lock_guard lock(mutex_);
    const auto found = parameters_.find(key);
    if (found == parameters_.end() || !found->second.set) {
      std::string live;
      for (const auto& [name, parameter] : parameters_) {
        if (parameter.set) live += (live.empty() ? "" : ", ") + name;
      }
      return Error{ErrorCode::kInvalidArgument,
                   "node " + options_.name +
                       (found == parameters_.end() ? " has no parameter " + key
                                                   : " reads its parameter " + key + " only when it starts") +
                       (live.empty() ? "; it has none that can be set while it runs"
                                     : "; those that can be set while it runs: " + live)};
    }
    if (Status set = found->second.set(value); !set) return set;
    found->second.description.value = parameter_text(value);
  }
  book_->changes()->notify();
  log_info("parameter " + key + " set to " + text);
  return {};
}

// A misspelt parameter would be a silent default: what was given and never asked for is told. It is no error:
// apps hand the same group to several nodes. A node that reads options().parameters by itself has asked for
// none, and checks them itself.
void NodeImpl::tell_unused_parameters() {
  std::string unused;
  {
    const std::lock_guard lock(mutex_);
    if (parameters_.empty()) return;
    const auto is_known = [this](const std::string& key) {
      return std::ranges::any_of(parameters_, [&key](const auto& asked) {
        return key == asked.first || key.starts_with(asked.first + ".");
      });
    };
    std::vector<std::pair<std::string, YAML::Node>> open = {{"", options_.parameters}};
    while (!open.empty()) {
      const auto [path, value] = open.back();
      open.pop_back();
      if (value.IsMap()) {
        for (const auto& entry : value) {
          open.emplace_back((path.empty() ? "" : path + ".") + entry.first.as<std::string>(), entry.second);
        }
      } else if (!path.empty() && !is_known(path)) {
        unused += (unused.empty() ? "" : ", ") + path;
      }
    }
  }
  if (!unused.empty()) {
    log_info("does not use these of its parameters: " + unused);
  }
}

std::string NodeImpl::control(const std::string& command) {
  std::istringstream words(command);
  std::string verb;
  std::string first;
  std::string second;
  words >> verb >> first;
  std::getline(words >> std::ws, second);
  const auto answer = [](const Status& status) {
    return status ? std::string("[ok]") : "[fail] " + status.error().message;
  };
  if (verb == "connect" || verb == "disconnect") {
    Status status =
        Error{ErrorCode::kNotFound, "node " + options_.name + " has no input port '" + second + "'"};
    book_->each_input([&](InputRecord& port) {
      if (port.describe().name == second) {
        status = verb == "connect" ? port.connect(first) : port.disconnect(first);
      }
    });
    return answer(status);
  }
  if (verb == "set" && !first.empty()) {
    return answer(set_parameter(first, second));
  }
  if (verb == "parameters") {
    return "[ok]\n" + to_text(parameters());
  }
  if (verb == "idl") {
    std::string text = "[fail] node " + options_.name + " has no port '" + first + "'";
    book_->each_port([&](PortRecord& port) {
      const PortDescription description = port.describe();
      if (description.name == first) text = "[ok]\n" + port.idl();
    });
    return text;
  }
  if (verb == "info") {
    std::string text = "[ok] " + options_.name + " ";
    {
      const std::lock_guard lock(mutex_);
      text += state_ + (detail_.empty() ? "" : " (" + detail_ + ")");
    }
    book_->each_port([&](PortRecord& port) {
      const PortDescription description = port.describe();
      text += "\n" + description.direction + " " + description.name + " " + description.type;
    });
    return text;
  }
  if (verb == "delays") {
    std::string text = "[fail] node " + options_.name + " has no input port '" + first + "'";
    book_->each_input([&](InputRecord& record) {
      const auto* port = dynamic_cast<const InputPort*>(&record);
      if (port != nullptr && port->name() == first) {
        text = "[ok]" + port->delays();
      }
    });
    return text;
  }
  if (verb == "stop") {
    stop();
    return "[ok]";
  }
  return "[fail] '" + command +
         "' is not understood; there are: connect OUT IN, disconnect OUT IN, set KEY VALUE, parameters, "
         "info, "
         "delays INPUT, idl PORT, stop";
}

}  // namespace nido
