#include "nido/recorder/replayer.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include "nido/middleware/port_name.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/raw_message.h"
#include "nido/recorder/recorder.h"

namespace nido {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr const char* kClockType = "rosgraph_msgs/msg/Clock";
// when the recording has no /clock of its own
constexpr std::int64_t kClockPeriod_ns = 10'000'000;
constexpr std::chrono::milliseconds kGlance{50};

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

class FileReplayer final : public Replayer {
 public:
  FileReplayer(Node& node, Node& side, std::unique_ptr<mcap::Reader> reader, ReplayOptions options)
      : node_(node), side_(side), reader_(std::move(reader)), options_(std::move(options)) {}

  Status begin() {
    const auto* recording = reader_->metadata_named("nido.recording");
    const bool is_simulated =
        recording != nullptr && recording->contains("clock") && recording->at("clock") == "simulated";
    bool has_clock = false;
    for (const auto& [id, channel] : reader_->channels()) {
      if (!is_wanted(channel.topic)) continue;
      if (channel.message_encoding != "cdr") {
        return Error{ErrorCode::kUnsupported,
                     channel.topic + " was recorded as '" + channel.message_encoding +
                         "', and ports carry cdr; leave it out with --except " + channel.topic};
      }
      const std::string type = type_of(channel);
      if (channel.topic == "/clock" || type == kClockType) {
        has_clock = true;
        clock_channels_.insert(id);
      }
      wanted_.insert(id);
      // in lockstep the node itself publishes the clock
      if (clock_channels_.contains(id) && in_lockstep()) continue;
      const auto same = by_topic_.find(channel.topic);
      if (same != by_topic_.end()) {
        outputs_[id] = same->second;
        continue;
      }
      auto output = open_output(channel.topic, type, channel);
      if (!output) return output.error();
      outputs_[id] = by_topic_[channel.topic] = std::shared_ptr<RawOutput>(std::move(*output));
    }
    if (wanted_.empty()) {
      return Error{ErrorCode::kNotFound, reader_->channels().empty()
                                             ? "the file holds no port"
                                             : "no port of the file is asked for; nido replay FILE --info "
                                               "shows those that it holds"};
    }
    if (is_simulated && !has_clock && !in_lockstep()) {
      auto output = open_output("/clock", kClockType, {});
      if (!output) return output.error();
      made_clock_ = std::move(*output);
    }
    return {};
  }

  Status run(const std::function<bool(const Progress&)>& is_stopped) override {
    if (auto status = wait_for_readers(is_stopped); !status) return status;
    const auto from_ns =
        static_cast<std::int64_t>(reader_->start_ns()) + Time::from_seconds(options_.from_s).ns;
    const std::int64_t to_ns =
        options_.to_s ? static_cast<std::int64_t>(reader_->start_ns()) + Time::from_seconds(*options_.to_s).ns
                      : std::numeric_limits<std::int64_t>::max();
    do {
      reader_->rewind(static_cast<std::uint64_t>(from_ns), wanted_);
      if (auto status = run_once(from_ns, to_ns, is_stopped); !status) return status;
    } while (options_.loop && !is_stopped(progress_) && progress_.messages > 0);
    const auto end = SteadyClock::now();
    while (seconds_since(end) < options_.linger_s && !is_stopped(progress_))
      std::this_thread::sleep_for(kGlance);
    return {};
  }

  Status take_tick(Time now, Time next) override {
    if (!is_begun_) reader_->rewind(static_cast<std::uint64_t>(now.ns) + 1, wanted_);
    is_begun_ = true;
    for (;;) {
      if (!next_) next_ = reader_->next();
      if (!next_ || static_cast<std::int64_t>(next_->log_time_ns) > next.ns) return {};
      const auto time_ns = static_cast<std::int64_t>(next_->log_time_ns);
      const auto output = outputs_.find(next_->channel_id);
      if (time_ns > now.ns && output != outputs_.end()) {
        const RawMessage raw(next_->data);
        if (Status written = output->second->write(&raw); !written) return written;
        ++progress_.messages;
        progress_.at_s = static_cast<double>(time_ns - static_cast<std::int64_t>(reader_->start_ns())) * 1e-9;
      }
      next_.reset();
    }
  }

  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] std::vector<std::string> ports() const override {
    std::vector<std::string> names;
    for (const auto& [topic, output] : by_topic_) names.push_back(topic);
    return names;
  }

 private:
  [[nodiscard]] bool in_lockstep() const { return node_.options().clock == ClockMode::kLockstep; }
  [[nodiscard]] bool is_wanted(const std::string& name) const {
    return (options_.ports.empty() || port_matches(name, options_.ports)) &&
           !port_matches(name, options_.except);
  }
  [[nodiscard]] std::string type_of(const mcap::Channel& channel) const {
    if (const auto found = channel.metadata.find("type"); found != channel.metadata.end())
      return found->second;
    const auto schema = reader_->schemas().find(channel.schema_id);
    return schema == reader_->schemas().end() ? "" : ros_name_of(schema->second.name);
  }

  Result<std::unique_ptr<RawOutput>> open_output(const std::string& name, const std::string& type,
                                                 const mcap::Channel& channel) {
    if (type.empty()) {
      return Error{ErrorCode::kUnsupported,
                   name + " was recorded without its type; leave it out with --except"};
    }
    Profile profile = name == "/clock" ? Profile::kState : Profile::kEvent;
    if (const auto found = channel.metadata.find("profile"); found != channel.metadata.end()) {
      if (auto known = profile_from_string(found->second)) profile = *known;
    }
    Node& node = is_own_type(type) ? side_ : node_;
    return node.open_raw_output(name, raw_message_type(type), profile, 64);
  }

  // A port's inputs connect some tenths of a second after it appears, and what is written before is lost.
  Status wait_for_readers(const std::function<bool(const Progress&)>& is_stopped) {
    const auto start = SteadyClock::now();
    auto last_change = start;
    std::size_t before = 0;
    for (;;) {
      std::size_t count = 0;
      std::string without;
      for (const auto& [name, output] : by_topic_) {
        count += output->reader_count();
        if (output->reader_count() < options_.readers) without = name;
      }
      if (count != before) last_change = SteadyClock::now();
      before = count;
      if (is_stopped(progress_)) return {};
      if (options_.readers > 0) {
        if (without.empty()) return {};
        if (seconds_since(start) > options_.wait_s) {
          return Error{ErrorCode::kTimeout, without + " did not get " + std::to_string(options_.readers) +
                                                " reader(s) within " + std::to_string(options_.wait_s) +
                                                " s"};
        }
      } else if (seconds_since(start) > 0.8 &&
                 (seconds_since(last_change) > 0.4 || seconds_since(start) > 4)) {
        return {};
      }
      std::this_thread::sleep_for(kGlance);
    }
  }

  // Waits until a recorded time is due; false when stopped.
  bool wait_until_due(std::int64_t time_ns, std::int64_t from_ns, SteadyClock::time_point start,
                      const std::function<bool(const Progress&)>& is_stopped) {
    if (options_.rate) {
      const auto due = start + std::chrono::nanoseconds(static_cast<std::int64_t>(
                                   static_cast<double>(time_ns - from_ns) / *options_.rate));
      while (SteadyClock::now() < due) {
        if (is_stopped(progress_)) return false;
        std::this_thread::sleep_until(std::min(due, SteadyClock::now() + kGlance));
      }
    }
    const bool is_time_to_ask = SteadyClock::now() - last_asked_ > kGlance;
    if (is_time_to_ask) last_asked_ = SteadyClock::now();
    return !is_time_to_ask || !is_stopped(progress_);
  }

  Status run_once(std::int64_t from_ns, std::int64_t to_ns,
                  const std::function<bool(const Progress&)>& is_stopped) {
    const auto start = SteadyClock::now();
    const auto file_start_ns = static_cast<std::int64_t>(reader_->start_ns());
    std::int64_t next_clock_ns = from_ns;
    // lockstep: what was recorded at one time belongs to one tick, which comes after it
    std::int64_t tick_ns = -1;
    while (const auto message = reader_->next()) {
      const auto time_ns = static_cast<std::int64_t>(message->log_time_ns);
      if (time_ns > to_ns) break;
      if (in_lockstep() && tick_ns >= 0 && time_ns > tick_ns) {
        if (auto status = node_.publish_clock({tick_ns}); !status) return status;
      }
      tick_ns = std::max(time_ns, tick_ns);
      for (; made_clock_ && next_clock_ns <= time_ns; next_clock_ns += kClockPeriod_ns) {
        if (!wait_until_due(next_clock_ns, from_ns, start, is_stopped)) return {};
        const RawMessage clock(bytes_of_clock(next_clock_ns));
        (void)made_clock_->write(&clock);
      }
      if (!wait_until_due(time_ns, from_ns, start, is_stopped)) return {};
      progress_.at_s = static_cast<double>(time_ns - file_start_ns) * 1e-9;
      const auto output = outputs_.find(message->channel_id);
      if (output == outputs_.end()) continue;
      const RawMessage raw(message->data);
      if (output->second->write(&raw)) {
        ++progress_.messages;
      } else {
        ++progress_.failed;
      }
    }
    return in_lockstep() && tick_ns >= 0 ? node_.publish_clock({tick_ns}) : Status();
  }

  Node& node_;
  Node& side_;
  const std::unique_ptr<mcap::Reader> reader_;
  const ReplayOptions options_;
  Progress progress_;
  SteadyClock::time_point last_asked_;
  bool is_begun_ = false;              // by take_tick()
  std::optional<mcap::Message> next_;  // its turn has not come yet
  std::set<std::uint16_t> wanted_;
  std::set<std::uint16_t> clock_channels_;
  std::map<std::uint16_t, std::shared_ptr<RawOutput>> outputs_;  // by channel
  std::map<std::string, std::shared_ptr<RawOutput>> by_topic_;
  std::unique_ptr<RawOutput> made_clock_;
};

}  // namespace

Result<std::unique_ptr<Replayer>> Replayer::open(Node& node, Node& side, std::unique_ptr<mcap::Reader> reader,
                                                 ReplayOptions options) {
  auto replayer = std::make_unique<FileReplayer>(node, side, std::move(reader), std::move(options));
  if (auto status = replayer->begin(); !status) return status.error();
  return std::unique_ptr<Replayer>(std::move(replayer));
}

}  // namespace nido
