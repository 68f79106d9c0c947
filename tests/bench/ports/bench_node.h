#pragma once

#include <memory>
#include <string>

#include "nido/middleware/node.h"

namespace nido::bench {

// until the other process of a benchmark is there
constexpr double kPatience_s = 20.0;

inline Result<std::unique_ptr<Node>> make_node(const std::string& name, int domain) {
  NodeOptions options;
  options.name = name;
  options.domain = domain;
  options.handle_signals = false;
  return Node::create(std::move(options));
}

}  // namespace nido::bench
