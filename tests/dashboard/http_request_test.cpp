#include "nido/dashboard/http_request.h"

#include <gtest/gtest.h>

#include <random>

namespace nido {
namespace {

constexpr const char* kGood =
    "POST /ask?a=1&b=x%2Fy+z HTTP/1.1\r\nHost: localhost:8080\r\nX-Some:  word \r\nContent-Length: "
    "4\r\n\r\nbody";

TEST(HttpRequest, IsTakenWholeAndBitByBit) {
  for (const std::size_t step : {1000U, 1U, 7U}) {
    HttpParser parser;
    std::optional<HttpRequest> request;
    const std::string bytes = kGood;
    for (std::size_t at = 0; at < bytes.size(); at += step) {
      EXPECT_FALSE(request);
      parser.add(bytes.substr(at, step));
      request = parser.next();
    }
    ASSERT_TRUE(request);
    EXPECT_EQ(request->method, "POST");
    EXPECT_EQ(request->path, "/ask");
    EXPECT_EQ(request->query.at("b"), "x/y z");
    EXPECT_EQ(request->headers.at("x-some"), "word");
    EXPECT_EQ(request->body, "body");
    EXPECT_TRUE(request->keep_alive);
    EXPECT_FALSE(parser.begun());
  }
}

TEST(HttpRequest, TwoInOnePieceAreTakenOneAfterAnother) {
  HttpParser parser;
  parser.add(std::string(kGood) + "GET / HTTP/1.0\r\nHost: x\r\n\r\n");
  EXPECT_EQ(parser.next()->path, "/ask");
  const auto second = parser.next();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->path, "/");
  EXPECT_FALSE(second->keep_alive);
}

TEST(HttpRequest, WhatIsMalformedIsRefused) {
  const std::string host = "Host: a\r\n";
  const std::pair<std::string, int> cases[] = {
      {"hello\r\n\r\n", 400},
      {"GET  / HTTP/1.1\r\n\r\n", 400},
      {"GET / HTTP/2.0\r\n\r\n", 505},
      {"GET http://evil/ HTTP/1.1\r\n\r\n", 400},
      {"GET /\x01 HTTP/1.1\r\n\r\n", 400},
      {"GET /?a=%g1 HTTP/1.1\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\nno colon\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\n folded: x\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\nX: a\x01\r\n\r\n", 400},
      {"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 501},
      {"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400},
      {"POST / HTTP/1.1\r\nContent-Length: 1 2\r\n\r\n", 400},
      {"POST / HTTP/1.1\r\nContent-Length: 99999999999999999999999\r\n\r\n", 400},
      {"POST / HTTP/1.1\r\nContent-Length: 8193\r\n\r\n", 413},
      {"GET /" + std::string(9000, 'a'), 431},
      {std::string("\x16\x03\x01\x02\x00", 5), 400},  // a browser that tries https
  };
  for (const auto& [bytes, status] : cases) {
    HttpParser parser;
    parser.add(bytes);
    EXPECT_FALSE(parser.next()) << bytes;
    ASSERT_TRUE(parser.refusal()) << bytes;
    EXPECT_EQ(parser.refusal()->status, status) << bytes << ": " << parser.refusal()->sentence;
  }
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 65; ++i) many += "H" + std::to_string(i) + ": x\r\n";
  HttpParser parser;
  parser.add(many + "\r\n");
  EXPECT_FALSE(parser.next());
  ASSERT_TRUE(parser.refusal());
  EXPECT_EQ(parser.refusal()->status, 431);
}

TEST(HttpRequest, MutatedRequestsNeverBreakIt) {
  std::mt19937 random(1);
  const std::string bytes = std::string(kGood) + kGood;
  int taken = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string mutated = bytes;
    for (std::uint32_t i = 0; i <= random() % 4; ++i) {
      mutated[random() % mutated.size()] = static_cast<char>(random() % 256);
    }
    if (random() % 3 == 0) mutated.resize(random() % mutated.size());
    HttpParser parser;
    for (std::size_t at = 0; at < mutated.size();) {
      const std::size_t step = 1 + random() % 60;
      parser.add(std::string_view(mutated).substr(at, step));
      at += step;
      while (parser.next()) ++taken;
    }
    EXPECT_LE(parser.kept_bytes(), mutated.size());
  }
  EXPECT_GT(taken, 1000);
}

}  // namespace
}  // namespace nido
