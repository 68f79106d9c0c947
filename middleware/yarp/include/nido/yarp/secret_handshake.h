#pragma once

#include <string>
#include <string_view>

#include "nido/interfaces/result.h"

namespace nido::yarp {

// How the two ends of a connection show each other that they know the network's secret, before anything else
// is said: YARP's way, switched on by its file auth.conf. Three messages of eight random bytes and the
// HMAC-SHA-256 of all random bytes so far. Nothing that follows is hidden from who listens on the wire.
class SecretHandshake {
 public:
  enum class End { kAccepts, kConnects };
  SecretHandshake(std::string secret, End end) : secret_(std::move(secret)), end_(end) {}

  // What the accepting end sends first; of the other end nothing.
  [[nodiscard]] std::string begin();
  // Takes what it needs from the front of `bytes`, and adds to `out` what is to be sent. kFailed when the far
  // end does not know the secret.
  Status feed(std::string& bytes, std::string& out);
  [[nodiscard]] bool is_done() const { return done_; }

 private:
  // eight new random bytes and the code of all so far
  std::string proof();
  [[nodiscard]] std::string code() const;

  std::string secret_;
  End end_;
  std::string nonces_;
  bool done_ = false;
};

// The secret in a file of YARP's form, `[AUTH]` and `key SECRET`, which nobody but its owner may read.
Result<std::string> read_secret(const std::string& path);

}  // namespace nido::yarp
