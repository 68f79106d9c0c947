#include "nido/yarp/event_loop.h"

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace nido::yarp {
namespace {

std::uint32_t events_of(bool read, bool write) {
  return (read ? static_cast<std::uint32_t>(EPOLLIN | EPOLLRDHUP) : 0U) |
         (write ? static_cast<std::uint32_t>(EPOLLOUT) : 0U);
}

}  // namespace

Result<std::unique_ptr<EventLoop>> EventLoop::create() {
  std::unique_ptr<EventLoop> loop(new EventLoop());
  loop->epoll_fd_ = epoll_create1(EPOLL_CLOEXEC);
  loop->wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (loop->epoll_fd_ < 0 || loop->wake_fd_ < 0) {
    return Error{ErrorCode::kFailed, fmt::format("no event loop: {}", std::strerror(errno))};
  }
  EventLoop* raw = loop.get();
  Status watching = raw->watch(raw->wake_fd_, true, false, [raw](Happened) {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t bytes = read(raw->wake_fd_, &count, sizeof count);
  });
  if (!watching) return watching.error();
  return loop;
}

EventLoop::~EventLoop() {
  if (wake_fd_ >= 0) close(wake_fd_);
  if (epoll_fd_ >= 0) close(epoll_fd_);
}

Status EventLoop::watch(int fd, bool read, bool write, Handler handler) {
  const std::uint64_t generation = ++generations_;
  epoll_event event{};
  event.events = events_of(read, write);
  // the generation tells a new descriptor from an old one with the same number
  event.data.u64 = generation << 24U | static_cast<std::uint64_t>(static_cast<unsigned>(fd));
  if (epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, fd, &event) != 0) {
    return Error{ErrorCode::kFailed, fmt::format("a socket cannot be watched: {}", std::strerror(errno))};
  }
  watched_[fd] = {generation, std::make_shared<Handler>(std::move(handler))};
  return {};
}

void EventLoop::change(int fd, bool read, bool write) {
  const auto found = watched_.find(fd);
  if (found == watched_.end()) return;
  epoll_event event{};
  event.events = events_of(read, write);
  event.data.u64 = found->second.generation << 24U | static_cast<std::uint64_t>(static_cast<unsigned>(fd));
  epoll_ctl(epoll_fd_, EPOLL_CTL_MOD, fd, &event);
}

void EventLoop::unwatch(int fd) {
  if (watched_.erase(fd) > 0) epoll_ctl(epoll_fd_, EPOLL_CTL_DEL, fd, nullptr);
}

void EventLoop::wake() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t bytes = write(wake_fd_, &one, sizeof one);
}

void EventLoop::post(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    posted_.push_back(std::move(work));
  }
  wake();
}

void EventLoop::every(double period_s, std::function<void()> work) {
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(period_s));
  periodics_.push_back({period, std::chrono::steady_clock::now() + period, std::move(work)});
}

void EventLoop::turn(double timeout_s) {
  auto wait = std::chrono::duration<double>(timeout_s);
  const auto now = std::chrono::steady_clock::now();
  for (const Periodic& periodic : periodics_) {
    wait = std::min(wait, std::chrono::duration<double>(periodic.due - now));
  }
  {
    const std::lock_guard lock(mutex_);
    if (!posted_.empty()) wait = std::chrono::duration<double>(0);
  }
  std::array<epoll_event, 64> events{};
  const int timeout_ms = std::max(0, static_cast<int>(wait.count() * 1000 + 0.999));
  const int count = epoll_wait(epoll_fd_, events.data(), static_cast<int>(events.size()), timeout_ms);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    const int fd = static_cast<int>(event.data.u64 & 0xffffffU);
    const auto found = watched_.find(fd);
    // one that a handler before closed has nothing to say any more
    if (found == watched_.end() || found->second.generation != event.data.u64 >> 24U) continue;
    const std::shared_ptr<Handler> handler = found->second.handler;
    (*handler)({(event.events & (EPOLLIN | EPOLLRDHUP)) != 0, (event.events & EPOLLOUT) != 0,
                (event.events & (EPOLLERR | EPOLLHUP)) != 0});
  }
  std::vector<std::function<void()>> work;
  {
    const std::lock_guard lock(mutex_);
    work.swap(posted_);
  }
  for (const auto& item : work) item();
  for (std::size_t i = 0; i < periodics_.size(); ++i) {
    const auto later = std::chrono::steady_clock::now();
    if (periodics_[i].due > later) continue;
    periodics_[i].due = later + periodics_[i].period;
    const auto periodic = periodics_[i].work;
    periodic();
  }
}

void EventLoop::run() {
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
    }
    turn(1.0);
  }
}

void EventLoop::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  wake();
}

}  // namespace nido::yarp
