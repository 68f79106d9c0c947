#include "lane_loop.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <system_error>

namespace nido {

namespace {

thread_local bool t_is_loop = false;

}  // namespace

LaneLoop::LaneLoop() : events_(epoll_create1(EPOLL_CLOEXEC)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = 0;
  if (!wake_.is_open() || epoll_ctl(events_.get(), EPOLL_CTL_ADD, wake_.get(), &event) != 0) {
    return;
  }
  try {
    thread_ = std::thread([this] { serve(); });
  } catch (const std::system_error&) {
    // there are no more threads: is_running() tells
  }
}

LaneLoop::~LaneLoop() { stop(); }

void LaneLoop::stop() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake();
  if (thread_.joinable()) {
    thread_.join();
  }
  // what is dropped may hold this loop: not under the lock
  std::map<std::uint64_t, std::shared_ptr<Served>> served;
  std::multimap<Steady::time_point, std::function<void()>> posted;
  const std::lock_guard lock(mutex_);
  served.swap(served_);
  posted.swap(posted_);
}

bool LaneLoop::is_this_thread_one() { return t_is_loop; }

void LaneLoop::wake() const {
  const std::uint64_t one = 1;
  // an eventfd takes eight bytes, or is awake already
  [[maybe_unused]] const ssize_t written = write(wake_.get(), &one, sizeof one);
}

std::uint64_t LaneLoop::add(int fd, std::shared_ptr<Served> served, std::uint32_t epoll_events) {
  const std::lock_guard lock(mutex_);
  epoll_event event{};
  event.events = epoll_events;
  event.data.u64 = ++last_id_;
  if (epoll_ctl(events_.get(), EPOLL_CTL_ADD, fd, &event) != 0) {
    return 0;
  }
  served_[last_id_] = std::move(served);
  return last_id_;
}

void LaneLoop::change(std::uint64_t id, int fd, std::uint32_t epoll_events) {
  epoll_event event{};
  event.events = epoll_events;
  event.data.u64 = id;
  epoll_ctl(events_.get(), EPOLL_CTL_MOD, fd, &event);
}

void LaneLoop::remove(std::uint64_t id, int fd) {
  std::shared_ptr<Served> gone;  // may be the last to hold it: not under the lock
  const std::lock_guard lock(mutex_);
  epoll_ctl(events_.get(), EPOLL_CTL_DEL, fd, nullptr);
  if (const auto found = served_.find(id); found != served_.end()) {
    gone = std::move(found->second);
    served_.erase(found);
  }
}

void LaneLoop::post(std::function<void()> work, std::chrono::milliseconds delay) {
  {
    const std::lock_guard lock(mutex_);
    posted_.emplace(Steady::now() + delay, std::move(work));
  }
  wake();
}

int LaneLoop::work_off() {
  for (;;) {
    std::function<void()> work;
    {
      const std::lock_guard lock(mutex_);
      if (posted_.empty()) {
        return -1;
      }
      const auto left = posted_.begin()->first - Steady::now();
      if (left > Steady::duration::zero()) {
        return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
      }
      work = std::move(posted_.begin()->second);
      posted_.erase(posted_.begin());
    }
    work();
  }
}

[[gnu::hot]] void LaneLoop::serve() {
  t_is_loop = true;
  std::array<epoll_event, 32> ready{};
  int wait_ms = -1;
  for (;;) {
    const int count = epoll_wait(events_.get(), ready.data(), static_cast<int>(ready.size()), wait_ms);
    bool is_woken = wait_ms >= 0;
    for (int i = 0; i < count; ++i) {
      const epoll_event& event = ready[static_cast<std::size_t>(i)];
      if (event.data.u64 == 0) {
        std::uint64_t counted = 0;
        [[maybe_unused]] const ssize_t size = read(wake_.get(), &counted, sizeof counted);
        is_woken = true;
        continue;
      }
      std::shared_ptr<Served> served;
      {
        const std::lock_guard lock(mutex_);
        if (const auto found = served_.find(event.data.u64); found != served_.end()) {
          served = found->second;
        }
      }
      if (served) {
        served->on_ready(event.events);
      }
    }
    if (is_woken) {
      {
        const std::lock_guard lock(mutex_);
        if (closing_) {
          return;
        }
      }
      wait_ms = work_off();
    }
  }
}

}  // namespace nido
