#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "fd.h"
#include "lane_wire.h"

namespace nido {

// What makes a lane quick for large messages: a page of shared memory on which the input finds the header of
// the message that it is to read, and a bell, an eventfd that wakes it up. That takes half of what a packet
// over the socket does after some milliseconds in which the processors have done other things. A board has
// room for one message: the output uses it when the input has read all that came before, else the socket.
struct LaneBoardPage {
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free, "two processes share it");
  std::atomic<std::uint64_t> sequence;  // of the message below, 0: none yet
  std::uint64_t after = 0;              // number of the last message that was sent to the input before
  FrameHeader header;
};

// The output's end. One thread uses it at a time.
class LaneBoardOutput {
 public:
  // Null when there are no files or no memory.
  static std::unique_ptr<LaneBoardOutput> make();
  ~LaneBoardOutput();
  LaneBoardOutput(const LaneBoardOutput&) = delete;
  LaneBoardOutput& operator=(const LaneBoardOutput&) = delete;

  [[nodiscard]] int bell() const { return bell_.get(); }
  [[nodiscard]] int memory() const { return memory_.get(); }
  // Not before the input has read the message that was told before.
  void tell(const FrameHeader& header, std::uint64_t after);

 private:
  LaneBoardOutput() = default;
  Fd bell_;
  Fd memory_;
  LaneBoardPage* page_ = nullptr;
};

// The input's end. One thread uses it at a time.
class LaneBoardInput {
 public:
  // Null when it cannot be read.
  static std::unique_ptr<LaneBoardInput> make(Fd bell, const Fd& memory);
  ~LaneBoardInput();
  LaneBoardInput(const LaneBoardInput&) = delete;
  LaneBoardInput& operator=(const LaneBoardInput&) = delete;

  // Each ring is an event of its own for who waits for it edge-triggered: it need not be read.
  [[nodiscard]] int bell() const { return bell_.get(); }
  // The message that comes after the one of that number, when it is there.
  [[nodiscard]] std::optional<FrameHeader> read_after(std::uint64_t last) const;

 private:
  LaneBoardInput() = default;
  Fd bell_;
  const LaneBoardPage* page_ = nullptr;
};

}  // namespace nido
