#pragma once

// The definitions of Node::open_output and Node::open_input. Include it in the .cpp files that open ports,
// not in headers: it brings the types' DDS support with it.

#include <utility>

#include "nido/middleware/node.h"
#include "nido/msgs/type_support.h"

namespace nido {

// What carries messages of type T.
template <class T>
MessageType message_type_of() {
  using Support = typename msgs::TypeSupportOf<T>::type;
  MessageType type;
  type.dds_name = Support().getName();
  type.make_message = [] { return std::static_pointer_cast<void>(std::make_shared<T>()); };
  type.make_support = [] { return static_cast<eprosima::fastdds::dds::TopicDataType*>(new Support()); };
  if constexpr (requires { msgs::TypeSupportOf<T>::idl; }) type.idl = msgs::TypeSupportOf<T>::idl;
  return type;
}

namespace detail {

template <class T>
class TypedOutput final : public Output<T> {
 public:
  explicit TypedOutput(std::unique_ptr<RawOutput> raw) : raw_(std::move(raw)) {}
  Status write(const T& message) override { return raw_->write(&message); }
  [[nodiscard]] std::size_t reader_count() const override { return raw_->reader_count(); }
  bool wait_for_readers(std::size_t count, double timeout_s) override {
    return raw_->wait_for_readers(count, timeout_s);
  }
  [[nodiscard]] const std::string& name() const override { return raw_->name(); }

 private:
  std::unique_ptr<RawOutput> raw_;
};

template <class T>
class TypedInput final : public Input<T> {
 public:
  explicit TypedInput(std::unique_ptr<RawInput> raw) : raw_(std::move(raw)) {}
  std::optional<T> take() override { return unpack(raw_->take()); }
  std::optional<T> take_latest() override { return unpack(raw_->take_latest()); }
  std::optional<Received<T>> take_received() override {
    auto received = raw_->take();
    if (!received) {
      return std::nullopt;
    }
    return Received<T>{std::move(*static_cast<T*>(received->message.get())), std::move(received->source),
                       received->source_time, received->sequence};
  }
  bool wait_for_message(double timeout_s) override { return raw_->wait_for_message(timeout_s); }
  bool wait_for_sources(std::size_t count, double timeout_s) override {
    return raw_->wait_for_sources(count, timeout_s);
  }
  Status connect(const std::string& output_name) override { return raw_->connect(output_name); }
  Status disconnect(const std::string& output_name) override { return raw_->disconnect(output_name); }
  [[nodiscard]] std::vector<ConnectionCounters> connections() const override { return raw_->connections(); }
  [[nodiscard]] const std::string& name() const override { return raw_->name(); }

 private:
  static std::optional<T> unpack(std::optional<RawReceived> received) {
    if (!received) {
      return std::nullopt;
    }
    return std::move(*static_cast<T*>(received->message.get()));
  }
  std::unique_ptr<RawInput> raw_;
};

}  // namespace detail

template <class T>
Result<std::unique_ptr<Output<T>>> Node::open_output(const std::string& port_name, Profile profile,
                                                     std::size_t depth) {
  auto raw = open_raw_output(port_name, message_type_of<T>(), profile, depth);
  if (!raw) {
    return raw.error();
  }
  return std::unique_ptr<Output<T>>(std::make_unique<detail::TypedOutput<T>>(std::move(raw).value()));
}

template <class T>
Result<std::unique_ptr<Input<T>>> Node::open_input(const std::string& port_name, Profile profile,
                                                   std::size_t depth) {
  auto raw = open_raw_input(port_name, message_type_of<T>(), profile, depth);
  if (!raw) {
    return raw.error();
  }
  return std::unique_ptr<Input<T>>(std::make_unique<detail::TypedInput<T>>(std::move(raw).value()));
}

}  // namespace nido
