#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <sstream>

#include "nido/middleware/port_name.h"
#include "verbs.h"

namespace nido::cli {
namespace {
using SteadyClock = std::chrono::steady_clock;

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

std::string own_port(const std::string& what) { return fmt::format("/nido_{}/{}", getpid(), what); }

void print_line(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

struct Reader {
  Source source;
  std::unique_ptr<RawInput> input;
};

// An input of our own on somebody's output.
Result<Reader> listen(const Session& session, const Common& common, const std::string& port) {
  auto source = find_source(session, common, port);
  if (!source) return source.error();
  Reader reader{*source, nullptr};
  auto input = session.node->open_raw_input(own_port("read:i"), source->type->type, source->profile, 1024);
  if (!input) return input.error();
  reader.input = std::move(*input);
  if (auto status = reader.input->connect(port); !status) return status.error();
  return reader;
}

Json json_of_counters(const ConnectionCounters& counters) {
  return {{"source", counters.source},
          {"live", counters.live},
          {"received", counters.received},
          {"lost", counters.lost},
          {"bytes", counters.bytes}};
}

// How long the messages of a connection were on their way.
struct Delays {
  std::uint64_t late = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> counts;  // less than so many us: so many messages
  // Upper bound of the class that this part of the messages reaches, us.
  [[nodiscard]] std::uint64_t quantile_us(double part) const {
    std::uint64_t all = 0;
    for (const auto& [below_us, count] : counts) all += count;
    std::uint64_t sum = 0;
    for (const auto& [below_us, count] : counts) {
      sum += count;
      if (static_cast<double>(sum) >= part * static_cast<double>(all)) return below_us;
    }
    return 0;
  }
};

// By source, from the input's node; empty from one that does not tell.
std::map<std::string, Delays> delays_of(const Session& session, const Common& common,
                                        const Directory::Owner& owner) {
  std::map<std::string, Delays> all;
  if (owner.port.direction != "input" || owner.port.connections.empty()) return all;
  const auto answer =
      session.node->call("/" + owner.node.name + "/control", "delays " + owner.port.name, common.wait_s);
  if (!answer || !answer->starts_with("[ok]")) return all;
  std::istringstream lines(answer->substr(4));
  std::string source;
  std::string late;
  std::string classes;
  while (lines >> source >> late >> classes) {
    Delays& delays = all[source];
    if (!late.starts_with("late=") || !classes.starts_with("us=")) return {};
    delays.late = std::strtoull(late.c_str() + 5, nullptr, 10);
    std::istringstream list(classes.substr(3));
    std::uint64_t below_us = 0;
    std::uint64_t count = 0;
    for (char mark = 0; list >> below_us >> mark >> count; list >> mark) {
      delays.counts.emplace_back(below_us, count);
    }
  }
  return all;
}

}  // namespace

int port_list(const Common& common) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  settle(*session->directory);
  if (interrupted()) return 130;
  struct Row {
    std::string name, direction, type, node;
  };
  std::vector<Row> rows;
  std::vector<std::string> own_topics;
  for (const auto& node : session->directory->nodes()) {
    for (const auto& port : node.ports) {
      rows.push_back({port.name, port.direction, port.type, node.name});
      if (port.direction == "output") own_topics.push_back(topic_of(port.name));
    }
  }
  // writers that are no nido nodes: a ROS 2 node, say
  for (const auto& topic : session->directory->topics()) {
    if (topic.writers == 0 || !topic.topic.starts_with("rt/")) continue;
    if (std::find(own_topics.begin(), own_topics.end(), topic.topic) != own_topics.end()) continue;
    if (topic.topic.starts_with("rt/nido/") || topic.topic == "rt/log") continue;
    rows.push_back({topic.topic.substr(2), "output", topic.type, "-"});
  }
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.name < b.name; });
  if (common.json) {
    Json list = Json::array();
    for (const auto& row : rows)
      list.push_back(
          {{"name", row.name}, {"direction", row.direction}, {"type", row.type}, {"node", row.node}});
    print_line(list.dump(2));
    return 0;
  }
  if (rows.empty()) {
    fmt::print(stderr, "no ports in domain {}\n", common.domain);
    return 0;
  }
  std::size_t name_width = 4;
  std::size_t type_width = 4;
  for (const auto& row : rows) {
    name_width = std::max(name_width, row.name.size());
    type_width = std::max(type_width, row.type.size());
  }
  for (const auto& row : rows) {
    print_line(fmt::format("{:<{}}  {:<7}  {:<{}}  {}", row.name, name_width, row.direction, row.type,
                           type_width, row.node));
  }
  return 0;
}

int port_info(const Common& common, const std::string& name) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto owner = find_port(*session, common, name);
  if (!owner) return fail(common, owner.error());
  const auto& port = owner->port;
  Json connections = Json::array();
  const auto delays = delays_of(*session, common, *owner);
  for (const auto& counters : port.connections) {
    Json connection = json_of_counters(counters);
    if (const auto found = delays.find(counters.source); found != delays.end()) {
      connection["late"] = found->second.late;
      connection["delay_us_below"] = Json::array();
      for (const auto& [below_us, count] : found->second.counts) {
        connection["delay_us_below"].push_back({{"us", below_us}, {"count", count}});
      }
    }
    connections.push_back(connection);
  }
  const Json info = {{"name", port.name},        {"direction", port.direction}, {"type", port.type},
                     {"profile", port.profile},  {"node", owner->node.name},    {"pid", owner->node.pid},
                     {"host", owner->node.host}, {"written", port.written},     {"connections", connections}};
  if (common.json) {
    print_line(info.dump(2));
    return 0;
  }
  print_line(fmt::format("{}: {} of node {} (pid {} on {})", port.name, port.direction, owner->node.name,
                         owner->node.pid, owner->node.host));
  print_line(fmt::format("  type     {}", port.type));
  if (!port.profile.empty()) print_line(fmt::format("  profile  {}", port.profile));
  if (port.direction == "output") print_line(fmt::format("  written  {}", port.written));
  for (const auto& counters : port.connections) {
    print_line(fmt::format("  {} {}{}", port.direction == "output" ? "to" : "from", counters.source,
                           port.direction == "output" ? ""
                                                      : fmt::format(": {}received {}, lost {}",
                                                                    counters.live ? "" : "not there now; ",
                                                                    counters.received, counters.lost)));
    const auto found = delays.find(counters.source);
    if (found == delays.end() || found->second.counts.empty()) continue;
    print_line(fmt::format("    {} bytes, late {}; on their way: half of them below {} us, 99 % below {} us",
                           counters.bytes, found->second.late, found->second.quantile_us(0.5),
                           found->second.quantile_us(0.99)));
  }
  if (port.connections.empty()) print_line("  not connected");
  return 0;
}

int port_read(const Common& common, const std::string& port, int count, double for_s) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto reader = listen(*session, common, port);
  if (!reader) return fail(common, reader.error());
  const auto start = SteadyClock::now();
  int got = 0;
  while (!interrupted() && (count == 0 || got < count) && (for_s <= 0 || seconds_since(start) < for_s)) {
    auto received = reader->input->take();
    if (!received) {
      if (got == 0 && for_s <= 0 && seconds_since(start) > std::max(common.wait_s, 1.0) && count > 0) {
        return fail(common, {ErrorCode::kTimeout,
                             fmt::format("{} is there, but wrote nothing within {:.1f} s (--wait)", port,
                                         seconds_since(start))});
      }
      reader->input->wait_for_message(0.1);
      continue;
    }
    ++got;
    if (common.json) {
      print_line(reader->source.type->to_json(received->message.get(), 0).dump());
    } else {
      print_line(fmt::format("--- {} of {}", received->sequence, received->source));
      fmt::print("{}", text_of(reader->source.type->to_json(received->message.get(), 24)));
      std::fflush(stdout);
    }
  }
  if (interrupted()) return 130;
  return 0;
}

int port_write(const Common& common, const std::string& port, const std::vector<std::string>& words) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto owner = find_port(*session, common, port);
  if (!owner) return fail(common, owner.error());
  if (owner->port.direction == "output") {
    return fail(common, {ErrorCode::kInvalidArgument,
                         fmt::format("{} is an output of node {}: write to an input, whose name ends in :i",
                                     port, owner->node.name)});
  }
  if (owner->port.direction == "service") {
    return fail(common, {ErrorCode::kInvalidArgument,
                         fmt::format("{} is a service: ask it with nido port rpc {} TEXT", port, port)});
  }
  const auto found = type_named(*session, common, port, owner->port.type);
  if (!found) return fail(common, found.error());
  const std::shared_ptr<const AnyType>& type = *found;
  if (type == nullptr) {
    return fail(common,
                {ErrorCode::kUnsupported,
                 fmt::format("{} takes {}, a type that this nido does not know: give its definition with "
                             "--idl FILE",
                             port, owner->port.type)});
  }
  auto value = json_of_words(*type, words);
  if (!value) return fail(common, value.error());
  auto message = type->type.make_message();
  if (auto status = type->from_json(*value, message.get()); !status) {
    return fail(common, {status.error().code,
                         fmt::format("{} takes {}: {}", port, type->name, status.error().message)});
  }
  auto profile = profile_from_string(owner->port.profile);
  const std::string own = own_port("write:o");
  auto output = session->node->open_raw_output(own, type->type, profile ? *profile : Profile::kCommand, 16);
  if (!output) return fail(common, output.error());
  if (auto status = session->directory->connect(own, port, common.wait_s); !status)
    return fail(common, status.error());
  if (!(*output)->wait_for_readers(1, common.wait_s)) {
    return fail(common,
                {ErrorCode::kTimeout, fmt::format("{} did not connect within {} s", port, common.wait_s)});
  }
  if (auto status = (*output)->write(message.get()); !status) return fail(common, status.error());
  // the node tells what it has received about once a second
  const bool confirmed = session->directory->wait(
      [&](const Directory& d) {
        const auto now = d.owner_of(port);
        if (!now || interrupted()) return true;
        return std::any_of(now->port.connections.begin(), now->port.connections.end(),
                           [&own](const ConnectionCounters& counters) {
                             return counters.source == own && counters.received > 0;
                           });
      },
      common.wait_s);
  (void)session->directory->disconnect(own, port, common.wait_s);
  if (!confirmed)
    return fail(common, {ErrorCode::kTimeout,
                         fmt::format("{} did not confirm that it received the message within {} s", port,
                                     common.wait_s)});
  if (interrupted()) return 130;
  if (common.json) print_line(type->to_json(message.get(), 0).dump());
  return 0;
}

int port_rpc(const Common& common, const std::string& port, const std::vector<std::string>& words) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  auto answer = session->node->call(port, text, common.wait_s);
  if (interrupted()) return 130;
  if (!answer) {
    if (answer.error().code == ErrorCode::kNotFound) {
      auto owner = find_port(*session, {common.domain, common.json, 0.2, {}}, port);
      if (!owner) return fail(common, owner.error());
    }
    return fail(common, answer.error());
  }
  print_line(common.json ? Json{{"port", port}, {"request", text}, {"answer", *answer}}.dump() : *answer);
  return answer->starts_with("[fail]") ? 1 : 0;
}

int port_connect(const Common& common, const std::string& output, const std::string& input) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  if (auto owner = find_port(*session, common, input); !owner) return fail(common, owner.error());
  if (auto status = session->directory->connect(output, input, common.wait_s); !status)
    return fail(common, status.error());
  const bool there =
      session->directory->wait([&](const Directory& d) { return d.owner_of(output).has_value(); }, 0.5);
  print_line(common.json
                 ? Json{{"out", output}, {"in", input}, {"live", there}}.dump()
                 : fmt::format("{} -> {}{}", output, input, there ? "" : " (as soon as the output exists)"));
  return 0;
}

int port_disconnect(const Common& common, const std::string& output, const std::string& input) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  if (auto owner = find_port(*session, common, input); !owner) return fail(common, owner.error());
  if (auto status = session->directory->disconnect(output, input, common.wait_s); !status)
    return fail(common, status.error());
  if (common.json) print_line(Json{{"out", output}, {"in", input}}.dump());
  return 0;
}

int port_measure(const Common& common, const std::string& port, Measure measure, double for_s) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto reader = listen(*session, common, port);
  if (!reader) return fail(common, reader.error());
  reader->input->wait_for_message(common.wait_s);
  const auto start = SteadyClock::now();
  std::vector<double> intervals_s;
  std::vector<double> delays_s;
  std::size_t bytes = 0;
  std::size_t messages = 0;
  std::optional<SteadyClock::time_point> before;
  while (!interrupted() && seconds_since(start) < for_s) {
    auto received = reader->input->take();
    if (!received) {
      reader->input->wait_for_message(0.05);
      continue;
    }
    const auto now = SteadyClock::now();
    if (before) intervals_s.push_back(std::chrono::duration<double>(now - *before).count());
    before = now;
    ++messages;
    if (measure == Measure::kBandwidth) bytes += reader->source.type->wire_size(received->message.get());
    if (measure == Measure::kDelay) {
      const auto wall_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                               std::chrono::system_clock::now().time_since_epoch())
                               .count();
      delays_s.push_back(static_cast<double>(wall_ns - received->source_time.ns) * 1e-9);
    }
  }
  const double took_s = seconds_since(start);
  if (messages == 0) {
    if (interrupted()) return 130;
    return fail(common,
                {ErrorCode::kTimeout,
                 fmt::format("{} is there, but wrote nothing within {:.1f} s (--for)", port, took_s)});
  }
  std::uint64_t lost = 0;
  for (const auto& counters : reader->input->connections()) lost += counters.lost;
  Json result = {{"port", port}, {"messages", messages}, {"lost", lost}, {"seconds", took_s}};
  std::string text;
  if (measure == Measure::kBandwidth) {
    result["bytes_per_second"] = static_cast<double>(bytes) / took_s;
    result["bytes_per_message"] = static_cast<double>(bytes) / static_cast<double>(messages);
    text = fmt::format("{:.3f} MB/s, {:.0f} bytes a message", static_cast<double>(bytes) / took_s * 1e-6,
                       static_cast<double>(bytes) / static_cast<double>(messages));
  } else {
    auto& values = measure == Measure::kRate ? intervals_s : delays_s;
    if (values.empty()) values.push_back(took_s);
    double sum = 0;
    for (const double value : values) sum += value;
    const double mean = sum / static_cast<double>(values.size());
    double square = 0;
    for (const double value : values) square += (value - mean) * (value - mean);
    std::sort(values.begin(), values.end());
    const double p95 = values[std::min(values.size() - 1, values.size() * 95 / 100)];
    const std::string unit = measure == Measure::kRate ? "interval_s" : "delay_s";
    result[unit] = {{"mean", mean},
                    {"std", std::sqrt(square / static_cast<double>(values.size()))},
                    {"min", values.front()},
                    {"median", values[values.size() / 2]},
                    {"p95", p95},
                    {"max", values.back()}};
    if (measure == Measure::kRate) {
      result["hz"] = mean > 0 ? 1.0 / mean : 0.0;
      text = fmt::format("{:.2f} Hz; interval {:.2f} ms mean, {:.2f} to {:.2f} ms", 1.0 / mean, mean * 1e3,
                         values.front() * 1e3, values.back() * 1e3);
    } else {
      text = fmt::format("delay {:.3f} ms median, {:.3f} ms p95, {:.3f} ms at most",
                         values[values.size() / 2] * 1e3, p95 * 1e3, values.back() * 1e3);
    }
  }
  print_line(common.json ? result.dump()
                         : fmt::format("{}: {}; {} messages in {:.1f} s, {} lost", port, text, messages,
                                       took_s, lost));
  return interrupted() ? 130 : 0;
}

int port_ping(const Common& common, const std::string& port, int count) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto owner = find_port(*session, common, port);
  if (!owner) return fail(common, owner.error());
  // every node answers on its control service, so the way to the owner of any port can be measured
  const std::string control =
      owner->port.direction == "service" ? port : fmt::format("/{}/control", owner->node.name);
  Json times = Json::array();
  for (int i = 0; i < count && !interrupted(); ++i) {
    const auto start = SteadyClock::now();
    auto answer = session->node->call(control, "help", common.wait_s);
    if (!answer) return fail(common, answer.error());
    const double took_s = seconds_since(start);
    times.push_back(took_s);
    if (!common.json)
      print_line(fmt::format("{} (node {}, pid {}): {:.3f} ms", port, owner->node.name, owner->node.pid,
                             took_s * 1e3));
  }
  if (common.json)
    print_line(Json{{"port", port}, {"node", owner->node.name}, {"round_trip_s", times}}.dump());
  return interrupted() ? 130 : 0;
}

}  // namespace nido::cli
