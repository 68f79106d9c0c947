#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>

#include "nido/yarp/port_host.h"

namespace nido::yarp::test {

// Ports of a YARP network of their own, on a thread of their own.
class HostThread {
 public:
  // names_port 0: one that nobody has
  explicit HostThread(PortHostOptions options = {}, int names_port = 0) {
    auto made = EventLoop::create();
    if (!made) throw std::runtime_error(made.error().message);
    loop_ = std::move(*made);
    // programs of other tests have numbers of their own
    for (int tried = 0; host_ == nullptr && tried < 20; ++tried) {
      options.names_port =
          names_port > 0 ? names_port : 20'000 + (static_cast<int>(getpid()) * 7 + tried * 501) % 20'000;
      auto host = PortHost::open(*loop_, options);
      if (host) host_ = std::move(*host);
    }
    if (host_ == nullptr) throw std::runtime_error("no port is free");
    names_port_ = options.names_port;
    thread_ = std::thread([this] { loop_->run(); });
  }
  ~HostThread() {
    loop_->stop();
    thread_.join();
  }
  PortHost& host() { return *host_; }
  int names_port() const { return names_port_; }
  // Runs something on the loop's thread and waits for it.
  template <class Work>
  auto on_loop(Work work) -> decltype(work()) {
    std::promise<decltype(work())> done;
    loop_->post([&] {
      if constexpr (std::is_void_v<decltype(work())>) {
        work();
        done.set_value();
      } else {
        done.set_value(work());
      }
    });
    return done.get_future().get();
  }
  int open(PortSpec spec) {
    return on_loop([&] {
      const std::string name = spec.name;
      const Status opened = host_->open_port(std::move(spec));
      if (!opened) throw std::runtime_error(opened.error().message);
      return host_->number_of(name);
    });
  }
  PortHost::Figures figures() {
    return on_loop([&] { return host_->figures(); });
  }

 private:
  std::unique_ptr<EventLoop> loop_;
  std::unique_ptr<PortHost> host_;
  int names_port_ = 0;
  std::thread thread_;
};

}  // namespace nido::yarp::test
