#include "limits/safety.h"

#include <fmt/format.h>

#include <string_view>

namespace nido {
namespace {

constexpr std::size_t kLongestReason = 100;

// one word of quotes, whatever somebody gave as a reason
std::string quoted(std::string text) {
  for (char& c : text) {
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ') c = '\'';
  }
  return '"' + text + '"';
}

}  // namespace

Status Safety::may_command() const {
  if (options_.read_only) {
    return Error{ErrorCode::kFailed, "this robot is read-only: safety.read_only of its robot file says so"};
  }
  const std::lock_guard lock(mutex_);
  if (stopped_) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("the emergency stop is on ({}): 'reset' on the robot's port safety ends it", *stopped_)};
  }
  return {};
}

bool Safety::is_stopped() const {
  const std::lock_guard lock(mutex_);
  return stopped_.has_value();
}

void Safety::stop(const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    stopped_ = reason.substr(0, kLongestReason);
  }
  if (options_.report) options_.report("emergency stop: " + reason.substr(0, kLongestReason));
}

void Safety::reset() {
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) return;
    stopped_.reset();
    beaten_ns_.reset();
  }
  if (options_.report) options_.report("the emergency stop is over");
}

void Safety::beat() {
  const std::lock_guard lock(mutex_);
  beaten_ns_ = clock_.now_ns();
}

void Safety::step_to(std::int64_t now_ns) {
  bool ended = false;
  {
    const std::lock_guard lock(mutex_);
    ended = options_.heartbeat_s > 0 && beaten_ns_ && !stopped_ &&
            static_cast<double>(now_ns - *beaten_ns_) * 1e-9 > options_.heartbeat_s;
  }
  if (ended) stop(fmt::format("no heartbeat for {} s", options_.heartbeat_s));
}

std::string Safety::reply(const std::string& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  const std::size_t end = std::min(line.find_last_not_of(" \t\r\n") + 1, line.size());
  const std::string_view words = std::string_view(line).substr(begin, end > begin ? end - begin : 0);
  if (words == "stop" || words.starts_with("stop ")) {
    stop(words.size() > 5 ? std::string(words.substr(5)) : std::string("asked for"));
    return "[ok]";
  }
  if (words == "reset") {
    reset();
    return "[ok]";
  }
  if (words == "beat") {
    beat();
    return "[ok]";
  }
  if (words == "get state") {
    const std::lock_guard lock(mutex_);
    return fmt::format("[is] state {} {} [ok]",
                       options_.read_only ? "readonly"
                       : stopped_         ? "stopped"
                                          : "running",
                       quoted(stopped_.value_or("")));
  }
  return "[fail] \"stop [WHY], reset, beat and get state are understood\"";
}

}  // namespace nido
