#pragma once

// A server node, a gateway, and a YARP network on its other side: what stands between a device and its far
// side.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "nido/gateway/gateway.h"
#include "nido/yarp/devices.h"
#include "rigs.h"

namespace nido::test {

inline constexpr int kDomain = 34;
inline constexpr double kPatience_s = 20;

class GatewayLink {
 public:
  GatewayLink() {
    loop_ = required(yarp::EventLoop::create());
    gateway::GatewayOptions options;
    options.register_if_taken = false;
    Error why;
    // programs of other tests have numbers of their own
    for (int tried = 0; gateway_ == nullptr && tried < 20; ++tried) {
      options.ports.names_port = 41'000 + (static_cast<int>(getpid()) * 11 + tried * 503) % 20'000;
      auto gateway = gateway::Gateway::open(*gateway_node_, *loop_, options);
      if (gateway) {
        gateway_ = std::move(*gateway);
      } else {
        why = gateway.error();
      }
    }
    if (gateway_ == nullptr) throw std::runtime_error(why.message);
    names_port_ = options.ports.names_port;
    sockets_ = std::thread([this] { loop_->run(); });
  }
  ~GatewayLink() {
    network_.reset();
    loop_->stop();
    sockets_.join();
  }

  Node& server() { return *server_; }
  int names_port() const { return names_port_; }
  std::string stem(const std::string& what) const { return "/t" + id_ + "/" + what; }
  yarp::RemoteDevice remote(const std::string& what) const {
    yarp::RemoteDevice device;
    device.remote = stem(what);
    device.local = "/" + id_ + "/" + what;
    device.stamps = yarp::StampMode::kRemote;
    return device;
  }
  std::shared_ptr<yarp::Network> network() {
    if (!network_) {
      yarp::NetworkOptions options;
      options.names_port = names_port_;
      options.timeout_s = kPatience_s;
      network_ = required(yarp::Network::open(options));
    }
    return network_;
  }
  // Waits until the gateway shows a port.
  void wait_for(const std::string& port) {
    wait_until([&] {
      std::promise<bool> there;
      loop_->post([&] { there.set_value(gateway_->ports().has_port(port)); });
      return there.get_future().get();
    });
  }
  template <class Condition>
  static void wait_until(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) throw std::runtime_error("nothing arrived");
      std::this_thread::yield();
    }
  }

 private:
  static std::unique_ptr<Node> make(const std::string& name) {
    NodeOptions options;
    options.name = name;
    options.domain = kDomain;
    options.handle_signals = false;
    return required(Node::create(options));
  }
  const std::string id_ = std::to_string(getpid());
  std::unique_ptr<Node> server_ = make("server" + id_);
  std::unique_ptr<Node> gateway_node_ = make("gateway" + id_);
  std::unique_ptr<yarp::EventLoop> loop_;
  std::unique_ptr<gateway::Gateway> gateway_;
  int names_port_ = 0;
  std::thread sockets_;
  std::shared_ptr<yarp::Network> network_;
};

}  // namespace nido::test
