#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "input_port.h"
#include "lockstep.h"
#include "name_lock.h"
#include "nido/middleware/node.h"
#include "node_log.h"
#include "output_port.h"
#include "port_book.h"
#include "process_watch.h"
#include "reader.h"
#include "service.h"
#include "writer.h"

namespace nido {

// The one implementation of Node.
class NodeImpl final : public Node {
 public:
  static Result<std::unique_ptr<NodeImpl>> make(NodeOptions options);
  ~NodeImpl() override;

  [[nodiscard]] const NodeOptions& options() const override { return options_; }
  [[nodiscard]] Time now() const override;

  Result<std::unique_ptr<RawOutput>> open_raw_output(const std::string& port_name, const MessageType& type,
                                                     Profile profile, std::size_t depth) override;
  Result<std::unique_ptr<RawInput>> open_raw_input(const std::string& port_name, const MessageType& type,
                                                   Profile profile, std::size_t depth) override;
  Result<std::unique_ptr<Service>> open_service(
      const std::string& port_name, std::function<std::string(const std::string&)> handler) override;
  Result<std::string> call(const std::string& port_name, const std::string& text, double timeout_s) override;

  void set_ready() override { set_state("ready", ""); }
  void set_failed(const std::string& sentence) override;
  Status run(const std::function<Status(Time)>& on_tick) override;
  void stop() override;
  [[nodiscard]] bool is_stop_asked() const override { return is_stopped(); }
  Status publish_clock(Time now) override;

  void log_debug(const std::string& text) override { log(NodeLog::Level::kDebug, text); }
  void log_info(const std::string& text) override { log(NodeLog::Level::kInfo, text); }
  void log_warning(const std::string& text) override { log(NodeLog::Level::kWarning, text); }
  void log_error(const std::string& text) override { log(NodeLog::Level::kError, text); }

  // For Directory.
  [[nodiscard]] const std::shared_ptr<Participant>& participant() const { return participant_; }

 protected:
  void note_parameter(ParameterDescription description,
                      std::function<Status(const YAML::Node& value)> set) override;

 private:
  class ClockReader;
  explicit NodeImpl(NodeOptions options);
  Status open();
  void set_state(const std::string& state, const std::string& detail);
  void log(NodeLog::Level level, const std::string& text);
  [[nodiscard]] bool is_stopped() const { return stopped_.load(); }
  [[nodiscard]] LockstepContext lockstep_context();
  [[nodiscard]] Error interrupted() const;

  void tell_unused_parameters();
  Status run_on_wall(const std::function<Status(Time)>& on_tick);
  Status run_on_clock(const std::function<Status(Time)>& on_tick);
  Status run_in_lockstep(const std::function<Status(Time)>& on_tick);

  void keep_house();
  void announce();
  std::string control(const std::string& command);
  Status set_parameter(const std::string& key, const std::string& text);
  [[nodiscard]] std::vector<ParameterDescription> parameters();

  const NodeOptions options_;
  const std::string restarts_;  // of this process, as its launcher says; empty without one
  NodeLog log_;
  std::atomic<bool> stopped_{false};
  std::atomic<bool> closing_{false};
  std::atomic<std::int64_t> clock_ns_{0};
  std::atomic<bool> owns_clock_{false};
  const std::shared_ptr<PortBook> book_ = std::make_shared<PortBook>();

  mutable std::mutex mutex_;  // of what follows
  std::string state_ = "starting";
  std::string detail_;
  struct Parameter {
    ParameterDescription description;
    std::function<Status(const YAML::Node& value)> set;  // none: is what it was at the start
  };
  std::map<std::string, Parameter> parameters_;
  std::map<std::string, std::shared_ptr<TextClient>> clients_;

  // in the order in which they are made; they go the other way round
  std::unique_ptr<ProcessWatch> watch_;
  std::unique_ptr<NameLock> lock_;
  std::shared_ptr<Participant> participant_;
  std::unique_ptr<ClockReader> clock_reader_;
  std::unique_ptr<RawOutput> clock_port_;
  std::unique_ptr<LockstepOwner> lockstep_owner_;
  std::unique_ptr<Writer> log_writer_;
  std::unique_ptr<Writer> info_writer_;
  std::unique_ptr<TextService> control_;
  std::thread housekeeper_;
};

}  // namespace nido
