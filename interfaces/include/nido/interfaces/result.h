#pragma once

#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace nido {

// What kind of trouble a caller can react to. The command line maps it to its exit codes (docs/cli.md).
enum class ErrorCode {
  kInvalidArgument,  // a value from outside is not allowed: exit code 2
  kNotFound,         // something needed is not there: exit code 3
  kTaken,            // a name has an owner already: exit code 2
  kTimeout,          // a peer did not answer in time: exit code 3
  kUnsupported,      // the device cannot do this
  kFailed,           // the job itself failed: exit code 1
  kInterrupted,      // stopped by the user: exit code 130
};

// A recoverable failure, with a sentence that a user can act on.
struct Error {
  ErrorCode code = ErrorCode::kFailed;
  std::string message;
};

// A value or the reason why there is none. Thread-compatible. Reading the wrong side is a bug and ends the
// process.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}  // NOLINT(google-explicit-constructor): return value;
  Result(Error error)
      : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor): return Error{...};

  [[nodiscard]] bool ok() const { return content_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return require(), std::get<0>(content_); }
  const T& value() const& { return require(), std::get<0>(content_); }
  T&& value() && { return require(), std::get<0>(std::move(content_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const { return std::get<1>(content_); }

 private:
  void require() const {
    if (!ok()) {
      std::cerr << "bug: the value of a failed Result was read: " << error().message << '\n';
      std::abort();
    }
  }
  std::variant<T, Error> content_;
};

// Success or the reason of a failure.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error)
      : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor): return Error{...};

  [[nodiscard]] bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace nido
