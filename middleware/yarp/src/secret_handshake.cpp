#include "nido/yarp/secret_handshake.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <sys/stat.h>

#include <fstream>
#include <sstream>

namespace nido::yarp {
namespace {

constexpr std::size_t kNonceBytes = 8;
constexpr std::size_t kCodeBytes = 32;
constexpr std::size_t kShortestSecret = 8;

}  // namespace

std::string SecretHandshake::code() const {
  std::string out(kCodeBytes, '\0');
  unsigned int size = 0;
  HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
       reinterpret_cast<const unsigned char*>(nonces_.data()), nonces_.size(),
       reinterpret_cast<unsigned char*>(out.data()), &size);
  return out;
}

std::string SecretHandshake::proof() {
  std::string nonce(kNonceBytes, '\0');
  RAND_bytes(reinterpret_cast<unsigned char*>(nonce.data()), static_cast<int>(nonce.size()));
  nonces_ += nonce;
  return nonce + code();
}

std::string SecretHandshake::begin() { return end_ == End::kAccepts ? proof() : std::string(); }

Status SecretHandshake::feed(std::string& bytes, std::string& out) {
  while (!done_ && bytes.size() >= kNonceBytes + kCodeBytes) {
    nonces_ += bytes.substr(0, kNonceBytes);
    const std::string wanted = code();
    if (CRYPTO_memcmp(wanted.data(), bytes.data() + kNonceBytes, kCodeBytes) != 0) {
      return Error{ErrorCode::kFailed, "the far end does not know the secret"};
    }
    bytes.erase(0, kNonceBytes + kCodeBytes);
    // the third message is the accepting end's, and the last one
    const bool last = nonces_.size() == 3 * kNonceBytes;
    if (!last) out += proof();
    done_ = last || end_ == End::kAccepts;
  }
  return {};
}

Result<std::string> read_secret(const std::string& path) {
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: {}", path, what)};
  };
  struct stat file {};
  std::ifstream in(path);
  if (!in || stat(path.c_str(), &file) != 0) return wrong("this file cannot be read");
  if ((file.st_mode & 077) != 0) return wrong("others may read this secret: chmod 600");
  bool in_group = false;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    std::string secret;
    words >> word >> secret;
    if (word.starts_with('[')) in_group = word == "[AUTH]";
    if (!in_group || word != "key") continue;
    if (secret.size() < kShortestSecret) return wrong("a secret of 8 characters or more is expected");
    return secret;
  }
  return wrong("[AUTH] and below it 'key SECRET' are expected");
}

}  // namespace nido::yarp
