#include "nido/middleware/clock_control.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <sstream>

#include "nido/middleware/pacer.h"

namespace nido {

namespace {

constexpr std::uint64_t kMostSteps = 1'000'000;
// how often a paused owner looks whether it is asked to stop
constexpr std::chrono::milliseconds kLook{20};

std::string rate_text(std::optional<double> rate) {
  if (!rate) return "max";
  std::ostringstream text;
  text << *rate;
  return text.str();
}

// All of the text as a number; none if it is not one.
template <class T>
std::optional<T> number_of(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class ClockControlImpl final : public ClockControl {
 public:
  ClockControlImpl(Node& node, std::optional<double> rate, bool is_paused)
      : node_(node), rate_(rate), pacer_(rate), is_paused_(is_paused) {}

  Status open() {
    auto service =
        node_.open_service("/clock/rpc:i", [this](const std::string& line) { return command(line); });
    if (!service) return service.error();
    service_ = std::move(*service);
    return {};
  }

  Status wait(Time now) override {
    if (node_.is_stop_asked()) return stopped();
    now_ns_ = now.ns;
    // nobody wants anything: without the lock, which a fast owner would hardly ever leave to others
    if (is_free_) return {};
    std::unique_lock lock(mutex_);
    for (;;) {
      const bool was_paused = is_paused_ && steps_ == 0;
      is_waiting_ = true;
      changed_.notify_all();
      while (is_paused_ && steps_ == 0) {
        if (node_.is_stop_asked()) return stopped();
        changed_.wait_for(lock, kLook);
      }
      is_waiting_ = false;
      if (steps_ > 0) {
        --steps_;
        return {};  // a step is made at once, whatever the rate
      }
      if (was_paused || is_new_rate_) pacer_.restart(rate_);
      is_new_rate_ = false;
      const auto due = pacer_.due(now);
      const std::uint64_t order = orders_;
      while (due && orders_ == order && !node_.is_stop_asked() && std::chrono::steady_clock::now() < *due) {
        changed_.wait_until(lock, std::min(*due, std::chrono::steady_clock::now() + kLook));
      }
      if (orders_ == order || node_.is_stop_asked()) {
        is_free_ = !rate_ && !is_paused_;
        return {};
      }
      // somebody paused, or set another rate, while a far moment was waited for: that counts from here on
    }
  }

  std::string command(const std::string& line) override {
    std::istringstream words(line);
    std::string verb;
    std::string value;
    std::string rest;
    words >> verb >> value >> rest;
    std::unique_lock lock(mutex_);
    if (!rest.empty()) return "[fail] '" + rest + "' is one word too many";
    if (verb == "step") return step(value, lock);
    if (verb == "rate") return set_rate(value);
    if (!value.empty()) return "[fail] " + verb + " takes no value, not '" + value + "'";
    if (verb == "pause" || verb == "run") {
      is_free_ = false;
      is_paused_ = verb == "pause";
      steps_ = 0;
      ++orders_;
      changed_.notify_all();
      return state();
    }
    if (verb == "get" || verb.empty()) return state();
    return "[fail] '" + verb + "' is not understood; there are: get, pause, run, step [N], rate R|max";
  }

 private:
  static Error stopped() { return {ErrorCode::kInterrupted, "the owner of the clock was asked to stop"}; }

  [[nodiscard]] std::string state() const {
    std::ostringstream text;
    text << "[ok] time_s=" << Time{now_ns_}.seconds() << " state=" << (is_paused_ ? "paused" : "running")
         << " rate=" << rate_text(rate_);
    return text.str();
  }

  std::string set_rate(const std::string& value) {
    std::optional<double> rate;
    if (value != "max") {
      rate = number_of<double>(value);
      if (!rate || !std::isfinite(*rate) || *rate <= 0) {
        return "[fail] rate takes a number above 0, or max, not '" + value + "'";
      }
    }
    is_free_ = false;
    rate_ = rate;
    is_new_rate_ = true;
    ++orders_;
    changed_.notify_all();
    return state();
  }

  std::string step(const std::string& value, std::unique_lock<std::mutex>& lock) {
    std::uint64_t count = 1;
    if (!value.empty()) {
      const auto given = number_of<std::uint64_t>(value);
      if (!given || *given == 0 || *given > kMostSteps) {
        return "[fail] step takes a number of ticks from 1 to " + std::to_string(kMostSteps) + ", not '" +
               value + "'";
      }
      count = *given;
    }
    is_free_ = false;
    is_paused_ = true;
    steps_ = count;
    const std::uint64_t order = ++orders_;
    changed_.notify_all();
    // a tick that is being made is none of the steps
    while ((steps_ > 0 || !is_waiting_) && orders_ == order && !node_.is_stop_asked()) {
      changed_.wait_for(lock, kLook);
    }
    return state();
  }

  Node& node_;
  std::atomic<std::int64_t> now_ns_{0};
  std::atomic<bool> is_free_{false};  // runs as fast as it can, and nobody has said anything since
  std::mutex mutex_;  // of what follows, but for the pacer, which the thread of the ticks has to itself
  std::condition_variable changed_;
  std::optional<double> rate_;
  bool is_new_rate_ = false;
  Pacer pacer_;
  bool is_paused_ = false;
  std::uint64_t steps_ = 0;   // that are still to be made
  std::uint64_t orders_ = 0;  // to pause, run or step: the last one counts
  bool is_waiting_ = false;   // the owner is between two ticks
  std::unique_ptr<Node::Service> service_;
};

}  // namespace

Result<std::unique_ptr<ClockControl>> ClockControl::open(Node& node, std::optional<double> rate,
                                                         bool is_paused) {
  auto control = std::make_unique<ClockControlImpl>(node, rate, is_paused);
  if (Status opened = control->open(); !opened) return opened.error();
  return std::unique_ptr<ClockControl>(std::move(control));
}

}  // namespace nido
