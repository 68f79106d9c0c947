#pragma once

// For nodes that open many ports: each into its place, with the failure of the first that cannot be opened.
// Heavy, as typed_port.h: for .cpp files that open ports.

#include <memory>
#include <string>
#include <utility>

#include "nido/middleware/typed_port.h"

namespace nido {

// What Node::open_input and Node::open_output do, into `port`; it stays as it is when that fails.
template <class T>
Status open_into(Node& node, std::unique_ptr<Input<T>>& port, const std::string& name, Profile profile,
                 std::size_t depth = 16) {
  auto opened = node.open_input<T>(name, profile, depth);
  if (!opened) return opened.error();
  port = std::move(*opened);
  return {};
}

template <class T>
Status open_into(Node& node, std::unique_ptr<Output<T>>& port, const std::string& name, Profile profile,
                 std::size_t depth = 16) {
  auto opened = node.open_output<T>(name, profile, depth);
  if (!opened) return opened.error();
  port = std::move(*opened);
  return {};
}

}  // namespace nido
