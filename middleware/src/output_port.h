#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "name_lock.h"
#include "nido/middleware/raw_port.h"
#include "port_book.h"
#include "writer.h"

namespace nido {

// An output port on DDS.
class OutputPort final : public RawOutput, public OutputRecord {
 public:
  static Result<std::unique_ptr<RawOutput>> open(std::shared_ptr<Participant> participant,
                                                 std::shared_ptr<PortBook> book, const std::string& name,
                                                 const MessageType& type, Profile profile, std::size_t depth,
                                                 bool lockstep);
  ~OutputPort() override;

  Status write(const void* message) override;
  // See direct_port.h.
  std::uint8_t* loan(std::size_t bytes) { return writer_->loan(bytes); }
  Status write_loan(std::size_t bytes);
  [[nodiscard]] std::size_t reader_count() const override { return writer_->reader_count(); }
  bool wait_for_readers(std::size_t count, double timeout_s) override;
  [[nodiscard]] const std::string& name() const override { return name_; }

  [[nodiscard]] PortDescription describe() const override;
  [[nodiscard]] std::string idl() const override { return type_.idl; }
  void drain_name_lock() override { lock_->drain(); }
  [[nodiscard]] std::uint64_t written() const override { return writer_->written(); }
  [[nodiscard]] std::vector<Wire> wires() const override;
  void begin_tick() override;

 private:
  OutputPort() = default;
  template <class Send>
  Status send(const Send& send);
  std::string name_;
  MessageType type_;
  Profile profile_ = Profile::kSensor;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<PortBook> book_;
  std::unique_ptr<NameLock> lock_;
  std::unique_ptr<Writer> writer_;
  std::optional<std::uint64_t> room_;  // lockstep: messages of one tick that are surely kept for every reader
  std::atomic<std::uint64_t> tick_began_at_{kNever};

  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
};

// Why an output and an input of two descriptions cannot be connected; empty if they can.
std::string misfit(const EndpointInfo& output, const EndpointInfo& input);

}  // namespace nido
