#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace nido::gateway {

// A thread that does one piece of work after the other: what waits for DDS must not hold up the sockets. The
// number of pieces that wait is that of the connections that asked, since each waits for its answer.
// Thread-safe.
class Worker {
 public:
  Worker() : thread_([this] { work(); }) {}
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Waits until all that was added before is done. Not from a piece of work.
  void wait() {
    std::promise<void> done;
    add([&done] { done.set_value(); });
    done.get_future().wait();
  }

  void add(std::function<void()> piece) {
    {
      const std::lock_guard lock(mutex_);
      pieces_.push_back(std::move(piece));
    }
    changed_.notify_all();
  }

 private:
  void work() {
    for (;;) {
      std::function<void()> piece;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return ends_ || !pieces_.empty(); });
        if (ends_) return;
        piece = std::move(pieces_.front());
        pieces_.pop_front();
      }
      piece();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> pieces_;
  bool ends_ = false;
  std::thread thread_;  // last: it uses the above
};

// Workers by name, each as long as somebody holds it. For one thread.
class Workers {
 public:
  std::shared_ptr<Worker> of(const std::string& name) {
    std::shared_ptr<Worker> worker = workers_[name].lock();
    if (!worker) {
      worker = std::make_shared<Worker>();
      workers_[name] = worker;
    }
    return worker;
  }

 private:
  std::map<std::string, std::weak_ptr<Worker>> workers_;
};

}  // namespace nido::gateway
