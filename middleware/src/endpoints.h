#pragma once

#include <atomic>
#include <cstdint>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>

#include "nido/middleware/port.h"
#include "participant.h"

namespace nido {

using SampleId = eprosima::fastrtps::rtps::SampleIdentity;

// The DDS qualities of an endpoint that this project uses.
struct Quality {
  bool reliable = true;
  bool transient_local = false;
  bool keep_all = false;
  int depth = 1;
  std::string profile;  // told to others; empty for internal endpoints

  // `lockstep`: a barrier can wait only for what is sure to arrive, so everything is reliable then.
  static Quality of(Profile profile, std::size_t depth, bool is_writer, bool lockstep);
};

// What came with a message.
struct MessageInfo {
  Guid writer;
  std::uint64_t sequence = 0;
  std::int64_t source_time_ns = 0;
  std::uint32_t bytes = 0;
  SampleId identity;
  SampleId related;
  bool by_dds = false;  // else over a lane
};

// Called on middleware threads, one call at a time for one reader. May not call DDS.
class ReaderEvents {
 public:
  virtual ~ReaderEvents() = default;
  virtual void on_message(std::shared_ptr<void> message, const MessageInfo& info) = 0;
  virtual void on_matched(const Guid& /*writer*/, bool /*matched*/) {}
  // A message that is not needed any more, to be filled again; null: a new one is made.
  virtual std::shared_ptr<void> spare_message() { return nullptr; }
  // True if it was content with the message as it travelled, so that none need be made of it. The payload is
  // valid during the call.
  virtual bool on_payload(std::span<const std::uint8_t> /*payload*/, const MessageInfo& /*info*/) {
    return false;
  }
};

class LaneLoop;
class LaneWriter;

// The end where messages arrive: over lanes from outputs of nido on this machine, else by DDS. After its
// destruction no call reaches `events` any more.
class Reader {
 public:
  // `loop`: of the calls to `events` for what comes over lanes; the participant's otherwise.
  static Result<std::unique_ptr<Reader>> open(std::shared_ptr<Participant> participant,
                                              const std::string& topic, const MessageType& type,
                                              const Quality& quality, const std::string& port_name,
                                              ReaderEvents& events, std::shared_ptr<LaneLoop> loop = nullptr);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  [[nodiscard]] Guid guid() const { return guid_; }

 private:
  class Listener;
  Reader() = default;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Listener> listener_;
  dds::Topic* topic_ = nullptr;
  dds::DataReader* reader_ = nullptr;
  Guid guid_;
};

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

  // False when the message could not be kept for every reader. `related`: the request that a reply belongs
  // to.
  bool write(const void* message, const SampleId* related = nullptr);
  // A place in shared memory for a serialized message of up to `bytes`, or null, and its sending.
  std::uint8_t* loan(std::size_t bytes);
  bool write_loan(std::size_t bytes);
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
  Writer() = default;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Listener> listener_;
  dds::Topic* topic_ = nullptr;
  dds::DataWriter* writer_ = nullptr;
  Guid guid_;
  dds::TypeSupport support_;
  std::shared_ptr<LaneWriter> lane_;
};

}  // namespace nido
