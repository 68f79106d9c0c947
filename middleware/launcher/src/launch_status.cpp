// What a run tells others: /launcher/rpc:i.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "launch_run.h"

namespace nido {
using std::chrono::milliseconds;

std::string LaunchRun::answer(const std::string& question) {
  const std::lock_guard lock(mutex_);
  if (question == "status") return status_;
  if (question == "stop" || question.starts_with("stop ")) {
    stop_asked_ = question.size() > 5 ? question.substr(5) : "from outside";
    return "ok";
  }
  return "status: the run as JSON; stop [WHY]: ends it";
}

// "waiting" for those before it, "starting", "ready", "restarting", "stopping", "gone".
std::string LaunchRun::state_of(const AppProcess& process) const {
  if (!started_.contains(process.name)) return "waiting";
  const bool runs = supervisor_->running(process.name);
  if (stopping_) return runs ? "stopping" : "gone";
  if (runs) return ready_.contains(process.name) ? "ready" : "starting";
  return last_words_.contains(process.name) ? "gone" : "restarting";
}

// Writes down what `status` answers, a few times a second.
void LaunchRun::tell_status(bool now) {
  if (!now && SteadyClock::now() < next_status_) return;
  next_status_ = SteadyClock::now() + milliseconds(250);
  auto processes = nlohmann::json::array();
  for (const auto& process : app_.processes) {
    const auto words = last_words_.find(process.name);
    processes.push_back({{"name", process.name},
                         {"state", state_of(process)},
                         {"pid", supervisor_->pid_of(process.name)},
                         {"restarts", supervisor_->restarts_of(process.name)},
                         {"clock", process.clock},
                         {"reason", words == last_words_.end() ? "" : words->second}});
  }
  auto story = nlohmann::json::array();
  for (const auto& event : told_) story.push_back(nlohmann::json::parse(event, nullptr, false));
  const nlohmann::json status = {{"app", app_.name},
                                 {"summary", app_.summary},
                                 {"robot", app_.robot},
                                 {"world", app_.world},
                                 {"seed", app_.seed},
                                 {"rate", app_.rate},
                                 {"lockstep", app_.lockstep},
                                 {"out", shown_path(folder_.path)},
                                 {"wall_s", wall_s()},
                                 {"state", end_         ? "ended"
                                           : all_ready_ ? "running"
                                                        : "starting"},
                                 {"exit_code", end_ ? end_->exit_code : -1},
                                 {"sentence", end_ ? end_->sentence : ""},
                                 {"processes", processes},
                                 {"story", story}};
  const std::lock_guard lock(mutex_);
  status_ = status.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace nido
