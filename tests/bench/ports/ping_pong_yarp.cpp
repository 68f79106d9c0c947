// Round trips by YARP's own ports: a message that is answered on its connection. Where YARP is installed.
#include "ping_pong.h"

#ifdef NIDO_WITH_YARP
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <yarp/os/Carrier.h>
#include <yarp/os/Carriers.h>
#include <yarp/os/ConnectionReader.h>
#include <yarp/os/ConnectionWriter.h>
#include <yarp/os/Network.h>
#include <yarp/os/Port.h>
#include <yarp/os/PortReader.h>
#include <yarp/os/Portable.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "child.h"
#include "free_port.h"

namespace nido::bench {

namespace {

// of the answering side's port, which is known by its number
std::string name_of(int number) { return "/nido_bench/" + std::to_string(number); }

// 64 bytes as they are: nothing to take apart.
class Message final : public yarp::os::Portable {
 public:
  bool read(yarp::os::ConnectionReader& reader) override {
    return reader.expectBlock(bytes_.data(), bytes_.size());
  }
  bool write(yarp::os::ConnectionWriter& writer) const override {
    writer.appendBlock(bytes_.data(), bytes_.size());
    return true;
  }

 private:
  std::array<char, kMessage_bytes> bytes_{};
};

// Names are known to this process alone: no name server is needed, and none is asked.
class Yarp {
 public:
  Yarp() { yarp::os::Network::setLocalMode(true); }

 private:
  yarp::os::Network network_;
};

class Reader final : public yarp::os::PortReader {
 public:
  bool read(yarp::os::ConnectionReader& reader) override {
    if (!message_.read(reader)) return false;
    yarp::os::ConnectionWriter* writer = reader.getWriter();
    return writer == nullptr || message_.write(*writer);
  }

 private:
  Message message_;
};

yarp::os::Contact contact_of(int number) { return {name_of(number), "tcp", "127.0.0.1", number}; }

bool is_there(int number) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(number));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool connected = ::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return connected;
}

class Asker final : public PingPong {
 public:
  Asker(std::shared_ptr<Yarp> yarp, std::string carrier, int number)
      : yarp_(std::move(yarp)), carrier_(std::move(carrier)), number_(number) {}
  [[nodiscard]] bool has_carrier() const {
    const std::unique_ptr<yarp::os::Carrier> found(yarp::os::Carriers::chooseCarrier(carrier_));
    return found != nullptr;
  }
  std::string address() const override { return std::to_string(number_); }
  Status connect() override {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    if (!port_.open(name_of(number_) + "/asking")) return Error{ErrorCode::kFailed, "YARP opens no port"};
    // YARP tries a place once, and then no more
    while (!is_there(number_)) {
      if (std::chrono::steady_clock::now() > until) {
        return Error{ErrorCode::kTimeout, "the answering process did not appear"};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    yarp::os::Network::registerContact(contact_of(number_));
    if (!yarp::os::Network::connect(port_.getName(), name_of(number_), carrier_)) {
      return Error{ErrorCode::kFailed, "YARP connects no ports over " + carrier_};
    }
    return {};
  }
  bool round_trip() override { return port_.write(message_, message_); }

 private:
  const std::shared_ptr<Yarp> yarp_;
  const std::string carrier_;
  const int number_;
  yarp::os::Port port_;
  Message message_;
};

Status answer(int /*domain*/, const std::string& address) {
  const Yarp yarp;
  Reader reader;
  yarp::os::Port port;
  port.setReader(reader);
  if (!port.open(contact_of(std::stoi(address)))) {
    return Error{ErrorCode::kFailed, "YARP cannot listen on 127.0.0.1:" + address};
  }
  while (hear_parent()) {
  }
  return {};
}

}  // namespace

std::vector<PingPongKind> yarp_carriers() {
  // one for all, since each begins to count the places of ports anew
  const auto shared = std::make_shared<std::weak_ptr<Yarp>>();
  std::vector<PingPongKind> kinds;
  for (const char* carrier : {"unix_stream", "tcp"}) {
    const auto ask = [shared, carrier](int /*domain*/) -> Result<std::unique_ptr<PingPong>> {
      if (carrier == std::string("unix_stream") && std::getenv("XDG_RUNTIME_DIR") == nullptr) {
        return Error{ErrorCode::kUnsupported, "YARP's unix_stream needs the variable XDG_RUNTIME_DIR"};
      }
      std::shared_ptr<Yarp> yarp = shared->lock();
      if (yarp == nullptr) *shared = yarp = std::make_shared<Yarp>();
      auto asker = std::make_unique<Asker>(yarp, carrier, free_tcp_port());
      if (asker->has_carrier()) return std::unique_ptr<PingPong>(std::move(asker));
      return Error{ErrorCode::kUnsupported, std::string("this YARP has no carrier ") + carrier};
    };
    kinds.push_back({std::string("YARP over ") + carrier, "rtt", "", ask, answer});
  }
  return kinds;
}

}  // namespace nido::bench

#else

namespace nido::bench {

std::vector<PingPongKind> yarp_carriers() {
  return {{"YARP over unix_stream", "rtt", "not built in: YARP was not there", {}, {}}};
}

}  // namespace nido::bench

#endif
