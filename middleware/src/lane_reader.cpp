#include "lane_reader.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/mman.h>

#include <cerrno>
#include <utility>

namespace nido {

namespace {

// until a lane that did not begin is tried again
constexpr auto kRetry = std::chrono::milliseconds(10);
// then the other sockets have their turn
constexpr int kMostAtOnce = 16;

}  // namespace

class LaneReader::Bell final : public LaneLoop::Served {
 public:
  explicit Bell(std::weak_ptr<LaneReader> reader) : reader_(std::move(reader)) {}
  void on_ready(std::uint32_t /*epoll_events*/) override {
    if (const auto reader = reader_.lock()) {
      if (const auto sink = reader->sink_.lock()) {
        reader->read_board(*sink);
      }
    }
  }

 private:
  const std::weak_ptr<LaneReader> reader_;
};

LaneReader::LaneReader(std::shared_ptr<LaneLoop> loop, const Guid& writer, const Guid& reader,
                       std::weak_ptr<LaneSink> sink)
    : loop_(std::move(loop)),
      writer_(writer),
      reader_(reader),
      sink_(std::move(sink)),
      buffer_(sizeof(FrameHeader) + kMostInline_bytes) {}

std::shared_ptr<LaneReader> LaneReader::open(std::shared_ptr<LaneLoop> loop, const Guid& writer,
                                             const Guid& reader, std::weak_ptr<LaneSink> sink) {
  std::shared_ptr<LaneReader> self(new LaneReader(std::move(loop), writer, reader, std::move(sink)));
  self->connect();
  return self;
}

LaneReader::~LaneReader() {
  for (const auto& [id, slot] : slots_) {
    munmap(const_cast<std::uint8_t*>(slot.memory), slot.bytes);
  }
}

void LaneReader::connect() {
  const std::lock_guard lock(mutex_);
  if (!is_open_) {
    return;
  }
  const LaneAddress address(writer_.guidPrefix);
  Fd fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd.is_open() || ::connect(fd.get(), address.get(), address.length) != 0) {
    // nobody listens there any more: that process is gone for good. Whatever else it is may pass: the other
    // one has more newcomers than it has got to know yet, or there are no more files for this one.
    if (errno != ECONNREFUSED) {
      connect_later();
    }
    return;
  }
  FrameHeader hello;
  hello.kind = FrameKind::kHello;
  hello.writer = pack(writer_);
  hello.reader = pack(reader_);
  if (send(fd.get(), &hello, sizeof hello, MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
    connect_later();
    return;
  }
  fd_ = std::move(fd);
  id_ = loop_->add(fd_.get(), shared_from_this(), EPOLLIN);
  if (id_ == 0) {
    fd_ = Fd();
    connect_later();
  }
}

void LaneReader::connect_later() {
  loop_->post([self = shared_from_this()] { self->connect(); }, kRetry);
}

bool LaneReader::start() {
  const std::lock_guard lock(mutex_);
  is_started_ = is_open_;
  return is_started_;
}

void LaneReader::close() {
  const std::lock_guard lock(mutex_);
  shut();
}

void LaneReader::shut() {
  is_open_ = false;
  if (fd_.is_open()) {
    loop_->remove(id_, fd_.get());
    if (bell_id_ != 0) {
      loop_->remove(bell_id_, board_->bell());
    }
    // the number stays taken until the loop is surely done with it
    shutdown(fd_.get(), SHUT_RDWR);
  }
}

bool LaneReader::abandon() {
  const std::lock_guard lock(mutex_);
  if (is_started_) {
    return false;
  }
  shut();
  return true;
}

void LaneReader::end() {
  bool was_started = false;
  {
    const std::lock_guard lock(mutex_);
    was_started = std::exchange(is_started_, false);
    if (!was_started && is_open_) {
      // the output is not known there yet, or could not take this socket
      loop_->remove(id_, fd_.get());
      fd_ = Fd();
      connect_later();
      return;
    }
  }
  close();
  if (was_started) {
    if (const auto sink = sink_.lock()) {
      sink->on_lane_end(writer_);
    }
  }
}

void LaneReader::on_ready(std::uint32_t epoll_events) {
  const auto sink = sink_.lock();
  if (!sink) {
    close();
    return;
  }
  if ((epoll_events & EPOLLOUT) != 0) {
    send_answers();
  }
  for (int i = 0; i < kMostAtOnce; ++i) {
    if (!receive_one(*sink)) {
      break;
    }
  }
  read_board(*sink);  // what waited for the packets that were sent before
}

[[gnu::hot]] void LaneReader::answer(const FrameHeader& header) {
  answers_.push_back(header);
  send_answers();
}

[[gnu::hot]] void LaneReader::send_answers() {
  while (!answers_.empty() &&
         send(fd_.get(), &answers_.front(), sizeof(FrameHeader), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) {
    answers_.pop_front();
  }
  if (waits_for_room_ == answers_.empty()) {
    waits_for_room_ = !answers_.empty();
    const std::lock_guard lock(mutex_);
    if (is_open_) {
      loop_->change(id_, fd_.get(), std::uint32_t{EPOLLIN} | (waits_for_room_ ? EPOLLOUT : 0U));
    }
  }
}

void LaneReader::map_slot(const FrameHeader& header, const Fd& file) {
  void* memory = mmap(nullptr, header.slot_bytes, PROT_READ, MAP_SHARED | MAP_POPULATE, file.get(), 0);
  if (memory == MAP_FAILED) {
    return;
  }
  Slot& slot = slots_[header.slot];
  if (slot.memory != nullptr) {
    munmap(const_cast<std::uint8_t*>(slot.memory), slot.bytes);
  }
  slot = {static_cast<const std::uint8_t*>(memory), header.slot_bytes};
}

bool LaneReader::take_board(LaneFiles files) {
  auto board = LaneBoardInput::make(std::move(files[0]), files[1]);
  const std::lock_guard lock(mutex_);
  if (!board || board_ || !is_open_) {
    return false;
  }
  bell_id_ = loop_->add(board->bell(), std::make_shared<Bell>(weak_from_this()), EPOLLIN | EPOLLET);
  if (bell_id_ != 0) {
    board_ = std::move(board);
  }
  return bell_id_ != 0;
}

[[gnu::hot]] void LaneReader::read_board(LaneSink& sink) {
  if (const auto header = board_ ? board_->read_after(last_) : std::nullopt) {
    deliver_shared(sink, *header);
  }
}

[[gnu::hot]] void LaneReader::deliver_shared(LaneSink& sink, const FrameHeader& header) {
  last_ = header.sequence;
  FrameHeader read;
  read.kind = FrameKind::kRelease;
  read.slot = header.slot;
  // without its file, for which there is no room in this process, a message is lost, and counted by the next
  // one; the output is told to pass the file along again
  if (const auto slot = slots_.find(header.slot);
      slot != slots_.end() && kSlotHead_bytes + header.size <= slot->second.bytes) {
    read.slot_bytes = header.slot_bytes;
    sink.on_lane_frame(writer_, header, {slot->second.memory + kSlotHead_bytes, header.size});
  }
  answer(read);
}

bool LaneReader::receive_one(LaneSink& sink) {
  LaneFiles files;
  const ssize_t size = receive_packet(fd_.get(), buffer_, files);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
    return false;
  }
  if (size < 0 && errno == ECONNRESET) {
    return true;  // said once, when the output has gone with answers unread: what it sent can still be read
  }
  FrameHeader header;
  if (size < static_cast<ssize_t>(sizeof header)) {
    read_board(sink);
    end();
    return false;
  }
  std::memcpy(&header, buffer_.data(), sizeof header);
  // what was told before this was sent
  read_board(sink);
  const std::span<const std::uint8_t> inline_payload(buffer_.data() + sizeof header,
                                                     static_cast<std::size_t>(size) - sizeof header);
  switch (header.kind) {
    case FrameKind::kStart:
      if (!start()) {
        return false;
      }
      sink.on_lane_start(writer_);
      return true;
    case FrameKind::kMessage:
      last_ = header.sequence;
      if (header.size <= inline_payload.size()) {
        sink.on_lane_frame(writer_, header, inline_payload.first(header.size));
      }
      return true;
    case FrameKind::kBoard:
      if (take_board(std::move(files))) {
        answer(header);
      }
      return true;
    case FrameKind::kShared:
      if (files[0].is_open()) {
        map_slot(header, files[0]);
      }
      deliver_shared(sink, header);
      return true;
    case FrameKind::kSync: {
      FrameHeader same;
      same.kind = FrameKind::kSync;
      same.sequence = header.sequence;
      answer(same);
      return true;
    }
    case FrameKind::kHello:
    case FrameKind::kRelease:
      break;
  }
  end();
  return false;
}

}  // namespace nido
