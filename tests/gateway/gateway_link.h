#pragma once

// A server node, a gateway, and a YARP network on its other side: what stands between a device and its far
// side.

#include <gtest/gtest.h>
#include <unistd.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "nido/gateway/gateway.h"
#include "nido/yarp/devices.h"
#include "node_link.h"

namespace nido::test {

inline constexpr int kDomain = 34;

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
    wait_until([&] { return number_of(port) != 0; });
  }
  yarp::PortHost::Figures figures() {
    return on_loop([this] { return gateway_->ports().figures(); });
  }
  // TCP port on which a port listens.
  int number_of(const std::string& port) {
    return on_loop([&] { return gateway_->ports().number_of(port); });
  }

 private:
  template <class Work>
  auto on_loop(const Work& work) -> decltype(work()) {
    std::promise<decltype(work())> done;
    loop_->post([&] { done.set_value(work()); });
    return done.get_future().get();
  }
  const std::string id_ = std::to_string(getpid());
  std::unique_ptr<Node> server_ = make_test_node("server" + id_, kDomain);
  std::unique_ptr<Node> gateway_node_ = make_test_node("gateway" + id_, kDomain);
  std::unique_ptr<yarp::EventLoop> loop_;
  std::unique_ptr<gateway::Gateway> gateway_;
  int names_port_ = 0;
  std::thread sockets_;
  std::shared_ptr<yarp::Network> network_;
};

}  // namespace nido::test
