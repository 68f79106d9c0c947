#include "launch_dashboard.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

namespace nido {
namespace {

// The port itself if it is free, a free one for 0. Its owner will ask again: this one tells early.
Result<int> free_port(int wanted) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Error{ErrorCode::kFailed, fmt::format("no socket: {}", std::strerror(errno))};
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(wanted));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* place = reinterpret_cast<sockaddr*>(&address);
  const bool is_free = bind(fd, place, size) == 0 && listen(fd, 1) == 0;
  const int why = errno;
  getsockname(fd, place, &size);
  close(fd);
  if (is_free) return static_cast<int>(ntohs(address.sin_port));
  if (why == EADDRINUSE) {
    return Error{ErrorCode::kTaken,
                 fmt::format("--dashboard: port {} of 127.0.0.1 is taken by another program; choose "
                             "another one, as in --dashboard={}, or --dashboard=0 for a free one",
                             wanted, wanted < 65'535 ? wanted + 1 : 8080)};
  }
  return Error{ErrorCode::kInvalidArgument, fmt::format("--dashboard: port {} of 127.0.0.1 cannot be had: {}",
                                                        wanted, std::strerror(why))};
}

}  // namespace

Status add_dashboard(App& app, const std::string& wanted) {
  int number = -1;
  const char* end = wanted.data() + wanted.size();
  if (const auto [rest, error] = std::from_chars(wanted.data(), end, number);
      error != std::errc() || rest != end || number < 0 || number > 65'535) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("--dashboard={} is no port: a number from 1 to 65535, or 0 for a free one", wanted)};
  }
  for (const auto& process : app.processes) {
    if (process.name != kDashboard) continue;
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("app '{}' has a process '{}' already: leave out --dashboard", app.name, kDashboard)};
  }
  const auto port = free_port(number);
  if (!port) return port.error();
  AppProcess dashboard;
  dashboard.name = kDashboard;
  dashboard.program = "nido-dashboard";
  dashboard.clock = "wall";
  dashboard.period_s = 0.1;
  dashboard.parameters["port"] = *port;
  dashboard.parameters["story"] = app.story;
  dashboard.restart.on_failure = true;
  dashboard.restart.fail_the_run = false;
  app.start_order.insert(app.start_order.begin(), app.processes.size());
  app.processes.push_back(std::move(dashboard));
  return {};
}

}  // namespace nido
