#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "keys.h"
#include "nido/launcher/app.h"
#include "nido/launcher/launch.h"
#include "nido/launcher/paths.h"
#include "nido/launcher/run_folder.h"
#include "nido/launcher/supervisor.h"
#include "nido/launcher/terminal.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/msgs/types.h"
#include "run_report.h"

namespace nido {

// As a person would type it: from here, if it is below here.
std::string shown_path(const std::filesystem::path& path);

// One run of an app, from the first process to the last: the middle of `nido launch`.
class LaunchRun {
 public:
  // `signal_fd`: a signalfd of SIGINT, SIGTERM and SIGHUP, which are blocked.
  LaunchRun(const LaunchRequest& request, const App& app, const Places& places, int signal_fd);
  ~LaunchRun();
  LaunchRun(const LaunchRun&) = delete;
  LaunchRun& operator=(const LaunchRun&) = delete;

  // Returns the exit code. What it means has been printed.
  int run();

 private:
  using SteadyClock = std::chrono::steady_clock;

  Status prepare();
  Status join();
  Status start_due();
  Status start(const AppProcess& process);
  void step();
  void on_event(const SupervisorEvent& event);
  void on_death(const SupervisorEvent& event);
  void look_at_nodes();
  void tell_story();
  void look_at_limits();
  void take_signals();
  // The space bar is the emergency stop of every robot of the run.
  void take_keys();
  void end(int exit_code, const std::string& sentence);
  void shut_down();
  void look_at_recording(const SupervisorEvent& event);
  // What /launcher/rpc:i answers. The handler runs on a thread of the middleware.
  std::string answer(const std::string& question);
  void tell_status(bool now);
  [[nodiscard]] std::string state_of(const AppProcess& process) const;
  [[nodiscard]] double wall_s() const;
  [[nodiscard]] double sim_s() const;
  [[nodiscard]] bool uses(const std::string& reference) const;
  [[nodiscard]] const AppProcess& process_named(const std::string& name) const;
  [[nodiscard]] std::string log_name(const std::string& process) const;
  void print(const std::string& line) const;

  const LaunchRequest& request_;
  const App& app_;
  const Places& places_;
  int signal_fd_;
  Paint paint_;
  Keys keys_;
  RunSettings settings_;
  RunFolder folder_;
  std::map<std::string, std::string> programs_;

  std::unique_ptr<Supervisor> supervisor_;
  std::unique_ptr<Node> node_;
  std::unique_ptr<Directory> directory_;
  std::unique_ptr<Input<msgs::StageEvent>> story_;
  std::unique_ptr<Input<msgs::StageEvent>> outcome_;

  SteadyClock::time_point wall_start_ = SteadyClock::now();
  std::set<std::string> started_;
  std::set<std::string> ready_;
  std::map<std::string, SteadyClock::time_point> ready_deadline_;  // of those that are not ready yet
  bool all_ready_ = false;
  std::optional<SteadyClock::time_point> report_deadline_;  // the judge has ended; its report must be there
  std::optional<RunEnd> end_;
  bool stopping_ = false;

  std::map<std::string, std::string> last_words_;  // of processes that ended: why
  std::vector<std::string> told_;                  // the story so far, each event as a JSON object
  SteadyClock::time_point next_status_;
  std::mutex mutex_;  // of what follows
  std::string status_ = "{}";
  std::string stop_asked_;  // why; empty: nobody asked
  // last: its handler uses what is above
  std::unique_ptr<Node::Service> service_;
};

}  // namespace nido
