#pragma once

#include <cstdint>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <memory>
#include <span>
#include <string>

#include "endpoint_quality.h"

namespace nido {

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
  std::shared_ptr<dds::Topic> topic_;
  dds::DataReader* reader_ = nullptr;
  Guid guid_;
};

}  // namespace nido
