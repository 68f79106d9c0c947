#include "nido/recorder/recorder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fnmatch.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>

#include "nido/middleware/port_name.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/raw_message.h"

namespace nido {
namespace {

using SteadyClock = std::chrono::steady_clock;

// messages of one port that may wait; their bytes are bounded in all (RecorderOptions::memory_bytes)
constexpr std::size_t kDepth = 20'000;
// a recorder that is killed loses less than a second: chunks end after this time
constexpr std::chrono::milliseconds kChunkAge{500};
constexpr std::chrono::milliseconds kLookEvery{150};
// A writer is discovered before the node that announces it as a port. One that nobody announces for so long
// belongs to another program.
constexpr std::chrono::milliseconds kForeignAfter{1500};
constexpr double kClockPatience_s = 1.0;

// A type that nodes use themselves is there already, and a node has one way to read a type only.
// What there is to be recorded.
struct Candidate {
  std::string type;
  Profile profile = Profile::kSensor;
  std::string node;
};

struct Port {
  RecordedPort told;
  std::string node;
  std::uint16_t channel = 0;
  bool is_recorded = false;  // else only listened to: /clock
  bool in_lockstep = false;
  std::unique_ptr<RawInput> input;
};

struct Waiting {
  std::uint64_t log_time_ns = 0;
  Port* port = nullptr;
  RawReceived received;
};

class FileRecorder final : public Recorder {
 public:
  FileRecorder(Node& looker, Directory& directory, RecorderOptions options, Node* member)
      : looker_(looker),
        directory_(directory),
        options_(std::move(options)),
        member_(member),
        intake_(std::make_shared<RawIntake>()) {
    intake_->most_bytes = options_.memory_bytes;
  }
  ~FileRecorder() override { (void)close(); }

  Status begin() {
    for (const auto& name : options_.ports) {
      if (name.find_first_of("*?[") != std::string::npos) continue;
      if (auto status = check_port_name(name); !status) return status;
      if (name.ends_with(":i")) {
        return Error{ErrorCode::kInvalidArgument,
                     name + " is an input: record the output that feeds it (nido port info " + name + ")"};
      }
      missing_.insert(name);
    }
    simulated_ = options_.clock == RecorderOptions::Clock::kSimulated ||
                 (options_.clock == RecorderOptions::Clock::kAuto && candidates(true).contains("/clock"));
    if (auto status = keep_old_file(options_.file); !status) return status;
    auto writer = mcap::Writer::create(options_.file, options_.writer);
    if (!writer) return writer.error();
    writer_ = std::move(*writer);
    const std::time_t now = std::time(nullptr);
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    if (auto status = writer_->write(
            mcap::Metadata{"nido.recording",
                           {{"clock", simulated_ ? "simulated" : "wall"},
                            {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
                            {"host", host},
                            {"domain", std::to_string(looker_.options().domain)},
                            {"lockstep", member_ != nullptr ? "true" : "false"}}});
        !status) {
      return status;
    }
    if (simulated_ && member_ == nullptr) {
      // messages that come before the first time would seem to be from time 0
      open_port("/clock", {"rosgraph_msgs/msg/Clock", Profile::kState, ""});
      const auto deadline = SteadyClock::now() + std::chrono::duration<double>(kClockPatience_s);
      const auto clock = ports_.find("/clock");
      while (clock != ports_.end() && clock->second.input && intake_->clock_ns.load() < 0 &&
             SteadyClock::now() < deadline) {
        clock->second.input->wait_for_message(0.05);
      }
    }
    look_for_ports();
    return {};
  }

  Status poll() override {
    const std::lock_guard lock(mutex_);
    if (closed_) return {};
    if (SteadyClock::now() - last_look_ >= kLookEvery) look_for_ports();
    if (auto status = write_what_came(false, 0); !status) return status;
    const auto age = writer_->chunk_age();
    return age && *age >= kChunkAge ? writer_->flush() : Status();
  }

  Status take_tick(Time now) override {
    const std::lock_guard lock(mutex_);
    if (closed_) return {};
    intake_->clock_ns.store(now.ns);
    if (auto status = write_what_came(true, now.ns); !status) return status;
    const auto age = writer_->chunk_age();
    return age && *age >= kChunkAge ? writer_->flush() : Status();
  }

  Status close() override {
    const std::lock_guard lock(mutex_);
    if (closed_ || !writer_) return {};
    closed_ = true;
    Status status = write_what_came(true, std::max<std::int64_t>(intake_->clock_ns.load(), 0));
    if (status) status = write_what_came(false, 0);
    mcap::Metadata losses{"nido.losses", {}};
    std::uint64_t total = 0;
    for (auto& [name, port] : ports_) {
      count_losses(port);
      port.input.reset();
      if (!port.is_recorded) continue;
      total += port.told.lost;
      if (port.told.lost > 0) losses.entries[name] = std::to_string(port.told.lost);
    }
    losses.entries["total"] = std::to_string(total);
    if (status) status = writer_->write(losses);
    const Status closing = writer_->close();
    return status ? closing : status;
  }

  [[nodiscard]] bool follows(const std::vector<std::string>& nodes) override {
    const std::lock_guard lock(mutex_);
    look_for_ports();
    const auto is_live = [&](const std::string& name) {
      const auto found = ports_.find(name);
      if (found == ports_.end()) return false;
      if (!found->second.input) return true;  // refused: it will never be
      const auto connections = found->second.input->connections();
      return !connections.empty() && connections.front().live;
    };
    for (const auto& name : nodes) {
      const auto node = directory_.node(name);
      if (!node || node->state == "starting") return false;
      for (const auto& port : node->ports) {
        if (port.direction == "output" && is_wanted(port.name) && !is_live(port.name)) return false;
      }
    }
    return !is_wanted("/clock") || is_live("/clock");
  }

  [[nodiscard]] std::vector<RecordedPort> ports() override {
    const std::lock_guard lock(mutex_);
    std::vector<RecordedPort> all;
    for (auto& [name, port] : ports_) {
      count_losses(port);
      if (port.is_recorded || !port.told.refused.empty()) all.push_back(port.told);
    }
    return all;
  }
  [[nodiscard]] std::vector<std::string> missing() override {
    const std::lock_guard lock(mutex_);
    return {missing_.begin(), missing_.end()};
  }
  [[nodiscard]] bool on_simulated_time() const override { return simulated_; }
  [[nodiscard]] std::uint64_t file_bytes() override {
    const std::lock_guard lock(mutex_);
    return writer_->file_bytes();
  }

 private:
  [[nodiscard]] bool is_wanted(const std::string& name) const {
    return (options_.ports.empty() || port_matches(name, options_.ports)) &&
           !port_matches(name, options_.except);
  }

  // Every output that there is, by port name.
  std::map<std::string, Candidate> candidates(bool at_once) {
    std::map<std::string, Candidate> found;
    std::set<std::string> topics;
    for (const auto& node : directory_.nodes()) {
      for (const auto& port : node.ports) {
        if (port.direction != "output") continue;
        const auto profile = profile_from_string(port.profile);
        found[port.name] = {port.type, profile ? *profile : Profile::kSensor, node.name};
        topics.insert(topic_of(port.name));
      }
    }
    for (const auto& topic : directory_.topics()) {
      if (topic.writers == 0 || !topic.topic.starts_with("rt/") || topics.contains(topic.topic)) continue;
      if (topic.topic.starts_with("rt/nido/")) continue;
      const std::string name = topic.topic.substr(2);
      if (name == "/log") {
        found[name] = {topic.type, Profile::kEvent, ""};
      } else if (name == "/clock") {
        found[name] = {topic.type, Profile::kState, ""};
      } else {
        const auto first_seen = foreign_.emplace(topic.topic, SteadyClock::now()).first->second;
        if (at_once || SteadyClock::now() - first_seen >= kForeignAfter) {
          found[name] = {topic.type, Profile::kSensor, ""};
        }
      }
    }
    return found;
  }

  void look_for_ports() {
    last_look_ = SteadyClock::now();
    for (const auto& [name, candidate] : candidates(false)) {
      if (!ports_.contains(name) && is_wanted(name)) open_port(name, candidate);
    }
  }

  void open_port(const std::string& name, const Candidate& candidate) {
    Port& port = ports_[name];
    port.told.name = name;
    port.told.type = candidate.type;
    port.told.profile = to_string(candidate.profile);
    port.node = candidate.node;
    const bool is_clock = candidate.type == "rosgraph_msgs/msg/Clock";
    // the barrier bounds what waits in lockstep, and nothing may be dropped there
    std::optional<Error> why;
    if (member_ != nullptr && !is_own_type(candidate.type) && !candidate.node.empty()) {
      port.in_lockstep = true;
      why = connect(*member_, raw_message_type(candidate.type, nullptr, is_clock), candidate.profile, port);
      // what best effort writes from outside of the lockstep is read outside of it
      if (why) port.in_lockstep = false;
    }
    if (!port.in_lockstep) {
      why = connect(looker_, raw_message_type(candidate.type, intake_, is_clock), candidate.profile, port);
    }
    missing_.erase(name);
    missing_.erase(name.substr(0, name.rfind(':')));
    if (why) {
      port.told.refused = why->message;
      port.input.reset();
      return;
    }
    port.is_recorded = is_wanted(name);
    if (port.is_recorded) {
      if (auto status = make_channel(port); !status) port.told.refused = status.error().message;
    }
  }

  static std::optional<Error> connect(Node& node, const MessageType& type, Profile profile, Port& port) {
    const std::string own =
        "/" + node.options().name + port.told.name.substr(0, port.told.name.find(':')) + ":i";
    auto input = node.open_raw_input(own, type, profile, kDepth);
    if (!input) return input.error();
    if (auto status = (*input)->connect(port.told.name); !status) return status.error();
    port.input = std::move(*input);
    return std::nullopt;
  }

  // Of a type that this program was not built with, its node may tell the definition.
  std::string definition_of(const Port& port) {
    if (const auto idl = idl_text_of(port.told.type); !idl.empty()) return std::string(idl);
    if (port.node.empty()) return "";
    constexpr double kPatience_s = 1.0;
    const auto answer = looker_.call("/" + port.node + "/control", "idl " + port.told.name, kPatience_s);
    constexpr std::string_view kOk = "[ok]\n";
    return answer && answer->starts_with(kOk) ? answer->substr(kOk.size()) : "";
  }

  Status make_channel(Port& port) {
    std::uint16_t schema_id = 0;
    if (const auto known = schemas_.find(port.told.type); known != schemas_.end()) {
      schema_id = known->second;
    } else if (const std::string idl = definition_of(port); !idl.empty()) {
      auto added = writer_->add_schema({0, scoped_name_of(port.told.type), "omgidl", idl});
      if (!added) return added.error();
      schema_id = schemas_[port.told.type] = *added;
    }
    mcap::Channel channel{0, schema_id, port.told.name, "cdr", {}};
    channel.metadata = {{"type", port.told.type}, {"profile", port.told.profile}};
    if (!port.node.empty()) channel.metadata["node"] = port.node;
    auto added = writer_->add_channel(channel);
    if (!added) return added.error();
    port.channel = *added;
    return {};
  }

  // Inside the lockstep everything is of the tick; outside, messages are brought into the order of their
  // arrival.
  Status write_what_came(bool in_lockstep, std::int64_t tick_ns) {
    std::vector<Waiting> waiting;
    for (auto& [name, port] : ports_) {
      if (!port.input || port.in_lockstep != in_lockstep) continue;
      while (auto received = port.input->take()) {
        const auto& message = *static_cast<const RawMessage*>(received->message.get());
        if (message.dropped()) {
          ++port.told.lost;
          continue;
        }
        if (!port.is_recorded) continue;
        const std::int64_t time_ns = in_lockstep  ? tick_ns
                                     : simulated_ ? std::max<std::int64_t>(message.clock_ns(), 0)
                                                  : message.arrival_ns();
        waiting.push_back({static_cast<std::uint64_t>(time_ns), &port, std::move(*received)});
      }
    }
    if (!in_lockstep) {
      std::stable_sort(waiting.begin(), waiting.end(), [](const Waiting& a, const Waiting& b) {
        const auto arrival = [](const Waiting& one) {
          return static_cast<const RawMessage*>(one.received.message.get())->arrival_ns();
        };
        return arrival(a) < arrival(b);
      });
    }
    for (Waiting& one : waiting) {
      const auto& raw = *static_cast<const RawMessage*>(one.received.message.get());
      mcap::Message message;
      message.channel_id = one.port->channel;
      message.sequence = static_cast<std::uint32_t>(one.received.sequence);
      message.log_time_ns = one.log_time_ns;
      message.publish_time_ns =
          static_cast<std::uint64_t>(std::max<std::int64_t>(one.received.source_time.ns, 0));
      message.data = raw.bytes();
      if (auto status = writer_->write(message); !status) return status;
      one.port->told.last_ns = one.log_time_ns;
      ++one.port->told.messages;
      one.port->told.bytes += raw.bytes().size();
      one.received.message.reset();
    }
    return {};
  }

  // told.lost holds what was dropped here until the input's own count is added at the end.
  void count_losses(Port& port) {
    if (!port.input) return;
    std::uint64_t lost = 0;
    for (const auto& counters : port.input->connections()) lost += counters.lost;
    port.told.lost += lost - counted_[port.told.name];
    counted_[port.told.name] = lost;
  }

  Node& looker_;
  Directory& directory_;
  const RecorderOptions options_;
  Node* const member_;
  const std::shared_ptr<RawIntake> intake_;
  bool simulated_ = false;

  std::mutex mutex_;  // of what follows
  std::unique_ptr<mcap::Writer> writer_;
  bool closed_ = false;
  std::map<std::string, Port> ports_;
  std::map<std::string, std::uint64_t> counted_;  // losses of inputs that are in told.lost already
  std::map<std::string, std::uint16_t> schemas_;  // by type
  std::set<std::string> missing_;
  std::map<std::string, SteadyClock::time_point> foreign_;  // topics of other programs, first seen when
  SteadyClock::time_point last_look_;
};

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::open(Node& looker, Directory& directory, RecorderOptions options,
                                                 Node* member) {
  auto recorder = std::make_unique<FileRecorder>(looker, directory, std::move(options), member);
  if (auto status = recorder->begin(); !status) return status.error();
  return std::unique_ptr<Recorder>(std::move(recorder));
}

bool port_matches(const std::string& port_name, const std::vector<std::string>& patterns) {
  const std::string bare = port_name.ends_with(":o") ? port_name.substr(0, port_name.size() - 2) : port_name;
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), port_name.c_str(), 0) == 0 ||
           fnmatch(pattern.c_str(), bare.c_str(), 0) == 0;
  });
}

Status keep_old_file(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  if (fs::is_directory(file, error)) {
    return Error{ErrorCode::kInvalidArgument, file + " is a folder: name a file in it"};
  }
  // a device or a pipe has nothing to lose
  if (!fs::is_regular_file(file, error)) return {};
  fs::rename(file, file + "~", error);
  if (error) {
    return Error{ErrorCode::kFailed,
                 file + " is there and cannot be renamed to " + file + "~: " + error.message()};
  }
  return {};
}

}  // namespace nido
