#include "name_lock.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

namespace nido {

namespace {

struct Address {
  sockaddr_un value{};
  socklen_t length = 0;
};

Address address_of(int domain, const std::string& what, const std::string& name) {
  std::string text = "nido/" + std::to_string(domain) + "/" + what + name;
  Address address;
  constexpr std::size_t kRoom = sizeof(address.value.sun_path) - 1;
  if (text.size() > kRoom) {
    // a long name keeps its beginning, for people who look at /proc/net/unix, and ends in its hash (FNV-1a)
    std::uint64_t hash = 14695981039346656037ULL;
    for (const char c : text) {
      hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    }
    char tail[20];
    std::snprintf(tail, sizeof tail, "#%016llx", static_cast<unsigned long long>(hash));
    text = text.substr(0, kRoom - 17) + tail;
  }
  address.value.sun_family = AF_UNIX;
  std::memcpy(address.value.sun_path + 1, text.data(), text.size());
  address.length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
  return address;
}

// the process that listens at an address; pid 0: somebody who does not tell; -1: nobody
int owner_pid(const Address& address) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) {
    return 0;
  }
  int pid = 0;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address.value), address.length) == 0) {
    ucred credentials{};
    socklen_t size = sizeof credentials;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) == 0) {
      pid = credentials.pid;
    }
  } else if (errno == ECONNREFUSED) {
    pid = -1;
  }
  close(fd);
  return pid;
}

std::string program_of(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/comm");
  std::string name;
  std::getline(file, name);
  return name.empty() ? "a program" : name;
}

}  // namespace

Result<std::unique_ptr<NameLock>> NameLock::take(int domain, const std::string& what,
                                                 const std::string& name) {
  const Address address = address_of(domain, what, name);
  // a second try, for an owner that ends between our bind and our question
  for (int attempt = 0; attempt < 2; ++attempt) {
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) {
      return Error{ErrorCode::kFailed, "cannot make a socket for the name of " + what + " " + name + ": " +
                                           std::generic_category().message(errno)};
    }
    if (bind(fd, reinterpret_cast<const sockaddr*>(&address.value), address.length) == 0 &&
        listen(fd, 64) == 0) {
      return std::unique_ptr<NameLock>(new NameLock(fd));
    }
    const int bind_error = errno;
    close(fd);
    if (bind_error != EADDRINUSE) {
      return Error{ErrorCode::kFailed,
                   "cannot own " + what + " " + name + ": " + std::generic_category().message(bind_error)};
    }
    const int pid = owner_pid(address);
    if (pid >= 0 || attempt == 1) {
      const std::string owner = pid > 0 ? "process " + std::to_string(pid) + " (" + program_of(pid) + ")"
                                        : std::string("another process");
      return Error{ErrorCode::kTaken, what + " " + name + " has an owner already: " + owner + " on host " +
                                          host_name() + ", DDS domain " + std::to_string(domain) +
                                          "; stop that one, or choose another name or domain"};
    }
  }
  return Error{ErrorCode::kTaken, what + " " + name + " has an owner already"};
}

bool NameLock::is_owned(int domain, const std::string& what, const std::string& name) {
  return owner_pid(address_of(domain, what, name)) >= 0;
}

NameLock::~NameLock() { close(fd_); }

void NameLock::drain() const {
  for (int peer = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC); peer >= 0;
       peer = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC)) {
    close(peer);
  }
}

std::string host_name() {
  char name[256] = "";
  return gethostname(name, sizeof name - 1) == 0 && name[0] != '\0' ? name : "localhost";
}

}  // namespace nido
