#pragma once

#include <cstdint>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <memory>
#include <set>
#include <string>

#include "change_signal.h"
#include "endpoint_quality.h"
#include "sent.h"

namespace nido {

class LaneWriter;
class LatestSender;

// The end where messages are written: over lanes to inputs of nido on this machine, by DDS to all others.
// Thread-safe but for write(), which one thread calls at a time.
class Writer {
 public:
  static Result<std::unique_ptr<Writer>> open(std::shared_ptr<Participant> participant,
                                              const std::string& topic, const MessageType& type,
                                              const Quality& quality, const std::string& port_name);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // `related`: the request that a reply belongs to.
  Sent write(const void* message, const SampleId* related = nullptr);
  // A place in shared memory for a serialized message of up to `bytes`, or null, and its sending.
  std::uint8_t* loan(std::size_t bytes);
  Sent write_loan(std::size_t bytes);
  // Waits until every reader has what was written; false after timeout_s.
  bool wait_until_received(double timeout_s);
  // Sequence number of the last written message, 0 before the first.
  [[nodiscard]] std::uint64_t written() const;
  // The same as other programs see it, which get only what was written while one of them was there.
  [[nodiscard]] std::uint64_t written_by_dds() const;

  [[nodiscard]] std::set<Guid> readers() const;
  [[nodiscard]] std::size_t reader_count() const;
  // Notified when readers come and go; those of notify_also too.
  [[nodiscard]] const std::shared_ptr<ChangeSignal>& readers_signal() const;
  void notify_also(std::shared_ptr<ChangeSignal> also);
  [[nodiscard]] Guid guid() const { return guid_; }

 private:
  class Listener;
  Writer();
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Listener> listener_;
  std::shared_ptr<dds::Topic> topic_;
  dds::DataWriter* writer_ = nullptr;
  Guid guid_;
  dds::TypeSupport support_;
  std::shared_ptr<LaneWriter> lane_;
  std::unique_ptr<LatestSender> far_sender_;  // of what may be dropped on the way to other computers
};

}  // namespace nido
