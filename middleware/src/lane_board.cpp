#include "lane_board.h"

#include <sys/eventfd.h>
#include <sys/mman.h>

namespace nido {

std::unique_ptr<LaneBoardOutput> LaneBoardOutput::make() {
  std::unique_ptr<LaneBoardOutput> self(new LaneBoardOutput());
  self->bell_ = Fd(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  self->memory_ = Fd(memfd_create("nido-lane-board", MFD_CLOEXEC));
  if (!self->bell_.is_open() || !self->memory_.is_open() ||
      ftruncate(self->memory_.get(), sizeof(LaneBoardPage)) != 0) {
    return nullptr;
  }
  void* const memory =
      mmap(nullptr, sizeof(LaneBoardPage), PROT_READ | PROT_WRITE, MAP_SHARED, self->memory_.get(), 0);
  if (memory == MAP_FAILED) {
    return nullptr;
  }
  self->page_ = static_cast<LaneBoardPage*>(memory);
  return self;
}

LaneBoardOutput::~LaneBoardOutput() {
  if (page_ != nullptr) {
    munmap(page_, sizeof(LaneBoardPage));
  }
}

[[gnu::hot]] void LaneBoardOutput::tell(const FrameHeader& header, std::uint64_t after) {
  page_->after = after;
  page_->header = header;
  page_->sequence.store(header.sequence, std::memory_order_release);
  const std::uint64_t one = 1;
  // an eventfd takes eight bytes, or has been rung 2^64 times
  [[maybe_unused]] const ssize_t written = write(bell_.get(), &one, sizeof one);
}

std::unique_ptr<LaneBoardInput> LaneBoardInput::make(Fd bell, const Fd& memory) {
  if (!bell.is_open() || !memory.is_open()) {
    return nullptr;
  }
  void* const page =
      mmap(nullptr, sizeof(LaneBoardPage), PROT_READ, MAP_SHARED | MAP_POPULATE, memory.get(), 0);
  if (page == MAP_FAILED) {
    return nullptr;
  }
  std::unique_ptr<LaneBoardInput> self(new LaneBoardInput());
  self->bell_ = std::move(bell);
  self->page_ = static_cast<const LaneBoardPage*>(page);
  return self;
}

LaneBoardInput::~LaneBoardInput() { munmap(const_cast<LaneBoardPage*>(page_), sizeof(LaneBoardPage)); }

[[gnu::hot]] std::optional<FrameHeader> LaneBoardInput::read_after(std::uint64_t last) const {
  // what has not been read stays as it is
  if (page_->sequence.load(std::memory_order_acquire) <= last || page_->after > last) {
    return std::nullopt;
  }
  return page_->header;
}

}  // namespace nido
