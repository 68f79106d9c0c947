#pragma once

// Nodes of a test, and waiting for what travels between them.

#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "nido/middleware/node.h"
#include "rigs.h"

namespace nido::test {

inline constexpr double kPatience_s = 20;

// Waits, without passing the robot's time, until something that travels has arrived.
template <class Condition>
void wait_until(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error("nothing arrived");
    std::this_thread::yield();
  }
}

inline std::unique_ptr<Node> make_test_node(const std::string& name, int domain) {
  NodeOptions options;
  options.name = name;
  options.domain = domain;
  options.handle_signals = false;
  return required(Node::create(options));
}

}  // namespace nido::test
