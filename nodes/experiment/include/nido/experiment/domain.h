#pragma once

#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A DDS domain that belongs to this process as long as this object lives: experiments that run at the same
// time on one computer do not meet. Move-only.
class DomainLease {
 public:
  // A free domain: no other experiment of this computer holds it and nobody listens at its discovery port.
  // kTaken when all are in use.
  static Result<DomainLease> take();
  // This one, whoever else is in it: the user says so.
  static DomainLease of(int domain) { return DomainLease(domain, -1); }
  ~DomainLease();
  DomainLease(DomainLease&& other) noexcept;
  DomainLease& operator=(DomainLease&& other) noexcept;
  DomainLease(const DomainLease&) = delete;
  DomainLease& operator=(const DomainLease&) = delete;

  [[nodiscard]] int number() const { return domain_; }

 private:
  DomainLease(int domain, int lock) : domain_(domain), lock_(lock) {}
  int domain_;
  int lock_;  // file descriptor of the locked file; -1: none
};

// What an experiment's --domain says by default.
inline constexpr int kFreeDomain = -1;

// `count` domains for apps that run side by side: free ones, or those from `first` on.
Result<std::vector<DomainLease>> take_domains(int first, int count);

}  // namespace nido
