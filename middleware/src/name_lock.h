#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/result.h"

namespace nido {

// Ownership of a name on this machine: a listening socket in the abstract namespace, which leaves no file and
// vanishes with its process however that ends. Its file descriptor must be drained (drain) now and then, as
// others connect to it to learn who the owner is.
class NameLock {
 public:
  // `what` is the word for messages: "port" or "node". kTaken names the owner's process, program and host.
  static Result<std::unique_ptr<NameLock>> take(int domain, const std::string& what, const std::string& name);
  // True if some living process owns the name.
  static bool is_owned(int domain, const std::string& what, const std::string& name);

  ~NameLock();
  NameLock(const NameLock&) = delete;
  NameLock& operator=(const NameLock&) = delete;

  // Takes in and drops the connections of those who asked.
  void drain() const;

 private:
  explicit NameLock(int fd) : fd_(fd) {}
  int fd_;
};

// This computer's name.
std::string host_name();

}  // namespace nido
