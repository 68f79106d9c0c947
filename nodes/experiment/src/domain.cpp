#include "nido/experiment/domain.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

namespace nido {
namespace {

// apps that people start by hand and nido's own tests use others
constexpr int kLowest = 44;
constexpr int kHighest = 91;

// DDSI-RTPS, 9.6.1.1: participants of a domain share the discovery port 7400 + 250 * domain; each has one of
// its own from 7410 + 250 * domain on.
bool somebody_listens(int domain) {
  for (const int offset : {7400, 7410}) {
    const int socket_file = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_file < 0) return true;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    address.sin_port = htons(static_cast<std::uint16_t>(offset + 250 * domain));
    // without SO_REUSEADDR: fails when the port is in use, shared or not
    const bool taken = bind(socket_file, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0;
    close(socket_file);
    if (taken) return true;
  }
  return false;
}

}  // namespace

Result<DomainLease> DomainLease::take() {
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(ignored);
  for (int domain = kLowest; domain <= kHighest; ++domain) {
    const std::string file = (folder / fmt::format("nido-domain-{}.lock", domain)).string();
    const int lock = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock < 0) continue;  // another user's
    if (flock(lock, LOCK_EX | LOCK_NB) == 0 && !somebody_listens(domain)) return DomainLease(domain, lock);
    close(lock);
  }
  return Error{
      ErrorCode::kTaken,
      fmt::format("no DDS domain between {} and {} is free on this computer; end something that runs "
                  "or give one with --domain",
                  kLowest, kHighest)};
}

DomainLease::~DomainLease() {
  if (lock_ >= 0) close(lock_);
}

DomainLease::DomainLease(DomainLease&& other) noexcept
    : domain_(other.domain_), lock_(std::exchange(other.lock_, -1)) {}

DomainLease& DomainLease::operator=(DomainLease&& other) noexcept {
  std::swap(domain_, other.domain_);
  std::swap(lock_, other.lock_);
  return *this;
}

Result<std::vector<DomainLease>> take_domains(int first, int count) {
  std::vector<DomainLease> domains;
  for (int i = 0; i < count; ++i) {
    if (first != kFreeDomain) {
      domains.push_back(DomainLease::of(first + i));
      continue;
    }
    auto lease = DomainLease::take();
    if (!lease) return lease.error();
    domains.push_back(std::move(*lease));
  }
  return domains;
}

}  // namespace nido
