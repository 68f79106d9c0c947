#include "lane_board.h"

#include <sys/eventfd.h>
#include <sys/mman.h>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace nido {

namespace {

// ThreadSanitizer knows memory by its address, and a page that one process has mapped twice has two: it is
// told of the order that the page's number makes between an output and an input of one process.
#ifdef __SANITIZE_THREAD__
char order;
void tell_tsan_of_release() { __tsan_release(&order); }
void tell_tsan_of_acquire() { __tsan_acquire(&order); }
#else
void tell_tsan_of_release() {}
void tell_tsan_of_acquire() {}
#endif

}  // namespace

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
  tell_tsan_of_release();
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
  tell_tsan_of_acquire();
  return page_->header;
}

}  // namespace nido
