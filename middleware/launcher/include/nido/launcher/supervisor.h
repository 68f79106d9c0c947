#pragma once

#include <sys/types.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/launcher/app.h"
#include "nido/launcher/child.h"

namespace nido {

// What the supervisor keeps alive.
struct SupervisedProcess {
  std::string name;
  ChildCommand command;
  std::string log_file;  // its stdout and stderr; empty: none
  RestartPolicy restart;
};

// What happened since the last poll.
struct SupervisorEvent {
  enum class Kind {
    kOutput,      // one line of output, in `text`
    kEnded,       // it ended, and is not started again
    kRestarting,  // it ended by a failure and will be started again
    kRestarted,
    kGivenUp,  // it failed more often than its policy allows, or could not be started again
  };
  Kind kind = Kind::kOutput;
  std::string name;
  std::string text;                     // kOutput: the line; otherwise a sentence
  ExitState exit;                       // kEnded, kRestarting, kGivenUp
  std::vector<std::string> last_lines;  // kEnded, kRestarting, kGivenUp: the end of its output
};

// Starts processes, collects their output, notices their end, restarts them by their policy, stops them in
// reverse order, and leaves nothing behind. To be used by one thread, which must live as long as the run. A
// janitor process does the killing if this process itself is killed.
class Supervisor {
 public:
  // `janitor_program`: path of nido-janitor; empty: none. kNotFound if it is not there.
  static Result<std::unique_ptr<Supervisor>> create(const std::string& janitor_program);
  // Kills what still lives.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  Status start(SupervisedProcess process);

  // Waits at most `timeout` for something to happen, does what is due, and tells what happened. Wakes up
  // early when `wake_fd` becomes readable (-1: none).
  std::vector<SupervisorEvent> poll(std::chrono::milliseconds timeout, int wake_fd = -1);

  // From now on nothing is restarted, and poll() ends the processes, last started first: SIGTERM to one, to
  // the one before it when that has gone or after `stagger`; SIGKILL to each `grace` after its SIGTERM; all
  // that is left is killed after `whole_grace`.
  void begin_stop(std::chrono::milliseconds grace = std::chrono::seconds(2),
                  std::chrono::milliseconds whole_grace = std::chrono::seconds(4),
                  std::chrono::milliseconds stagger = std::chrono::milliseconds(250));
  // SIGKILL to everything at once; poll() collects the ends.
  void kill_all();

  [[nodiscard]] bool all_gone() const;
  [[nodiscard]] bool running(const std::string& name) const;
  [[nodiscard]] pid_t pid_of(const std::string& name) const;  // -1: not running
  [[nodiscard]] int restarts_of(const std::string& name) const;
  // Names of those that did not end on SIGTERM in time.
  [[nodiscard]] const std::vector<std::string>& killed() const;
  // The end of a process's output.
  [[nodiscard]] std::vector<std::string> last_lines(const std::string& name) const;

 private:
  struct Entry;
  class JanitorLink;
  Supervisor();
  Entry* find(const std::string& name) const;
  Status launch(Entry& entry);
  void read_output(Entry& entry, std::vector<SupervisorEvent>& events);
  void keep_line(Entry& entry, const std::string& line, std::vector<SupervisorEvent>& events);
  std::optional<ExitState> reap(Entry& entry, std::vector<SupervisorEvent>& events);
  void after_end(Entry& entry, ExitState state, std::vector<SupervisorEvent>& events);
  void go_on_stopping();

  std::vector<std::unique_ptr<Entry>> entries_;
  std::unique_ptr<JanitorLink> janitor_;
  bool stopping_ = false;
  bool killing_ = false;
  std::chrono::milliseconds grace_{2000};
  std::chrono::milliseconds stagger_{250};
  std::chrono::steady_clock::time_point next_stop_;
  std::chrono::steady_clock::time_point stop_deadline_;
  std::vector<std::string> killed_;
};

}  // namespace nido
