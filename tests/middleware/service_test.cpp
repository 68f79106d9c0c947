#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "test_node.h"

namespace nido::testing {

namespace {

// A flag to wait for.
class ChangeOnce {
 public:
  void set() { promise_.set_value(); }
  void wait() { promise_.get_future().wait(); }

 private:
  std::promise<void> promise_;
};

TEST(Service, AnswersAndNamesWhatIsMissing) {
  auto server = make_node("server");
  auto client = make_node("client");
  auto service =
      server->open_service("/server/rpc:i", [](const std::string& line) { return "you said " + line; });
  ASSERT_TRUE(service.ok());
  for (int i = 0; i < 20; ++i) {
    const auto answer = client->call("/server/rpc:i", std::to_string(i), kPatience_s);
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(*answer, "you said " + std::to_string(i));
  }
  const auto missing = client->call("/nobody/rpc:i", "hello", 0.2);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("/nobody/rpc:i"), std::string::npos);
}

TEST(Service, ASlowOneIsATimeoutAndStaysUsable) {
  auto server = make_node("server");
  auto client = make_node("client");
  ChangeOnce released;
  auto service = server->open_service("/server/slow:i", [&](const std::string& line) {
    if (line == "slow") {
      released.wait();
    }
    return line;
  });
  ASSERT_TRUE(service.ok());
  ASSERT_EQ(*client->call("/server/slow:i", "quick", kPatience_s), "quick");
  const auto slow = client->call("/server/slow:i", "slow", 0.1);
  ASSERT_FALSE(slow.ok());
  EXPECT_EQ(slow.error().code, ErrorCode::kTimeout);
  EXPECT_NE(slow.error().message.find("/server/slow:i"), std::string::npos);
  released.set();
  EXPECT_EQ(*client->call("/server/slow:i", "again", kPatience_s), "again")
      << "not the late answer to the slow one";
}

TEST(Service, AThrowingHandlerAnswersFail) {
  auto node = make_node("server");
  auto service = node->open_service(
      "/server/bad:i", [](const std::string&) -> std::string { throw std::runtime_error("out of ideas"); });
  ASSERT_TRUE(service.ok());
  EXPECT_EQ(*node->call("/server/bad:i", "x", kPatience_s), "[fail] out of ideas");
}

TEST(Service, SecondOwnerIsRefused) {
  auto node = make_node("server");
  const auto echo = [](const std::string& line) { return line; };
  auto first = node->open_service("/server/one:i", echo);
  ASSERT_TRUE(first.ok());
  const auto second = node->open_service("/server/one:i", echo);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kTaken);
}

TEST(Service, ManyClientsAtOnce) {
  auto server = make_node("server");
  auto service = server->open_service("/server/rpc:i", [](const std::string& line) { return line; });
  ASSERT_TRUE(service.ok());
  std::vector<std::unique_ptr<Node>> clients;
  std::vector<std::thread> threads;
  std::atomic<int> good{0};
  for (int c = 0; c < 3; ++c) {
    clients.push_back(make_node("client" + std::to_string(c)));
  }
  for (int c = 0; c < 3; ++c) {
    for (int t = 0; t < 2; ++t) {
      threads.emplace_back([&, c, t] {
        for (int i = 0; i < 20; ++i) {
          const std::string line = std::to_string(c) + " " + std::to_string(t) + " " + std::to_string(i);
          const auto answer = clients[static_cast<std::size_t>(c)]->call("/server/rpc:i", line, kPatience_s);
          good += answer && *answer == line ? 1 : 0;
        }
      });
    }
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(good, 3 * 2 * 20);
}

}  // namespace

}  // namespace nido::testing
