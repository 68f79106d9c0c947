#pragma once

#include <string>

namespace nido {

// The page: HTML with its style and script inside. `nonce` allows these two, and nothing else, to the
// browser; `token` is what orders must carry.
std::string page_with(const std::string& nonce, const std::string& token);

// 128 random bits of the kernel, in hexadecimal digits.
std::string random_word();

// Are both the same, in a time that does not tell how much of them is.
bool same_secret(const std::string& one, const std::string& other);

}  // namespace nido
