#include "nido/dashboard/http_server.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "../yarp/attacks.h"
#include "../yarp/client.h"
#include "browser.h"
#include "tool.h"

namespace nido {
namespace {

using test::Browser;

// A server with small bounds: "/hello" answers, "/late" answers from another thread, "/big" is long,
// "/events" streams.
class Server : public testing::Test {
 protected:
  void SetUp() override {
    auto loop = yarp::EventLoop::create();
    ASSERT_TRUE(loop);
    loop_ = std::move(*loop);
    HttpServerOptions options;
    options.port = 0;
    options.connections = 8;
    options.streams = 2;
    options.unsent_bytes = 1'000'000;
    options.request_s = 0.5;
    options.idle_s = 2;
    auto server =
        HttpServer::open(*loop_, options, [this](const HttpRequest& request, HttpServer::Respond respond) {
          if (request.path == "/hello")
            return respond({200, "text/plain", "hello " + request.body, {}, false});
          if (request.path == "/big")
            return respond({200, "text/plain", std::string(900'000, 'x'), {}, false});
          if (request.path == "/events")
            return respond({200, "text/event-stream", "event: first\n\n", {}, true});
          if (request.path == "/late") {
            others_.emplace_back([respond] { respond({200, "text/plain", "late", {}, false}); });
            return;
          }
          respond({404, "text/plain", "", {}, false});
        });
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
    thread_ = std::thread([this] { loop_->run(); });
  }
  void TearDown() override {
    loop_->stop();
    thread_.join();
    for (auto& other : others_) other.join();
    server_.reset();
  }
  // It still does what it is there for.
  bool serves() {
    Browser browser(server_->port());
    browser.get("/hello");
    return browser.reply().find("200 OK") != std::string::npos;
  }
  std::unique_ptr<yarp::EventLoop> loop_;
  std::unique_ptr<HttpServer> server_;
  std::thread thread_;
  std::vector<std::thread> others_;
};

TEST_F(Server, AnswersManyRequestsOnOneConnection) {
  Browser browser(server_->port());
  for (const char* path : {"/hello", "/late", "/hello", "/nothing"}) {
    browser.get(path);
    const std::string reply = browser.reply();
    EXPECT_EQ(reply.find("HTTP/1.1 "), 0U);
    EXPECT_NE(reply.find("X-Content-Type-Options: nosniff"), std::string::npos);
  }
  browser.post("/hello", "there", "");
  EXPECT_NE(browser.reply().find("hello there"), std::string::npos);
}

TEST_F(Server, ANameThatIsNotThisComputerIsRefused) {
  for (const std::string& host :
       {std::string("evil.example"), "evil.example:" + std::to_string(server_->port()),
        std::string("127.0.0.1"), std::string()}) {
    Browser browser(server_->port());
    browser.send("GET /hello HTTP/1.1\r\n" + (host.empty() ? "" : "Host: " + host + "\r\n") + "\r\n");
    EXPECT_EQ(browser.reply().find("HTTP/1.1 421"), 0U) << host;
    EXPECT_TRUE(browser.wait_for_end());
  }
  Browser browser(server_->port());
  browser.send("GET /hello HTTP/1.1\r\nHost: localhost:" + std::to_string(server_->port()) + "\r\n\r\n");
  EXPECT_NE(browser.reply().find("200 OK"), std::string::npos);
}

TEST_F(Server, WhatIsNoRequestIsAnsweredAndClosed) {
  for (const std::string& bytes :
       {std::string("nonsense\r\n\r\n"), std::string(20'000, 'a'), std::string(100, '\0')}) {
    Browser browser(server_->port());
    browser.send(bytes);
    EXPECT_TRUE(browser.wait_for_end());
    EXPECT_EQ(browser.got().find("HTTP/1.1 4"), 0U);
  }
  EXPECT_TRUE(serves());
}

// What breaks into a robot's ports does not get into this one either.
TEST_F(Server, NonsenseOfAllKindsIsNoticedByNobodyElse) {
  for (const yarp::test::Attack& attack : yarp::test::connections()) {
    yarp::test::Client stranger(server_->port());
    ASSERT_TRUE(stranger.connected()) << attack.what;
    stranger.send(attack.bytes);
    stranger.shut_down();
    const std::string answer = stranger.until_end();
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 4"))
        << attack.what << ": " << answer.substr(0, 60);
    ASSERT_TRUE(serves()) << attack.what;
  }
}

TEST_F(Server, ARequestThatDoesNotEndIsGivenUp) {
  Browser head(server_->port());
  head.send("GET /hello HTTP/1.1\r\nHost: ");
  Browser body(server_->port());
  body.send("POST /hello HTTP/1.1\r\nHost: " + body.host() + "\r\nContent-Length: 5\r\n\r\nab");
  for (Browser* browser : {&head, &body}) {
    EXPECT_TRUE(browser->wait_for_end());
    EXPECT_EQ(browser->got().find("HTTP/1.1 408"), 0U) << browser->got();
  }
}

TEST_F(Server, ASilentConnectionIsClosed) {
  Browser browser(server_->port());
  ASSERT_TRUE(browser.is_open());
  EXPECT_TRUE(browser.wait_for_end());
}

TEST_F(Server, ManySilentConnectionsShutNobodyOut) {
  std::vector<std::unique_ptr<Browser>> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(std::make_unique<Browser>(server_->port()));
  EXPECT_TRUE(serves());
}

TEST_F(Server, AStreamGetsWhatIsToldToAll) {
  Browser one(server_->port());
  Browser two(server_->port());
  one.get("/events");
  two.get("/events");
  ASSERT_TRUE(one.wait_for("event: first"));
  ASSERT_TRUE(two.wait_for("event: first"));
  EXPECT_EQ(server_->streams(), 2U);
  loop_->post([this] { server_->broadcast("event: second\n\n"); });
  EXPECT_TRUE(one.wait_for("event: second"));
  EXPECT_TRUE(two.wait_for("event: second"));
  Browser three(server_->port());
  three.get("/events");
  EXPECT_EQ(three.reply().find("HTTP/1.1 503"), 0U);
}

TEST_F(Server, AReaderThatDoesNotReadIsLetGoAndOthersGoOn) {
  Browser slow(server_->port());
  Browser good(server_->port());
  slow.get("/events");
  good.get("/events");
  ASSERT_TRUE(slow.wait_for("event: first"));
  ASSERT_TRUE(good.wait_for("event: first"));
  for (int round = 0; round < 40 && server_->streams() == 2; ++round) {
    const std::string end = "end " + std::to_string(round) + "\n\n";
    loop_->post([this, end] { server_->broadcast("data: " + std::string(400'000, 'x') + end); });
    ASSERT_TRUE(good.wait_for(end));
    good.forget();
  }
  EXPECT_TRUE(test::becomes_true([this] { return server_->streams() == 1; }));
  EXPECT_TRUE(serves());
}

TEST_F(Server, OneWhoAsksWithoutReadingIsBounded) {
  Browser greedy(server_->port());
  for (int i = 0; i < 200; ++i) greedy.get("/big");
  EXPECT_TRUE(serves());
}

TEST_F(Server, ATakenPortIsSaid) {
  HttpServerOptions options;
  options.port = server_->port();
  auto loop = yarp::EventLoop::create();
  ASSERT_TRUE(loop);
  const auto second =
      HttpServer::open(**loop, options, [](const HttpRequest&, const HttpServer::Respond&) {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kTaken);
  EXPECT_NE(second.error().message.find(std::to_string(server_->port()) + " of 127.0.0.1 is taken"),
            std::string::npos);
}

}  // namespace
}  // namespace nido
