#pragma once

#include <algorithm>

#include "icub_words.h"
#include "nido/gateway/icub_tasks.h"

namespace nido::gateway {

constexpr std::size_t kMostContexts = 1000;

template <class Settings>
Result<int> Contexts<Settings>::store(const Now& now) {
  if (kept_.size() >= kMostContexts) {
    return Error{ErrorCode::kFailed, "too many contexts are stored: delete some"};
  }
  Result<Settings> settings = now();
  if (!settings) return settings.error();
  kept_[next_] = std::move(*settings);
  return next_++;
}

template <class Settings>
std::optional<yarp::Bottle> Contexts<Settings>::reply(const yarp::Bottle& command, const Now& now,
                                                      const Restore& restore) {
  if (is(command, 0, "stor")) {
    const Result<int> id = store(now);
    return id ? ack({yarp::Value::of(*id)}) : nack(id.error().message);
  }
  if (is(command, 0, "rest")) {
    const bool named =
        command.size() > 1 && command[1].is_integer() && std::abs(command[1].integer) < 2'000'000'000;
    const auto found = named ? kept_.find(static_cast<int>(command[1].integer)) : kept_.end();
    return found == kept_.end() ? nack("there is no such context") : outcome(restore(found->second));
  }
  if (is(command, 0, "del")) {
    // the first one stays
    const auto ids = numbers_in(command, 1);
    for (const double id : ids.value_or(std::vector<double>())) {
      if (id != 0) kept_.erase(static_cast<int>(std::clamp(id, -1.0, 2e9)));
    }
    return ack();
  }
  return std::nullopt;
}

}  // namespace nido::gateway
