#pragma once

#include <memory>
#include <string>

#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/wrappers/clients.h"

namespace nido {

// An input of a client, connected to a server's output. kNotFound when the output does not appear in time.
template <class T>
Result<std::unique_ptr<Input<T>>> open_connected(Node& node, const ClientOptions& options,
                                                 const std::string& suffix, Profile profile,
                                                 std::size_t depth) {
  Result<std::unique_ptr<Input<T>>> input = node.open_input<T>(options.local + suffix + ":i", profile, depth);
  if (!input) return input.error();
  const std::string source = options.remote + suffix + ":o";
  if (Status connected = (*input)->connect(source); !connected) return connected.error();
  if (!(*input)->wait_for_sources(1, options.timeout_s)) {
    return Error{ErrorCode::kNotFound, "no port " + source + " within " + std::to_string(options.timeout_s) +
                                           " s: is the robot process running in domain " +
                                           std::to_string(node.options().domain) + "?"};
  }
  return std::move(*input);
}

// Asks the owner of a server's input to take from a client's output. kNotFound when there is no such input.
Status connect_output(Node& node, const std::string& output_name, const std::string& input_name,
                      double timeout_s);

}  // namespace nido
