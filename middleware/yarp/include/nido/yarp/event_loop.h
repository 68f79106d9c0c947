#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido::yarp {

// One thread that waits for many sockets. All functions are for that thread, except post() and stop().
class EventLoop {
 public:
  static Result<std::unique_ptr<EventLoop>> create();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // What has happened to a file descriptor; `broken`: an error or the far side is gone, reading says which.
  struct Happened {
    bool readable = false;
    bool writable = false;
    bool broken = false;
  };
  using Handler = std::function<void(Happened)>;
  // Calls the handler when there is something to read or room to write, until unwatch().
  Status watch(int fd, bool read, bool write, Handler handler);
  void change(int fd, bool read, bool write);
  void unwatch(int fd);

  // Runs a function on the loop's thread, in the order of posting. From any thread.
  void post(std::function<void()> work);
  // Runs a function again and again, as long as the loop lives.
  void every(double period_s, std::function<void()> work);

  // Waits at most timeout_s for something to happen and handles it.
  void turn(double timeout_s);
  // Until stop().
  void run();
  void stop();

 private:
  EventLoop() = default;
  void wake();

  struct Watched {
    std::uint64_t generation = 0;
    std::shared_ptr<Handler> handler;
  };
  struct Periodic {
    std::chrono::steady_clock::duration period{};
    std::chrono::steady_clock::time_point due;
    std::function<void()> work;
  };
  int epoll_fd_ = -1;
  int wake_fd_ = -1;
  std::uint64_t generations_ = 0;
  std::map<int, Watched> watched_;
  std::vector<Periodic> periodics_;
  std::mutex mutex_;  // of what follows
  std::vector<std::function<void()>> posted_;
  bool stopped_ = false;
};

}  // namespace nido::yarp
