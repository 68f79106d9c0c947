#pragma once

// What strangers may send to a port that listens, whatever it is: some 60 kinds of nonsense.

#include <cstdint>
#include <string>
#include <vector>

#include "nido/yarp/stream.h"

namespace nido::yarp::test {

using namespace std::string_literals;

inline std::string int32(std::int32_t value) {
  std::string out;
  for (int i = 0; i < 4; ++i) out += static_cast<char>(static_cast<std::uint32_t>(value) >> (8 * i));
  return out;
}

inline std::string repeated(const std::string& piece, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += piece;
  return out;
}

inline std::string image(std::int32_t width, std::int32_t height, const std::string& code) {
  return int32(256) + int32(4) + int32(9) + "mat\0"s + int32(9) + code + int32(257) + int32(5) + int32(3) +
         int32(64) + int32(8) + int32(width) + int32(height) + int32(12) + int32(64) + std::string(64, 'x');
}

struct Attack {
  const char* what;
  std::string bytes;
};

inline constexpr std::int32_t kHuge = 0x7fffffff;

// objects that lie about themselves, in a message of their own
inline std::vector<Attack> objects() {
  return {{"string of -1 bytes", int32(256 + 4) + int32(1) + int32(-1)},
          {"blob of -5 bytes", int32(256 + 12) + int32(1) + int32(-5)},
          {"string of 2 GB", int32(256 + 4) + int32(1) + int32(kHuge)},
          {"list of 2^31 values", int32(256) + int32(kHuge)},
          {"list of -1 values", int32(256) + int32(-1)},
          {"unknown kind", int32(256) + int32(1) + int32(999)},
          {"lists in lists", repeated(int32(256) + int32(1), 100'000)},
          {"picture of width -640", image(-640, 480, "rgb\0"s)},
          {"picture of 65535 x 65535", image(65'535, 65'535, "rgb\0"s)},
          {"picture of unknown pixels", image(8, 8, "zzzz")},
          {"half a number", int32(256 + 10) + int32(2) + "1234567"},
          {"nothing", ""}};
}

// whole connections
inline std::vector<Attack> connections() {
  const std::string hello = greeting(Carrier::kTcp, "/stranger");
  const std::string index = "YA\x0a\0\0\0RP\x02\x01"s + std::string(8, '\xff');
  std::vector<Attack> all = {
      {"wrong magic", "YB\xe4\x1e\0\0RPxxxxxxxxxxxxxxxxxxxxxxx"s},
      {"zeros", std::string(5000, '\0')},
      {"half a header", hello.substr(0, 5)},
      {"half a message", hello + message(Carrier::kTcp, "abc", {}, true).substr(0, 20)},
      {"name of 2 GB", "YA\xe4\x1e\0\0RP"s + int32(kHuge) + std::string(5000, 'x')},
      {"name of -1 bytes", "YA\xe4\x1e\0\0RP"s + int32(-1) + std::string(5000, 'x')},
      {"blocks of -1 bytes", hello + index + int32(-1) + int32(kHuge) + int32(0)},
      {"message of 2 GB", hello + index + int32(8) + int32(kHuge) + int32(0) + std::string(5000, 'x')},
      {"message that is no command", hello + index + int32(8) + int32(0) + int32(0) + "xxxxxxxx"},
      {"open brackets", "CONNECT x\r\nd\r\n" + std::string(100'000, '(') + "\r\n"},
      {"line without an end", "CONNECT x\r\nd\r\n" + std::string(4'000'000, 'x')},
      {"names without an end", "NAME_SERVER " + std::string(1'000'000, 'x')},
      {"names with quotes", "NAME_SERVER register /a'b\";drop\nNAME_SERVER register a\nNAME_SERVER list\n"},
      {"the name server's name",
       "NAME_SERVER register /root tcp 127.0.0.1 1\nNAME_SERVER unregister /root\n"},
      {"a browser", "GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n"},
      {"a browser's header", "POST / HTTP/1.1\r\n" + repeated("a: b\r\n", 10'000)}};
  for (Attack& object : objects()) {
    for (const bool wants_reply : {true, false}) {
      all.push_back({object.what, hello + message(Carrier::kTcp, object.bytes, "1 2.0", wants_reply)});
    }
    all.push_back({object.what, hello + admin_message(Carrier::kTcp, object.bytes)});
    all.push_back({object.what, "NAME_SER" + object.bytes});
  }
  return all;
}

}  // namespace nido::yarp::test
