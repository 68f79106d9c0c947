#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "lane_wire.h"

namespace nido {

// A thread that waits for sockets and serves them, one call at a time. Thread-safe.
class LaneLoop {
 public:
  // Something with a socket.
  class Served {
   public:
    virtual ~Served() = default;
    virtual void on_ready(std::uint32_t epoll_events) = 0;
  };

  LaneLoop();
  ~LaneLoop();
  LaneLoop(const LaneLoop&) = delete;
  LaneLoop& operator=(const LaneLoop&) = delete;

  // Ends the thread, what is still posted is dropped. To be called by who made the loop, as others may hold
  // it longer.
  void stop();

  // False when the system gave it no files or no thread: it serves nothing.
  [[nodiscard]] bool is_running() const { return thread_.joinable(); }
  // Serves until remove(id). Returns the id; 0 when the system cannot watch one more.
  std::uint64_t add(int fd, std::shared_ptr<Served> served, std::uint32_t epoll_events);
  void change(std::uint64_t id, int fd, std::uint32_t epoll_events);
  // A call that is going on may still end after this.
  void remove(std::uint64_t id, int fd);
  // Called on the thread, soon or not before a delay is over.
  void post(std::function<void()> work, std::chrono::milliseconds delay = std::chrono::milliseconds(0));
  // True on the thread of any loop: it may not wait for what other threads of its kind do.
  static bool is_this_thread_one();

 private:
  using Steady = std::chrono::steady_clock;
  void serve();
  void wake() const;
  // Does what is due; milliseconds until the next, -1 for none.
  int work_off();

  Fd events_;
  Fd wake_;
  std::mutex mutex_;
  bool closing_ = false;
  std::uint64_t last_id_ = 0;
  std::map<std::uint64_t, std::shared_ptr<Served>> served_;
  std::multimap<Steady::time_point, std::function<void()>> posted_;
  std::thread thread_;
};

}  // namespace nido
