#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "delay_log.h"
#include "name_lock.h"
#include "nido/middleware/direct_port.h"
#include "port_book.h"
#include "reader.h"
#include "ring.h"
#include "writer.h"

namespace nido {

// An input port on DDS: one reader for each connected output. Messages wait in two places: in lockstep, first
// with their connection until the barrier releases them; then in the queue that the user takes from.
class InputPort final : public RawInput, public InputRecord {
 public:
  static Result<std::unique_ptr<RawInput>> open(std::shared_ptr<Participant> participant,
                                                std::shared_ptr<PortBook> book, const std::string& name,
                                                const MessageType& type, Profile profile, std::size_t depth,
                                                bool lockstep);
  ~InputPort() override;

  std::optional<RawReceived> take() override;
  std::optional<RawReceived> take_latest() override;
  bool wait_for_message(double timeout_s) override;
  bool wait_for_sources(std::size_t count, double timeout_s) override;
  Status connect(const std::string& output_name) override;
  Status disconnect(const std::string& output_name) override;
  [[nodiscard]] std::vector<ConnectionCounters> connections() const override;
  [[nodiscard]] const std::string& name() const override { return name_; }

  // See direct_port.h.
  Status set_handlers(RawHandler handler, PayloadHandler payload_handler);
  bool swap_latest(const std::function<void(void* message)>& swap);
  // A line a connection: the source's name, and how long its messages were on their way (delay_log.h).
  [[nodiscard]] std::string delays() const;

  [[nodiscard]] PortDescription describe() const override;
  [[nodiscard]] std::string idl() const override { return type_.idl; }
  void drain_name_lock() override { lock_->drain(); }
  std::vector<std::string> new_complaints() override;
  [[nodiscard]] std::vector<Wire> wires() const override;
  void aim(const Sequences& written) override;
  [[nodiscard]] bool arrived() const override;
  [[nodiscard]] std::string missing() const override;
  void release(bool is_first) override;

 private:
  struct Item {
    std::shared_ptr<void> message;
    std::shared_ptr<const std::string> source;
    Time source_time;
    std::uint64_t sequence = 0;
    Guid writer;
    [[nodiscard]] RawReceived to_user() { return {std::move(message), *source, source_time, sequence}; }
  };
  // What one writer of a source has sent: a source that was started again is another writer.
  struct Stream {
    std::uint64_t last = 0;
    bool live = false;
    // lockstep: what was written up to here may never come, what comes later is waited for: the writer knows
    // of us
    std::optional<std::uint64_t> floor;
  };
  class Connection final : public ReaderEvents {
   public:
    Connection(InputPort& port, std::string source)
        : port_(port), source_(std::make_shared<const std::string>(source)) {
      counters_.source = std::move(source);
    }
    void on_message(std::shared_ptr<void> message, const MessageInfo& info) override;
    void on_matched(const Guid& writer, bool matched) override;
    std::shared_ptr<void> spare_message() override;
    bool on_payload(std::span<const std::uint8_t> payload, const MessageInfo& info) override;

   private:
    friend class InputPort;
    // Counts it; false for one that came before. With the port's mutex.
    bool note(const MessageInfo& info);
    [[nodiscard]] Arrival arrival_of(const MessageInfo& info) const {
      return {*source_, Time{info.source_time_ns}, info.sequence};
    }
    InputPort& port_;
    const std::shared_ptr<const std::string> source_;
    ConnectionCounters counters_;
    DelayLog delay_log_;
    std::map<Guid, Stream> streams_;
    std::set<Guid> known_writers_;
    std::uint64_t gap_ = 0;                // lockstep: lost on the way, not told yet
    bool was_interrupted_ = false;         // lockstep: a writer was lost sight of and came back, not told yet
    Guid newest_writer_;                   // of those that are live, the one that appeared last
    std::deque<Item> held_;                // lockstep: not released yet, in order of arrival
    std::optional<std::uint64_t> target_;  // lockstep: may be taken up to here in this tick
    std::unique_ptr<Reader> reader_;       // last: the first to go, as it calls the above
  };

  InputPort() = default;
  void keep(Connection& connection, Item item);
  void reuse(std::shared_ptr<void> message);
  void hand_over(std::shared_ptr<void> message, const Arrival& arrival);
  void call_handler(void* message, const Arrival& arrival);  // with handler_mutex_
  void drop_oldest();                                        // with mutex_
  [[nodiscard]] bool has_arrived(const Connection& connection) const;
  [[nodiscard]] EndpointInfo own_info() const;

  std::string name_;
  MessageType type_;
  Profile profile_ = Profile::kSensor;
  std::size_t depth_ = 1;
  bool lockstep_ = false;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<PortBook> book_;
  std::unique_ptr<NameLock> lock_;
  ChangeSignal changed_;  // a message or a source came

  std::mutex wiring_mutex_;  // one connect or disconnect at a time; never held in a DDS callback
  mutable std::mutex mutex_;
  std::map<std::string, std::unique_ptr<Connection>> connections_;  // by source: the order of lockstep
  Ring<Item> ready_;
  std::vector<std::shared_ptr<void>> spare_;  // messages that can be filled again

  std::mutex handler_mutex_;  // one call at a time, whatever the thread
  std::atomic<bool> has_handler_{false};
  RawHandler handler_;
  PayloadHandler payload_handler_;
  std::set<Guid> complained_;
};

}  // namespace nido
