#include "page.h"

#include <sys/random.h>

#include <array>
#include <cstdlib>
#include <string_view>

namespace nido {
namespace {

constexpr const char* kPieces[] = {
#include "page_text.inc"
};

void replace_all(std::string& text, std::string_view what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
}

}  // namespace

std::string page_with(const std::string& nonce, const std::string& token) {
  std::string page;
  for (const char* piece : kPieces) page += piece;
  replace_all(page, "@NONCE@", nonce);
  replace_all(page, "@TOKEN@", token);
  return page;
}

std::string random_word() {
  std::array<unsigned char, 16> bytes{};
  // of this size it is never cut short
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) std::abort();
  std::string word;
  for (const unsigned char byte : bytes) {
    word += "0123456789abcdef"[byte >> 4U];
    word += "0123456789abcdef"[byte & 15U];
  }
  return word;
}

bool same_secret(const std::string& one, const std::string& other) {
  unsigned difference = one.size() == other.size() ? 0 : 1;
  for (std::size_t i = 0; i < one.size(); ++i) {
    difference |=
        static_cast<unsigned char>(one[i]) ^ static_cast<unsigned char>(i < other.size() ? other[i] : '\0');
  }
  return difference == 0;
}

}  // namespace nido
