#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "lane_board.h"
#include "lane_loop.h"
#include "lane_packet.h"

namespace nido {

// What an input does with what comes over its lanes. Called on the lanes' loop.
class LaneSink {
 public:
  virtual ~LaneSink() = default;
  // The output knows this input from here on.
  virtual void on_lane_start(const Guid& writer) = 0;
  // The output, or its process, is gone.
  virtual void on_lane_end(const Guid& writer) = 0;
  // The payload is valid during the call.
  virtual void on_lane_frame(const Guid& writer, const FrameHeader& header,
                             std::span<const std::uint8_t> payload) = 0;
};

// The input's end of one lane. Thread-safe.
class LaneReader final : public LaneLoop::Served, public std::enable_shared_from_this<LaneReader> {
 public:
  // Connects now or soon, again and again until the output's process has taken it, or is gone.
  static std::shared_ptr<LaneReader> open(std::shared_ptr<LaneLoop> loop, const Guid& writer,
                                          const Guid& reader, std::weak_ptr<LaneSink> sink);
  ~LaneReader() override;
  LaneReader(const LaneReader&) = delete;
  LaneReader& operator=(const LaneReader&) = delete;
  // A call that is going on may still end after this.
  void close();
  // DDS says that the output is gone. Closes a lane that has not begun; false for one that has: it knows
  // better.
  [[nodiscard]] bool abandon();

  void on_ready(std::uint32_t epoll_events) override;

 private:
  // The bell of the lane's board.
  class Bell;
  struct Slot {
    const std::uint8_t* memory = nullptr;
    std::size_t bytes = 0;
  };
  LaneReader(std::shared_ptr<LaneLoop> loop, const Guid& writer, const Guid& reader,
             std::weak_ptr<LaneSink> sink);
  void connect();
  // with mutex_
  void connect_later();
  void shut();
  // True if the lane begins, false if it was closed meanwhile.
  bool start();
  // False when the lane has ended.
  bool receive_one(LaneSink& sink);
  // False when it cannot be watched.
  bool take_board(LaneFiles files);
  // Takes the message that is told there, if it is the next one.
  void read_board(LaneSink& sink);
  void deliver_shared(LaneSink& sink, const FrameHeader& header);
  void map_slot(const FrameHeader& header, const Fd& file);
  void answer(const FrameHeader& header);
  void send_answers();
  void end();

  const std::shared_ptr<LaneLoop> loop_;
  const Guid writer_;
  const Guid reader_;
  const std::weak_ptr<LaneSink> sink_;

  std::mutex mutex_;  // of what follows
  Fd fd_;
  std::uint64_t id_ = 0;
  std::uint64_t bell_id_ = 0;
  bool is_open_ = true;
  bool is_started_ = false;

  // of the loop's thread alone
  std::vector<std::uint8_t> buffer_;
  std::map<std::uint32_t, Slot> slots_;
  std::unique_ptr<LaneBoardInput> board_;
  std::uint64_t last_ = 0;           // number of the last message
  std::deque<FrameHeader> answers_;  // that there was no room for
  bool waits_for_room_ = false;
};

}  // namespace nido
