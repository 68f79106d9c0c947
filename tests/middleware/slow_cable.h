#pragma once

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace nido::testing {

// A cable between two network namespaces that takes its time and loses packets, each way by itself: a TUN
// device named `cable` in each, and a thread that carries packets from one to the other. It needs no netem in
// the kernel. Root only.
class SlowCable {
 public:
  SlowCable(const std::string& one, const std::string& other, std::chrono::milliseconds delay, double loss)
      : delay_(delay), loss_(loss), thread_([this, one, other] { carry(one, other); }) {}
  ~SlowCable() {
    is_over_ = true;
    thread_.join();
  }
  SlowCable(const SlowCable&) = delete;
  SlowCable& operator=(const SlowCable&) = delete;

  // True when both ends are there; false if they cannot be made.
  [[nodiscard]] bool is_plugged() const {
    while (state_ == State::kMaking) {
      std::this_thread::yield();
    }
    return state_ == State::kMade;
  }
  [[nodiscard]] int carried() const { return carried_; }
  [[nodiscard]] int lost() const { return lost_; }
  // How much more than its delay a packet took at most: a busy machine gave the thread no turn.
  [[nodiscard]] double latest_ms() const { return latest_ms_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class State { kMaking, kMade, kImpossible };
  struct Packet {
    Clock::time_point due;
    std::vector<char> bytes;
  };

  // The calling thread is in that namespace afterwards.
  static int make_end(const std::string& name) {
    const int space = open(("/var/run/netns/" + name).c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_there = space >= 0 && setns(space, CLONE_NEWNET) == 0;
    close(space);
    const int end = is_there ? open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK) : -1;
    ifreq request{};
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    std::strcpy(request.ifr_name, "cable");
    if (end >= 0 && ioctl(end, TUNSETIFF, &request) != 0) {
      close(end);
      return -1;
    }
    return end;
  }

  void carry(const std::string& one, const std::string& other) {
    const std::array<int, 2> ends = {make_end(one), make_end(other)};
    state_ = ends[0] >= 0 && ends[1] >= 0 ? State::kMade : State::kImpossible;
    std::array<std::deque<Packet>, 2> under_way;  // to each end
    std::minstd_rand chance(1);
    std::bernoulli_distribution is_lost(loss_);
    std::array<char, 65536> bytes{};
    while (!is_over_ && state_ == State::kMade) {
      std::array<pollfd, 2> ready{{{ends[0], POLLIN, 0}, {ends[1], POLLIN, 0}}};
      const bool is_idle = under_way[0].empty() && under_way[1].empty();
      poll(ready.data(), ready.size(), is_idle ? 100 : 1);
      for (std::size_t from = 0; from < 2; ++from) {
        for (ssize_t size = 0; (size = read(ends[from], bytes.data(), bytes.size())) > 0;) {
          if (is_lost(chance)) {
            ++lost_;
          } else {
            under_way[1 - from].push_back({Clock::now() + delay_, {bytes.data(), bytes.data() + size}});
          }
        }
      }
      for (std::size_t to = 0; to < 2; ++to) {
        for (auto& queue = under_way[to]; !queue.empty() && queue.front().due <= Clock::now();
             queue.pop_front()) {
          const auto& packet = queue.front().bytes;
          latest_ms_ =
              std::max(latest_ms_.load(),
                       std::chrono::duration<double, std::milli>(Clock::now() - queue.front().due).count());
          carried_ += write(ends[to], packet.data(), packet.size()) > 0 ? 1 : 0;
        }
      }
    }
    for (const int end : ends) {
      close(end);
    }
  }

  const std::chrono::milliseconds delay_;
  const double loss_;
  std::atomic<State> state_{State::kMaking};
  std::atomic<bool> is_over_{false};
  std::atomic<int> carried_{0};
  std::atomic<int> lost_{0};
  std::atomic<double> latest_ms_{0};
  std::thread thread_;
};

}  // namespace nido::testing
