#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "lane_loop.h"
#include "sent.h"

namespace nido {

// The output's end of the lanes to its inputs on this machine. Thread-safe but for write() and the loans,
// which one thread uses at a time.
class LaneWriter : public std::enable_shared_from_this<LaneWriter> {
 public:
  struct Settings {
    bool reliable = true;          // else a message for which an input has no room is dropped
    bool keep_all = false;         // else an input that is behind gets the last `depth` ones
    bool transient_local = false;  // a late joiner gets the last `depth` ones
    std::size_t depth = 1;
  };
  LaneWriter(std::shared_ptr<LaneLoop> loop, const Guid& guid, const Settings& settings,
             eprosima::fastdds::dds::TypeSupport support, std::function<void()> on_readers_changed);
  ~LaneWriter();
  LaneWriter(const LaneWriter&) = delete;
  LaneWriter& operator=(const LaneWriter&) = delete;

  [[nodiscard]] const Guid& guid() const { return guid_; }
  // An input has said hello on this socket.
  void adopt(Fd fd, const Guid& reader);
  // No lane any more, no call of on_readers_changed any more.
  void close();

  // Who an answer is for, and to which request.
  struct Related {
    Guid reader;
    std::uint64_t sequence = 0;
  };
  // Only keep_all waits for room, up to 0.2 s.
  Sent write(const void* message, const Related* related);
  // A place for a message of that many bytes, already serialized, and its sending, after which it can be read
  // there until the next loan() or write().
  std::uint8_t* loan(std::size_t bytes);
  Sent write_loan(std::size_t bytes);
  [[nodiscard]] std::span<const std::uint8_t> loaned() const;
  // Number of the last message, which is its sequence number.
  [[nodiscard]] std::uint64_t written() const { return written_.load(std::memory_order_acquire); }
  // Serialized messages that are kept for late joiners, oldest first.
  void each_kept(
      const std::function<void(std::span<const std::uint8_t> payload, std::uint64_t sequence)>& use);

  [[nodiscard]] std::set<Guid> readers() const;
  // Waits until every input has got what was written.
  bool wait_until_received(double timeout_s);

 private:
  // Shared memory for one large message. Free when nobody else holds it.
  struct Slot;
  // A packet, perhaps with a slot.
  struct Frame {
    std::vector<unsigned char> bytes;
    std::uint64_t sequence = 0;  // of its message, 0: none
    std::shared_ptr<Slot> slot;
  };
  class Lane;
  using FramePtr = std::shared_ptr<Frame>;

  // all with mutex_ held
  FramePtr spare_frame();
  std::shared_ptr<Slot> free_slot(std::size_t bytes);
  // Puts it on the lane's board; false for an input that has none, or has not read all that came before.
  bool tell(Lane& lane, const Frame& frame, const FrameHeader& header);
  void send_board(Lane& lane);
  void distribute(const FramePtr& frame, const FrameHeader& header);
  void offer(Lane& lane, const FramePtr& frame, bool is_urgent);
  bool try_send(Lane& lane, const Frame& frame);
  void flush(Lane& lane);
  struct Answers {
    bool has_released = false;
    bool is_gone = false;  // nothing comes any more
  };
  Answers read_answers(Lane& lane);
  bool wait_for_room(std::unique_lock<std::mutex>& lock);
  void drop(const std::shared_ptr<Lane>& lane);
  void flush_later(Lane& lane);

  // on the loop
  void on_ready(const std::shared_ptr<Lane>& lane, std::uint32_t epoll_events);

  const std::shared_ptr<LaneLoop> loop_;
  const Guid guid_;
  const Settings settings_;
  const eprosima::fastdds::dds::TypeSupport support_;
  const std::function<void()> on_readers_changed_;
  std::atomic<std::uint64_t> written_{0};

  mutable std::mutex mutex_;
  std::condition_variable progress_;  // room, or an answer to a sync
  bool closed_ = false;
  std::vector<std::shared_ptr<Lane>> lanes_;
  std::vector<FramePtr> frames_;  // to be used again
  std::vector<std::shared_ptr<Slot>> slots_;
  std::vector<FramePtr> kept_;
  std::shared_ptr<Slot> loan_;
  std::uint32_t last_slot_ = 0;
  std::uint64_t last_sync_ = 0;
};

// Where the lanes of a participant begin and end: it is listened for inputs of others, and two threads serve
// them all. Thread-safe.
class LaneServer {
 public:
  // Null when there are no sockets or threads.
  static std::unique_ptr<LaneServer> open(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix);
  // For a participant that has no lanes: the threads only, null when there are none.
  static std::unique_ptr<LaneServer> closed();
  ~LaneServer();
  LaneServer(const LaneServer&) = delete;
  LaneServer& operator=(const LaneServer&) = delete;

  // Hands over inputs that ask for it.
  void enter(const std::shared_ptr<LaneWriter>& writer);
  void leave(const Guid& writer);
  // Of outputs; it never runs what a user wrote.
  [[nodiscard]] const std::shared_ptr<LaneLoop>& sending() const { return sending_; }
  // Of inputs.
  [[nodiscard]] const std::shared_ptr<LaneLoop>& receiving() const { return receiving_; }

 private:
  class Listener;
  class Guest;
  LaneServer() = default;
  const std::shared_ptr<LaneLoop> sending_ = std::make_shared<LaneLoop>();
  const std::shared_ptr<LaneLoop> receiving_ = std::make_shared<LaneLoop>();
  std::shared_ptr<Listener> listener_;
};

// Equal for processes between which lanes are possible: the same machine and network namespace.
std::string here();

}  // namespace nido
