#include "nido/middleware/direct_port.h"

#include <typeinfo>

#include "input_port.h"
#include "output_port.h"

namespace nido {

namespace {

Error not_of_node(const std::string& name) {
  return {ErrorCode::kUnsupported, "port " + name + " was not opened by a node"};
}

// The port as what a node makes of it, else null. Both are final, so that a comparison does what takes
// dynamic_cast microseconds when it has not been called for a while.
template <class Port, class Base>
Port* of_node(Base& port) {
  return typeid(port) == typeid(Port) ? static_cast<Port*>(&port) : nullptr;
}

}  // namespace

Status hand_over(RawInput& input, RawHandler handler) {
  auto* port = of_node<InputPort>(input);
  return port == nullptr ? Status(not_of_node(input.name())) : port->set_handlers(std::move(handler), {});
}

Status hand_over_payload(RawInput& input, PayloadHandler handler) {
  auto* port = of_node<InputPort>(input);
  return port == nullptr ? Status(not_of_node(input.name())) : port->set_handlers({}, std::move(handler));
}

bool swap_latest(RawInput& input, const std::function<void(void* message)>& swap) {
  auto* port = of_node<InputPort>(input);
  if (port != nullptr) {
    return port->swap_latest(swap);
  }
  const auto received = input.take_latest();
  if (received) {
    swap(received->message.get());
  }
  return received.has_value();
}

[[gnu::hot]] Result<std::span<std::uint8_t>> loan(RawOutput& output, std::size_t bytes) {
  auto* port = of_node<OutputPort>(output);
  if (port == nullptr) {
    return not_of_node(output.name());
  }
  std::uint8_t* const place = port->loan(bytes);
  if (place == nullptr) {
    return Error{ErrorCode::kFailed, "port " + output.name() + " gets no shared memory for " +
                                         std::to_string(bytes) + " bytes; how many files may be open?"};
  }
  return std::span<std::uint8_t>(place, bytes);
}

[[gnu::hot]] Status write_loan(RawOutput& output, std::size_t bytes) {
  auto* port = of_node<OutputPort>(output);
  return port == nullptr ? Status(not_of_node(output.name())) : port->write_loan(bytes);
}

Result<std::unique_ptr<RawInput>> open_with_handler(Node& node, const std::string& port_name,
                                                    const MessageType& type, Profile profile,
                                                    const std::function<Status(RawInput&)>& set_handler) {
  auto input = node.open_raw_input(port_name, type, profile, 1);
  if (!input) {
    return input;
  }
  if (auto status = set_handler(**input); !status) {
    return status.error();
  }
  return input;
}

}  // namespace nido
