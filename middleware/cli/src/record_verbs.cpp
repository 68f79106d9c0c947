#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <thread>

#include "nido/launcher/suggest.h"
#include "nido/recorder/recorder.h"
#include "nido/recorder/replayer.h"
#include "verbs.h"

namespace nido::cli {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPeriod{10};

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

// One line that is written over and over on a terminal; nothing elsewhere.
class ProgressLine {
 public:
  ProgressLine() : on_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  // True about every half second, if there is a terminal to show something on.
  bool is_due() {
    if (!on_ || seconds_since(last_) < 0.5) return false;
    last_ = SteadyClock::now();
    return true;
  }
  void show(const std::string& text) {
    fmt::print(stderr, "\r\x1b[K{}", text);
    shown_ = true;
  }
  void clear() {
    if (shown_) fmt::print(stderr, "\r\x1b[K");
    shown_ = false;
  }

 private:
  const bool on_;
  bool shown_ = false;
  SteadyClock::time_point last_;
};

struct Totals {
  std::uint64_t ports = 0;
  std::uint64_t messages = 0;
  std::uint64_t lost = 0;
  std::string worst;  // the port that lost most
  std::uint64_t most = 0;
};

Totals totals_of(const std::vector<RecordedPort>& ports) {
  Totals totals;
  for (const auto& port : ports) {
    if (port.refused.empty()) ++totals.ports;
    totals.messages += port.messages;
    totals.lost += port.lost;
    if (port.lost > totals.most) {
      totals.most = port.lost;
      totals.worst = port.name;
    }
  }
  return totals;
}

std::string size_of(double bytes) {
  return bytes < 1e6 ? fmt::format("{:.1f} kB", bytes * 1e-3) : fmt::format("{:.1f} MB", bytes * 1e-6);
}

// What `nido replay --info` and a finished recording show of a port.
void print_port(const std::string& name, const std::string& type, std::uint64_t messages, double duration_s,
                std::uint64_t lost) {
  fmt::print("  {:<36} {:<30} {:>9}{}{}\n", name, type, messages,
             duration_s > 0 && messages > 1
                 ? fmt::format("  {:8.2f} Hz", static_cast<double>(messages - 1) / duration_s)
                 : "",
             lost > 0 ? fmt::format("  {} lost", lost) : "");
}

int replay_info(const mcap::Reader& reader, const std::string& file, bool json) {
  const double duration_s = static_cast<double>(reader.end_ns() - reader.start_ns()) * 1e-9;
  const auto* recording = reader.metadata_named("nido.recording");
  const auto* losses = reader.metadata_named("nido.losses");
  std::map<std::string, std::uint16_t> by_name;
  for (const auto& [id, channel] : reader.channels()) by_name.emplace(channel.topic, id);
  Json ports = Json::array();
  for (const auto& [name, id] : by_name) {
    const auto& channel = reader.channels().at(id);
    const auto count = reader.message_counts().find(id);
    const auto schema = reader.schemas().find(channel.schema_id);
    const auto type = channel.metadata.find("type");
    const auto lost = losses == nullptr ? std::string() : [&] {
      const auto found = losses->find(name);
      return found == losses->end() ? std::string("0") : found->second;
    }();
    ports.push_back({{"name", name},
                     {"type", type != channel.metadata.end()     ? type->second
                              : schema != reader.schemas().end() ? schema->second.name
                                                                 : ""},
                     {"encoding", channel.message_encoding},
                     {"schema", schema != reader.schemas().end() ? schema->second.encoding : ""},
                     {"metadata", channel.metadata},
                     {"messages", count == reader.message_counts().end() ? 0 : count->second},
                     {"lost", lost.empty() ? Json(nullptr) : Json(std::stoull(lost))}});
  }
  if (json) {
    Json info = {{"file", file},
                 {"messages", reader.message_count()},
                 {"duration_s", duration_s},
                 {"start_ns", reader.start_ns()},
                 {"end_ns", reader.end_ns()},
                 {"damage", reader.damage()},
                 {"ports", ports}};
    if (recording != nullptr) info["recording"] = *recording;
    fmt::print("{}\n", info.dump(2));
    return 0;
  }
  fmt::print("{}: {:.2f} s, {} messages on {} ports", file, duration_s, reader.message_count(), ports.size());
  if (recording != nullptr && recording->contains("clock")) {
    fmt::print(", {} time", recording->at("clock"));
    if (recording->contains("started")) fmt::print(", begun {}", recording->at("started"));
  }
  fmt::print("\n");
  for (const auto& port : ports) {
    print_port(port["name"], port["type"], port["messages"], duration_s,
               port["lost"].is_null() ? 0 : port["lost"].get<std::uint64_t>());
  }
  if (!reader.damage().empty()) fmt::print("damage: {}\n", reader.damage());
  return 0;
}

}  // namespace

int record(const Common& common, const RecordRequest& request) {
  auto session = join(common, Ending::kWhenDone);
  if (!session) return fail(common, session.error());
  settle(*session->directory);
  if (interrupted()) return 130;
  RecorderOptions options;
  options.file = request.file;
  options.ports = request.ports;
  options.except = request.except;
  options.memory_bytes = static_cast<std::size_t>(request.memory_mb * 1e6);
  options.clock = request.clock == "wall"        ? RecorderOptions::Clock::kWall
                  : request.clock == "simulated" ? RecorderOptions::Clock::kSimulated
                                                 : RecorderOptions::Clock::kAuto;
  options.writer.compression =
      request.compression == "none" ? mcap::Compression::kNone : mcap::Compression::kZstd;
  auto recorder = Recorder::open(*session->node, *session->directory, options);
  if (!recorder) return fail(common, recorder.error());
  if (!common.json) {
    fmt::print("recording {} port(s) of domain {} into {} on {} time; Ctrl-C ends it\n",
               totals_of((*recorder)->ports()).ports, common.domain, request.file,
               (*recorder)->on_simulated_time() ? "simulated" : "wall");
    for (const auto& name : (*recorder)->missing()) fmt::print("  {} is waited for\n", name);
    std::fflush(stdout);
  }
  const auto start = SteadyClock::now();
  Status status;
  {
    ProgressLine progress;
    while (!interrupted() && status && (request.for_s <= 0 || seconds_since(start) < request.for_s)) {
      status = (*recorder)->poll();
      if (progress.is_due()) {
        const auto totals = totals_of((*recorder)->ports());
        progress.show(fmt::format("{:.1f} s  {} ports  {} messages  {} written  {} lost",
                                  seconds_since(start), totals.ports, totals.messages,
                                  size_of(static_cast<double>((*recorder)->file_bytes())), totals.lost));
      }
      std::this_thread::sleep_for(kPeriod);
    }
  }
  const double took_s = seconds_since(start);
  const Status closing = (*recorder)->close();
  if (status) status = closing;
  const auto ports = (*recorder)->ports();
  const auto missing = (*recorder)->missing();
  const auto totals = totals_of(ports);
  if (common.json) {
    Json list = Json::array();
    for (const auto& port : ports) {
      list.push_back({{"name", port.name},
                      {"type", port.type},
                      {"profile", port.profile},
                      {"messages", port.messages},
                      {"bytes", port.bytes},
                      {"lost", port.lost},
                      {"refused", port.refused}});
    }
    fmt::print("{}\n", Json{{"file", request.file},
                            {"seconds", took_s},
                            {"messages", totals.messages},
                            {"lost", totals.lost},
                            {"file_bytes", (*recorder)->file_bytes()},
                            {"ports", list},
                            {"missing", missing}}
                           .dump(2));
  } else {
    for (const auto& port : ports) {
      if (port.refused.empty()) print_port(port.name, port.type, port.messages, 0, port.lost);
    }
    fmt::print("{}: {:.1f} s, {} messages of {} ports, {}, {} lost\n", request.file, took_s, totals.messages,
               totals.ports, size_of(static_cast<double>((*recorder)->file_bytes())), totals.lost);
  }
  if (!status) return fail(common, status.error());
  for (const auto& port : ports) {
    if (!port.refused.empty()) {
      return fail(common,
                  {ErrorCode::kFailed, fmt::format("{} was not recorded: {}", port.name, port.refused)});
    }
  }
  if (!missing.empty()) {
    return fail(common,
                {ErrorCode::kNotFound, fmt::format("never there in domain {}: {}; the others are in the file",
                                                   common.domain, join_words(missing))});
  }
  if (totals.lost > 0) {
    return fail(
        common,
        {ErrorCode::kFailed,
         fmt::format("{} messages that were written are not in the file, {} of them of {}: this machine "
                     "was too slow; record fewer ports, or give it more --memory",
                     totals.lost, totals.most, totals.worst)});
  }
  return 0;
}

int replay(const Common& common, const ReplayRequest& request) {
  auto reader = mcap::Reader::open(request.file);
  if (!reader) return fail(common, reader.error());
  if (request.info) return replay_info(**reader, request.file, common.json);
  ReplayOptions options;
  if (request.rate == "max") {
    options.rate.reset();
  } else {
    char* end = nullptr;
    const double rate = std::strtod(request.rate.c_str(), &end);
    if (request.rate.empty() || *end != '\0' || !(rate > 0 && rate <= 1e6)) {
      return fail(common, {ErrorCode::kInvalidArgument,
                           fmt::format("--rate {} is neither a number above 0 nor 'max'", request.rate)});
    }
    options.rate = rate;
  }
  options.ports = request.ports;
  options.except = request.except;
  options.loop = request.loop;
  options.from_s = request.from_s;
  if (request.to_s >= 0) options.to_s = request.to_s;
  options.readers = static_cast<std::size_t>(request.readers);
  options.wait_s = common.wait_s;
  const std::string damage = (*reader)->damage();
  const double duration_s = static_cast<double>((*reader)->end_ns() - (*reader)->start_ns()) * 1e-9;

  auto session = join(common, Ending::kWhenDone);
  if (!session) return fail(common, session.error());
  NodeOptions visible;
  visible.name = request.name;
  visible.domain = common.domain;
  visible.handle_signals = false;
  if (!request.lockstep.empty()) {
    visible.clock = ClockMode::kLockstep;
    visible.parameters["lockstep"]["nodes"] = request.lockstep;
  }
  auto node = Node::create(visible);
  if (!node) return fail(common, node.error());
  auto replayer = Replayer::open(**node, *session->node, std::move(*reader), options);
  if (!replayer) return fail(common, replayer.error());
  (*node)->set_ready();
  if (!common.json) {
    fmt::print("replaying {} ({:.1f} s) on {} port(s) in domain {}, rate {}\n", request.file, duration_s,
               (*replayer)->ports().size(), common.domain, request.rate);
    if (!damage.empty()) fmt::print(stderr, "the file is damaged: {}\n", damage);
    std::fflush(stdout);
  }
  const auto start = SteadyClock::now();
  Status status;
  {
    ProgressLine progress;
    status = (*replayer)->run([&](const Replayer::Progress& now) {
      if (progress.is_due()) {
        progress.show(fmt::format("{:.1f} of {:.1f} s  {} messages", now.at_s, duration_s, now.messages));
      }
      return interrupted();
    });
  }
  const auto& done = (*replayer)->progress();
  if (common.json) {
    fmt::print("{}\n", Json{{"file", request.file},
                            {"ports", (*replayer)->ports()},
                            {"messages", done.messages},
                            {"failed", done.failed},
                            {"at_s", done.at_s},
                            {"seconds", seconds_since(start)},
                            {"damage", damage}}
                           .dump(2));
  } else {
    fmt::print("{} messages in {:.1f} s\n", done.messages, seconds_since(start));
  }
  if (interrupted()) return 130;
  if (!status) return fail(common, status.error());
  if (done.failed > 0) {
    return fail(common,
                {ErrorCode::kFailed,
                 fmt::format("{} messages could not be kept for a reader that is behind", done.failed)});
  }
  return 0;
}

}  // namespace nido::cli
