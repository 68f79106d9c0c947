#include "yarp_line.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <utility>

#include "nido/yarp/names.h"

namespace nido::bench {
namespace {

int connect_to(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
  const timeval patience{2, 0};
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  close(fd);
  return -1;
}

std::int32_t int32_at(std::string_view bytes, std::size_t at) {
  std::int32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace

YarpLine::YarpLine(YarpLine&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), buffer_(std::move(other.buffer_)), used_(other.used_) {}

YarpLine::~YarpLine() {
  if (fd_ >= 0) close(fd_);
}

bool YarpLine::send(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

// so many bytes behind those that are used
bool YarpLine::fill(std::size_t bytes) {
  if (used_ > 0 && used_ == buffer_.size()) {
    buffer_.clear();
    used_ = 0;
  }
  std::size_t there = buffer_.size();
  if (used_ + bytes > there) buffer_.resize(used_ + bytes);
  while (there < used_ + bytes) {
    const ssize_t count = recv(fd_, buffer_.data() + there, buffer_.size() - there, 0);
    if (count <= 0) return false;
    there += static_cast<std::size_t>(count);
  }
  return true;
}

Result<YarpLine> YarpLine::open(int names_port, const std::string& port, yarp::Carrier carrier) {
  const auto nobody = [&](const char* why) { return Error{ErrorCode::kNotFound, port + ": " + why}; };
  YarpLine names(connect_to(names_port));
  if (names.fd_ < 0 || !names.send("NAME_SERVER query " + port + "\n")) return nobody("no name server");
  std::string line;
  while (names.fill(1) && names.buffer_[names.used_] != '\n') line += names.buffer_[names.used_++];
  const std::optional<yarp::Contact> contact = yarp::contact_from_line(line);
  if (!contact) return nobody("nobody has this name");
  YarpLine out(connect_to(contact->port));
  if (out.fd_ < 0 || !out.send(yarp::greeting(carrier, "/nido-bench")) || !out.fill(8)) {
    return nobody("no welcome");
  }
  out.used_ += 8;
  return out;
}

bool YarpLine::ask(std::string_view framed) {
  if (!send(framed)) return false;
  // the reply ends with the acknowledgement
  const std::string ack = yarp::yarp_number(0);
  char bytes[4096];
  std::string reply;
  while (!reply.ends_with(ack)) {
    const ssize_t count = recv(fd_, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    reply.append(bytes, static_cast<std::size_t>(count));
  }
  return reply.size() > ack.size();
}

bool YarpLine::reverse() {
  std::string command = yarp::message(yarp::Carrier::kFastTcp, {}, {}, true);
  command[command.size() - 3] = 'r';  // in the place of 'd'
  return send(command);
}

std::size_t YarpLine::take() {
  constexpr std::size_t kIndexBytes = 18;
  if (!fill(kIndexBytes)) return 0;
  const std::size_t blocks = static_cast<unsigned char>(buffer_[used_ + 8]);
  const std::size_t outputs = static_cast<unsigned char>(buffer_[used_ + 9]);
  used_ += kIndexBytes;
  if (!fill(4 * (blocks + outputs))) return 0;
  std::size_t total = 0;
  for (std::size_t i = 0; i < blocks; ++i) {
    total += static_cast<std::size_t>(int32_at(buffer_, used_ + 4 * i));
  }
  used_ += 4 * (blocks + outputs);
  if (!fill(total)) return 0;
  used_ += total;
  return total;
}

}  // namespace nido::bench
