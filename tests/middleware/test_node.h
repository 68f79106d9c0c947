#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <memory>
#include <string>

#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"

namespace nido::testing {

// A domain that no other test program of this machine uses at the same time: it is who has a name in Linux's
// abstract namespace, which the kernel takes back with the process.
inline int own_domain() {
  static const int domain = [] {
    constexpr int kFirst = 100;
    constexpr int kCount = 120;
    for (int i = 0; i < kCount; ++i) {
      const int candidate = kFirst + (getpid() + i) % kCount;
      const std::string name = "nido-test-domain/" + std::to_string(candidate);
      sockaddr_un address{};
      address.sun_family = AF_UNIX;
      std::memcpy(address.sun_path + 1, name.data(), name.size());
      const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
      const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&address), length) == 0) {
        return candidate;  // and the socket stays open
      }
      close(fd);
    }
    ADD_FAILURE() << "all domains of tests are taken";
    return kFirst;
  }();
  return domain;
}

// Long enough for a loaded machine; conditions end the wait as soon as they hold.
constexpr double kPatience_s = 20.0;

inline NodeOptions options_of(const std::string& name) {
  NodeOptions options;
  options.name = name;
  options.domain = own_domain();
  options.handle_signals = false;
  return options;
}

inline std::unique_ptr<Node> make_node(NodeOptions options) {
  auto node = Node::create(std::move(options));
  EXPECT_TRUE(node.ok()) << node.error().message;
  return node ? std::move(node).value() : nullptr;
}
inline std::unique_ptr<Node> make_node(const std::string& name) { return make_node(options_of(name)); }

template <class T>
std::unique_ptr<Output<T>> make_output(Node& node, const std::string& name, Profile profile,
                                       std::size_t depth = 16) {
  auto port = node.open_output<T>(name, profile, depth);
  EXPECT_TRUE(port.ok()) << port.error().message;
  return port ? std::move(port).value() : nullptr;
}
template <class T>
std::unique_ptr<Input<T>> make_input(Node& node, const std::string& name, Profile profile,
                                     std::size_t depth = 16) {
  auto port = node.open_input<T>(name, profile, depth);
  EXPECT_TRUE(port.ok()) << port.error().message;
  return port ? std::move(port).value() : nullptr;
}

inline msgs::String text(const std::string& value) {
  msgs::String message;
  message.data(value);
  return message;
}

}  // namespace nido::testing
