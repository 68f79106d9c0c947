#include "admin.h"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>

namespace nido::yarp {
namespace {

constexpr std::size_t kMostProperties = 64;

constexpr const char* kHelp[] = {
    "[help]                  # give this help",
    "[ver]                   # report protocol version information",
    "[add] $portname         # add an output connection",
    "[add] $portname $car    # add an output with a given protocol",
    "[del] $portname         # remove an input or output connection",
    "[list] [in]             # list input connections",
    "[list] [out]            # list output connections",
    "[list] [in]  $portname  # give details for input",
    "[list] [out] $portname  # give details for output",
    "[prop] [get]            # get all user-defined port properties",
    "[prop] [get] $prop      # get a user-defined port property (prop, val)",
    "[prop] [set] $prop $val # set a user-defined port property (prop, val)",
    "[prop] [get] $portname  # get Qos properties of a connection to/from a port",
    "[prop] [get] $cur_port  # get information about current process"};

Value whole(std::int64_t value) { return Value::of(value); }

Value pair(const char* key, Value value) { return Value::list({Value::string(key), std::move(value)}); }

Value dictionary(std::vector<Value> pairs) {
  Value value;
  value.kind = Value::Kind::kDict;
  value.items = std::move(pairs);
  return value;
}

std::string text_at(const Bottle& command, std::size_t at) {
  if (at >= command.size()) return {};
  return command[at].is_text() ? command[at].text : to_text(command[at]);
}

Bottle list(const AdminActions& actions, const std::string& port, const Bottle& command) {
  const bool outgoing = text_at(command, 1) == "out";
  const std::string target = text_at(command, 2);
  Bottle out;
  for (const Route& route : actions.routes(port, outgoing)) {
    const std::string& other = outgoing ? route.to : route.from;
    if (target.empty()) {
      out.push_back(Value::string(other));
    } else if (other == target) {
      out.push_back(pair("from", Value::string(route.from)));
      out.push_back(pair("to", Value::string(route.to)));
      out.push_back(pair("carrier", Value::string(route.carrier)));
      if (route.carrier == "udp") out.push_back(pair("connectionless", whole(1)));
    }
  }
  return out;
}

// the process, the platform and the port
Bottle about_process(const AdminActions& actions, const std::string& port) {
  utsname system{};
  uname(&system);
  const auto group = [](const char* name, std::vector<Value> pairs) {
    return Value::list({Value::string(name), dictionary(std::move(pairs))});
  };
  return {
      group("sched", {pair("tid", whole(getpid())), pair("priority", whole(0)), pair("policy", whole(0))}),
      group("process",
            {pair("pid", whole(getpid())), pair("name", Value::string("nido-gateway")),
             pair("arguments", Value::string("")), pair("priority", whole(0)), pair("policy", whole(0))}),
      group("platform",
            {pair("os", Value::string(system.sysname)), pair("hostname", Value::string(system.nodename)),
             pair("release", Value::string(system.release))}),
      group("port", {pair("is_input", whole(actions.takes(port) ? 1 : 0)),
                     pair("is_output", whole(actions.gives(port) ? 1 : 0)), pair("is_rpc", whole(0)),
                     pair("type", Value::string("nido"))})};
}

Bottle properties_command(const AdminActions& actions, const std::string& port,
                          std::map<std::string, Bottle>& properties, const Bottle& command) {
  const std::string key = text_at(command, 2);
  if (text_at(command, 1) == "set") {
    if (key.starts_with('/')) return {Value::word("ok")};  // quality of service: DDS has its own
    if (key.empty() || (!properties.contains(key) && properties.size() >= kMostProperties)) {
      return {Value::word("fail"), Value::string("a port has at most 64 properties")};
    }
    properties[key] =
        Bottle(command.begin() + std::min<std::ptrdiff_t>(3, std::ssize(command)), command.end());
    return {Value::word("ok")};
  }
  if (key == port) return about_process(actions, port);
  if (key.starts_with('/')) {
    Bottle out;
    for (const bool outgoing : {true, false}) {
      for (const Route& route : actions.routes(port, outgoing)) {
        if ((outgoing ? route.to : route.from) != key) continue;
        out.push_back(Value::list(
            {Value::string("sched"), dictionary({pair("tid", whole(getpid())), pair("priority", whole(0)),
                                                 pair("policy", whole(0))})}));
        out.push_back(Value::list({Value::string("qos"), dictionary({pair("tos", whole(0))})}));
        return out;
      }
    }
    return {Value::word("fail"), Value::string("cannot find any connection to/from " + key)};
  }
  if (!key.empty()) {
    const auto found = properties.find(key);
    if (found == properties.end()) return {Value::word("")};
    Bottle out{Value::string(key)};
    out.insert(out.end(), found->second.begin(), found->second.end());
    return {Value::list(std::move(out))};
  }
  Bottle out;
  for (const auto& [name, values] : properties) {
    Bottle item{Value::string(name)};
    item.insert(item.end(), values.begin(), values.end());
    out.push_back(Value::list(std::move(item)));
  }
  return out;
}

}  // namespace

void answer_admin_command(AdminActions& actions, const std::string& port,
                          std::map<std::string, Bottle>& properties, const Bottle& command,
                          std::function<void(Bottle)> done) {
  const std::string verb = text_at(command, 0);
  const std::string target = text_at(command, 1);
  if (verb == "help") {
    Bottle out{Value::word("many")};
    for (const char* line : kHelp) out.push_back(Value::string(line));
    return done(std::move(out));
  }
  if (verb == "ver") return done({Value::word("ver"), whole(1), whole(2), whole(3)});
  if (verb == "list") return done(list(actions, port, command));
  if (verb == "prop") return done(properties_command(actions, port, properties, command));
  if (verb == "add") {
    actions.add_output(port, target, text_at(command, 2), [done, port, target](const Status& status) {
      if (status)
        return done({whole(0), Value::string("Added connection from " + port + " to " + target + "\r\n")});
      done({whole(-1), Value::string(status.error().message + "\r\n")});
    });
    return;
  }
  if (verb == "del") {
    actions.remove(port, target, true, true, [done, port, target](bool output, bool input) {
      std::string said;
      if (output || !input) {
        said = output ? "Removed connection from " + port + " to " + target + "\r\n"
                      : "Could not find an outgoing connection to " + target + "\r\n";
      }
      if (input || !output) {
        said += input ? "Removing connection from " + target + " to " + port + "\r\n"
                      : "Could not find an incoming connection from " + target + "\r\n";
      }
      done({whole(output || input ? 0 : -1), Value::string(said)});
    });
    return;
  }
  if ((verb == "set" || verb == "get") && (target == "in" || target == "out")) {
    return done({whole(-1), Value::string("connections have no parameters here\r\n")});
  }
  if (verb == "atch" || verb == "dtch") {
    return done({Value::word("fail"), Value::string("port monitors are not had here")});
  }
  done({Value::word("nak"), Value::string("Command not understood, try [help]")});
}

std::string describe(const AdminActions& actions, const std::string& port) {
  std::string out = "This is " + port + " at " + actions.address_of(port) + "\r\n";
  for (const bool outgoing : {true, false}) {
    const std::vector<Route> routes = actions.routes(port, outgoing);
    for (const Route& route : routes) {
      out += fmt::format("There is an {} connection from {} to {} using {}\r\n",
                         outgoing ? "output" : "input", route.from, route.to, route.carrier);
    }
    if (routes.empty())
      out += outgoing ? "There are no outgoing connections\r\n" : "There are no incoming connections\r\n";
  }
  return out;
}

std::string help_for_people(const std::string& port, const std::string& about) {
  std::string out = "This is " + port + ": " + about + "\r\n";
  for (const char* line :
       {"d            the next line is a message; an answer comes, if the port answers",
        "D            the next line is a message; no answer is wanted",
        "anything     that is none of these is a message too",
        "a            the next line is an administrative command: [help] lists them",
        "r            read from now on: the port sends what it has",
        "*            what this port is connected to",
        "/port        connect this output to a port; !/port disconnects it, ~/port disconnects an input",
        "q            the end"}) {
    out += std::string("  ") + line + "\r\n";
  }
  return out;
}

}  // namespace nido::yarp
