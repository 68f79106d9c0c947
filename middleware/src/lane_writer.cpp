#include "lane_writer.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <utility>

#include "lane_board.h"
#include "lane_packet.h"

namespace nido {

namespace {

constexpr int kSendBuffer_bytes = 4 << 20;
// what is kept for an input that must get everything, before the writer is told
constexpr std::size_t kCommandRoom = 2000;
constexpr auto kCommandPatience = std::chrono::milliseconds(200);
// large messages that an input has not read yet
constexpr std::size_t kMostHeld = 16;
constexpr std::size_t kMostHeldBestEffort = 4;
// until it is tried again what the system had no memory for
constexpr auto kPause = std::chrono::milliseconds(10);
// packets that wait to be used again
constexpr std::size_t kSpareFrames = 16;

std::int64_t wall_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// A payload of the DDS library that lies in memory of ours.
class Payload {
 public:
  Payload(std::uint8_t* data, std::size_t size) {
    payload_.data = data;
    payload_.max_size = static_cast<std::uint32_t>(size);
  }
  ~Payload() { payload_.data = nullptr; }
  Payload(const Payload&) = delete;
  Payload& operator=(const Payload&) = delete;
  eprosima::fastrtps::rtps::SerializedPayload_t* get() { return &payload_; }

 private:
  eprosima::fastrtps::rtps::SerializedPayload_t payload_;
};

}  // namespace

struct LaneWriter::Slot {
  Fd fd;
  std::uint8_t* memory = nullptr;
  std::size_t bytes = 0;
  std::uint32_t id = 0;

  [[nodiscard]] std::span<std::uint8_t> payload() const {
    return {memory + kSlotHead_bytes, bytes - kSlotHead_bytes};
  }
  Slot() = default;
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;
  ~Slot() {
    if (memory != nullptr) {
      munmap(memory, bytes);
    }
  }
};

class LaneWriter::Lane final : public LaneLoop::Served, public std::enable_shared_from_this<Lane> {
 public:
  Lane(std::weak_ptr<LaneWriter> owner, Fd socket, const Guid& input)
      : fd(std::move(socket)), reader(input), owner_(std::move(owner)) {}
  void on_ready(std::uint32_t epoll_events) override {
    if (const auto owner = owner_.lock()) {
      owner->on_ready(shared_from_this(), epoll_events);
    }
  }

  [[nodiscard]] bool knows(const Slot& slot) const {
    return std::find(known_slots.begin(), known_slots.end(), slot.id) != known_slots.end();
  }

  // the owner's, with its mutex
  const Fd fd;
  const Guid reader;
  std::uint64_t id = 0;
  bool waits_for_socket = false;
  bool is_flushed_later = false;
  std::unique_ptr<LaneBoardOutput> board;  // from the first large message on
  bool has_board = false;                  // the input has got it
  std::deque<FramePtr> pending;
  // few: vectors need no memory for each message
  std::vector<std::shared_ptr<Slot>> held;  // that the input has not read yet
  std::vector<std::uint32_t> known_slots;   // whose files it has got
  std::uint64_t last_sent = 0;              // number of a message
  std::uint64_t synced = 0;

 private:
  const std::weak_ptr<LaneWriter> owner_;
};

LaneWriter::LaneWriter(std::shared_ptr<LaneLoop> loop, const Guid& guid, const Settings& settings,
                       eprosima::fastdds::dds::TypeSupport support, std::function<void()> on_readers_changed)
    : loop_(std::move(loop)),
      guid_(guid),
      settings_(settings),
      support_(std::move(support)),
      on_readers_changed_(std::move(on_readers_changed)) {}

LaneWriter::~LaneWriter() { close(); }

void LaneWriter::adopt(Fd fd, const Guid& reader) {
  setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer_bytes, sizeof kSendBuffer_bytes);
  {
    const std::lock_guard lock(mutex_);
    if (closed_) {
      return;
    }
    auto lane = std::make_shared<Lane>(weak_from_this(), std::move(fd), reader);
    FrameHeader start;
    start.kind = FrameKind::kStart;
    start.sequence = written();
    start.writer = pack(guid_);
    Frame frame;
    frame.bytes.resize(sizeof start);
    std::memcpy(frame.bytes.data(), &start, sizeof start);
    // an input whose lane does not begin asks again
    lane->id = loop_->add(lane->fd.get(), lane, EPOLLIN);
    if (lane->id == 0) {
      return;
    }
    if (!try_send(*lane, frame)) {
      loop_->remove(lane->id, lane->fd.get());
      return;
    }
    lanes_.push_back(lane);
    for (const FramePtr& kept : kept_) {
      offer(*lane, kept, true);
    }
  }
  on_readers_changed_();
}

void LaneWriter::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (const auto& lane : lanes_) {
    loop_->remove(lane->id, lane->fd.get());
    shutdown(lane->fd.get(), SHUT_WR);
  }
  lanes_.clear();
  progress_.notify_all();
}

[[gnu::hot]] LaneWriter::FramePtr LaneWriter::spare_frame() {
  for (const FramePtr& frame : frames_) {
    if (frame.use_count() == 1) {
      frame->slot.reset();
      return frame;
    }
  }
  auto frame = std::make_shared<Frame>();
  if (frames_.size() < kSpareFrames) {
    frames_.push_back(frame);
  }
  return frame;
}

[[gnu::hot]] std::shared_ptr<LaneWriter::Slot> LaneWriter::free_slot(std::size_t bytes) {
  for (const FramePtr& frame : frames_) {
    if (frame.use_count() == 1) {
      frame->slot.reset();
    }
  }
  for (const auto& slot : slots_) {
    if (slot.use_count() == 1 && slot->bytes >= kSlotHead_bytes + bytes) {
      return slot;
    }
  }
  auto slot = std::make_shared<Slot>();
  // few sizes, so that slots fit again when the messages' sizes vary
  slot->bytes = std::bit_ceil(kSlotHead_bytes + bytes);
  slot->id = ++last_slot_;
  slot->fd = Fd(memfd_create("nido-lane", MFD_CLOEXEC));
  if (!slot->fd.is_open() || ftruncate(slot->fd.get(), static_cast<off_t>(slot->bytes)) != 0) {
    return nullptr;
  }
  void* memory = mmap(nullptr, slot->bytes, PROT_READ | PROT_WRITE, MAP_SHARED, slot->fd.get(), 0);
  if (memory == MAP_FAILED) {
    return nullptr;
  }
  slot->memory = static_cast<std::uint8_t*>(memory);
  slots_.push_back(slot);
  return slot;
}

bool LaneWriter::try_send(Lane& lane, const Frame& frame) {
  const bool is_new = frame.slot && !lane.knows(*frame.slot);
  if (frame.slot) {
    const std::size_t most = settings_.reliable ? kMostHeld : kMostHeldBestEffort;
    // the input may be ahead of this process's loop, and a message dropped for no reason
    if (lane.held.size() >= most) {
      (void)read_answers(lane);
    }
    if (lane.held.size() >= most) {
      return false;
    }
  }
  const std::array<int, 1> file{is_new ? frame.slot->fd.get() : -1};
  for (;;) {
    if (send_packet(lane.fd.get(), frame.bytes,
                    is_new ? std::span<const int>(file) : std::span<const int>()) >= 0) {
      lane.last_sent = std::max(lane.last_sent, frame.sequence);
      if (frame.slot) {
        lane.held.push_back(frame.slot);
        if (is_new) {
          lane.known_slots.push_back(frame.slot->id);
        }
      }
      return true;
    }
    if (errno == EINTR) {
      continue;
    }
    if (errno == EAGAIN && !lane.waits_for_socket && lane.id != 0) {
      lane.waits_for_socket = true;
      loop_->change(lane.id, lane.fd.get(), EPOLLIN | EPOLLOUT);
    }
    if (errno != EAGAIN && errno != EPIPE && errno != ECONNRESET) {
      flush_later(lane);  // the system has no memory for it, or too many files are under way
    }
    // an input that has gone is noticed by the loop
    return false;
  }
}

void LaneWriter::flush_later(Lane& lane) {
  if (!std::exchange(lane.is_flushed_later, true)) {
    loop_->post(
        [weak = weak_from_this(), lane_weak = lane.weak_from_this()] {
          const auto self = weak.lock();
          const auto again = lane_weak.lock();
          if (self && again) {
            const std::lock_guard lock(self->mutex_);
            again->is_flushed_later = false;
            self->flush(*again);
          }
        },
        kPause);
  }
}

void LaneWriter::offer(Lane& lane, const FramePtr& frame, bool is_urgent) {
  if (lane.pending.empty() && try_send(lane, *frame)) {
    return;
  }
  if (!is_urgent && !settings_.reliable) {
    return;  // the input counts it as lost
  }
  if (!is_urgent && !settings_.keep_all && lane.pending.size() >= settings_.depth) {
    lane.pending.pop_front();
  }
  lane.pending.push_back(frame);
}

void LaneWriter::flush(Lane& lane) {
  while (!lane.pending.empty() && try_send(lane, *lane.pending.front())) {
    lane.pending.pop_front();
  }
  progress_.notify_all();
}

[[gnu::hot]] bool LaneWriter::tell(Lane& lane, const Frame& frame, const FrameHeader& header) {
  if (!frame.slot || !lane.has_board || !lane.pending.empty() || !lane.knows(*frame.slot)) {
    return false;
  }
  if (!lane.held.empty()) {
    (void)read_answers(lane);
    if (!lane.held.empty()) {
      return false;
    }
  }
  lane.held.push_back(frame.slot);
  lane.board->tell(header, lane.last_sent);
  lane.last_sent = header.sequence;
  return true;
}

void LaneWriter::send_board(Lane& lane) {
  auto board = LaneBoardOutput::make();
  if (!board) {
    return;
  }
  FrameHeader header;
  header.kind = FrameKind::kBoard;
  std::array<unsigned char, sizeof header> bytes{};
  std::memcpy(bytes.data(), &header, sizeof header);
  const std::array<int, 2> files{board->bell(), board->memory()};
  if (send_packet(lane.fd.get(), bytes, files) >= 0) {
    lane.board = std::move(board);
  }
}

[[gnu::hot]] void LaneWriter::distribute(const FramePtr& frame, const FrameHeader& header) {
  std::memcpy(frame->bytes.data(), &header, sizeof header);
  frame->sequence = header.sequence;
  for (const auto& lane : lanes_) {
    if (tell(*lane, *frame, header)) {
      continue;
    }
    if (frame->slot && !lane->board) {
      send_board(*lane);
    }
    offer(*lane, frame, false);
  }
  if (settings_.transient_local) {
    if (kept_.size() >= std::max<std::size_t>(settings_.depth, 1)) {
      kept_.erase(kept_.begin());
    }
    kept_.push_back(frame);
  }
}

bool LaneWriter::wait_for_room(std::unique_lock<std::mutex>& lock) {
  const auto has_room = [&] {
    return std::all_of(lanes_.begin(), lanes_.end(),
                       [](const auto& lane) { return lane->pending.size() < kCommandRoom; });
  };
  if (has_room()) {
    return true;
  }
  // a thread that delivers messages may not wait for another one that may wait for it
  return !LaneLoop::is_this_thread_one() && progress_.wait_for(lock, kCommandPatience, has_room);
}

Sent LaneWriter::write(const void* message, const Related* related) {
  std::unique_lock lock(mutex_);
  if (settings_.keep_all && !wait_for_room(lock)) {
    return Sent::kNoRoom;
  }
  const std::uint64_t sequence = written() + 1;
  if (!lanes_.empty() || settings_.transient_local) {
    // DDS asks for a mutable address but only reads
    void* const source = const_cast<void*>(message);
    const std::size_t room = support_->getSerializedSizeProvider(source)();
    const FramePtr frame = spare_frame();
    FrameHeader header;
    header.kind = FrameKind::kMessage;
    header.sequence = sequence;
    header.source_time_ns = wall_now_ns();
    if (related != nullptr) {
      header.related = pack(related->reader);
      header.related_sequence = related->sequence;
    }
    std::uint8_t* place = nullptr;
    if (room > kMostInline_bytes) {
      frame->slot = free_slot(room);
      if (!frame->slot) {
        return Sent::kNoMemory;
      }
      header.kind = FrameKind::kShared;
      header.slot = frame->slot->id;
      header.slot_bytes = static_cast<std::uint32_t>(frame->slot->bytes);
      frame->bytes.resize(sizeof header);
      place = frame->slot->payload().data();
    } else {
      frame->bytes.resize(sizeof header + room);
      place = frame->bytes.data() + sizeof header;
    }
    Payload payload(place, room);
    if (!support_->serialize(source, payload.get())) {
      return Sent::kFailed;
    }
    header.size = payload.get()->length;
    distribute(frame, header);
  }
  written_.store(sequence, std::memory_order_release);
  return Sent::kYes;
}

[[gnu::hot]] std::uint8_t* LaneWriter::loan(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  loan_.reset();
  loan_ = free_slot(std::max(bytes, kMostInline_bytes));
  return loan_ ? loan_->payload().data() : nullptr;
}

std::span<const std::uint8_t> LaneWriter::loaned() const {
  return loan_ ? loan_->payload() : std::span<std::uint8_t>();
}

[[gnu::hot]] Sent LaneWriter::write_loan(std::size_t bytes) {
  std::unique_lock lock(mutex_);
  if (!loan_ || bytes > loan_->payload().size()) {
    return Sent::kFailed;
  }
  if (settings_.keep_all && !wait_for_room(lock)) {
    return Sent::kNoRoom;
  }
  const FramePtr frame = spare_frame();
  frame->slot = std::move(loan_);
  FrameHeader header;
  header.kind = FrameKind::kShared;
  header.size = static_cast<std::uint32_t>(bytes);
  header.sequence = written() + 1;
  header.source_time_ns = wall_now_ns();
  header.slot = frame->slot->id;
  header.slot_bytes = static_cast<std::uint32_t>(frame->slot->bytes);
  frame->bytes.resize(sizeof header);
  distribute(frame, header);
  written_.store(header.sequence, std::memory_order_release);
  return Sent::kYes;
}

void LaneWriter::each_kept(
    const std::function<void(std::span<const std::uint8_t> payload, std::uint64_t sequence)>& use) {
  const std::lock_guard lock(mutex_);
  for (const FramePtr& frame : kept_) {
    FrameHeader header;
    std::memcpy(&header, frame->bytes.data(), sizeof header);
    const std::uint8_t* const begin =
        frame->slot ? frame->slot->payload().data() : frame->bytes.data() + sizeof header;
    use({begin, header.size}, header.sequence);
  }
}

std::set<Guid> LaneWriter::readers() const {
  const std::lock_guard lock(mutex_);
  std::set<Guid> all;
  for (const auto& lane : lanes_) {
    all.insert(lane->reader);
  }
  return all;
}

bool LaneWriter::wait_until_received(double timeout_s) {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = ++last_sync_;
  FrameHeader header;
  header.kind = FrameKind::kSync;
  header.sequence = number;
  const auto frame = std::make_shared<Frame>();
  frame->bytes.resize(sizeof header);
  std::memcpy(frame->bytes.data(), &header, sizeof header);
  for (const auto& lane : lanes_) {
    offer(*lane, frame, true);
  }
  return progress_.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    return std::all_of(lanes_.begin(), lanes_.end(),
                       [&](const auto& lane) { return lane->synced >= number; });
  });
}

void LaneWriter::drop(const std::shared_ptr<Lane>& lane) {
  loop_->remove(lane->id, lane->fd.get());
  std::erase(lanes_, lane);
  progress_.notify_all();
}

LaneWriter::Answers LaneWriter::read_answers(Lane& lane) {
  Answers answers;
  for (;;) {
    FrameHeader header;
    const ssize_t size = recv(lane.fd.get(), &header, sizeof header, MSG_DONTWAIT);
    if (size == static_cast<ssize_t>(sizeof header)) {
      if (header.kind == FrameKind::kRelease) {
        std::erase_if(lane.held, [&](const auto& slot) { return slot->id == header.slot; });
        if (header.slot_bytes == 0) {
          std::erase(lane.known_slots, header.slot);
        }
        answers.has_released = true;
      } else if (header.kind == FrameKind::kBoard) {
        lane.has_board = true;
      } else if (header.kind == FrameKind::kSync) {
        lane.synced = std::max(lane.synced, header.sequence);
        progress_.notify_all();
      }
      continue;
    }
    if (size < 0 && errno == EINTR) {
      continue;
    }
    answers.is_gone = !(size < 0 && errno == EAGAIN);
    return answers;
  }
}

void LaneWriter::on_ready(const std::shared_ptr<Lane>& lane, std::uint32_t epoll_events) {
  bool is_gone = false;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) {
      return;
    }
    const Answers answers = read_answers(*lane);
    is_gone = answers.is_gone;
    if (is_gone) {
      drop(lane);
    } else if (answers.has_released || (epoll_events & EPOLLOUT) != 0) {
      if (lane->waits_for_socket) {
        lane->waits_for_socket = false;
        loop_->change(lane->id, lane->fd.get(), EPOLLIN);
      }
      flush(*lane);
    }
  }
  if (is_gone) {
    on_readers_changed_();
  }
}

}  // namespace nido
