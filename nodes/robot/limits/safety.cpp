#include "limits/safety.h"

#include <fmt/format.h>

#include <algorithm>

namespace nido {
namespace {

constexpr std::size_t kLongestReason = 100;

// short, and without what would end a sentence in quotes, whatever somebody gave as a reason
std::string plain(std::string text) {
  for (char& c : text) {
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ') c = '\'';
  }
  return text.substr(0, kLongestReason);
}

}  // namespace

Status Safety::may_command() const {
  if (options_.read_only) {
    return Error{ErrorCode::kFailed, "this robot is read-only: safety.read_only of its robot file says so"};
  }
  if (const auto why = stopped()) {
    return Error{ErrorCode::kFailed, fmt::format("the emergency stop is on ({}): 'nido node call {} estop "
                                                 "clear' ends it",
                                                 *why, options_.node)};
  }
  return {};
}

std::optional<std::string> Safety::stopped() const {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

void Safety::stop(const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    stopped_ = plain(reason);
  }
  if (options_.report) options_.report("emergency stop: " + plain(reason));
}

void Safety::clear() {
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) return;
    stopped_.reset();
    beats_.clear();
  }
  if (options_.report) options_.report("the emergency stop is over");
}

void Safety::beat(const std::string& source) {
  const std::lock_guard lock(mutex_);
  beats_[source] = clock_.now_ns();
}

void Safety::step_to(std::int64_t now_ns) {
  if (options_.heartbeat_s <= 0) return;
  std::string silent;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    for (const auto& [source, beaten_ns] : beats_) {
      if (static_cast<double>(now_ns - beaten_ns) * 1e-9 > options_.heartbeat_s) silent = source;
    }
  }
  if (!silent.empty()) stop(fmt::format("no heartbeat of {} for {} s", silent, options_.heartbeat_s));
}

std::string Safety::reply(const std::string& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t\r\n"), line.size());
  const std::size_t end = std::min(line.find_last_not_of(" \t\r\n") + 1, line.size());
  const std::string words = line.substr(begin, end > begin ? end - begin : 0);
  if (words == "clear") {
    clear();
    return "[ok]";
  }
  if (words == "beat") {
    beat("beat");
    return "[ok]";
  }
  if (words == "state") {
    const auto why = stopped();
    std::string heard;
    const std::lock_guard lock(mutex_);
    for (const auto& [source, beaten_ns] : beats_) heard += (heard.empty() ? "" : " ") + source;
    return fmt::format("[is] state {} \"{}\" ({}) [ok]",
                       why                  ? "stopped"
                       : options_.read_only ? "readonly"
                                            : "running",
                       why.value_or(""), heard);
  }
  stop(words.empty() ? "asked for" : words);
  return "[ok]";
}

}  // namespace nido
