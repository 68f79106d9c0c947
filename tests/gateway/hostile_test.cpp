// What strangers may send to the ports of a gateway: everything is refused, the robot's other clients notice
// nothing, and memory is bounded.

#include <sys/resource.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <list>
#include <random>

#include "../yarp/attacks.h"
#include "../yarp/client.h"
#include "fake/fake_sensors.h"
#include "gateway_link.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "nido/wrappers/servers.h"
#include "nido/yarp/stream.h"

namespace nido::test {
namespace {

using yarp::Carrier;
using yarp::test::Attack;
using yarp::test::Client;
using yarp::test::connections;
using yarp::test::image;
using yarp::test::int32;
using yarp::test::repeated;
using namespace std::string_literals;

std::size_t resident_MB() {
  std::ifstream status("/proc/self/statm");
  std::size_t total = 0;
  std::size_t resident = 0;
  status >> total >> resident;
  return resident * 4096 / 1'000'000;
}

// A fake arm and ports that take pictures and commands, behind a gateway; a client that reads every state of
// the arm, and one that asks.
class Hostile : public testing::Test {
 protected:
  Hostile() {
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
    board_.put_limits();
    server_ = required(serve_control_board(link_.server(), link_.stem("arm"), board_.board(), kPeriod_ns));
    pictures_ =
        required(link_.server().open_input<msgs::Image>(link_.stem("pictures:i"), Profile::kSensor, 2));
    for (const char* port : {"arm/state:o", "arm/stateExt:o", "arm/rpc:i", "arm/command:i", "pictures:i"}) {
      link_.wait_for(link_.stem(port));
      numbers_.push_back(link_.number_of(link_.stem(port)));
    }
    numbers_.push_back(link_.names_port());
    reader_ = std::make_unique<Client>(numbers_[0]);
    asker_ = std::make_unique<Client>(numbers_[2]);
    if (!reader_->greet(Carrier::kTextAck, "reader") || !asker_->greet(Carrier::kTcp, "/asker")) {
      throw std::runtime_error("no welcome");
    }
    reader_->send("r\r\n");
    reads_ = std::thread([this] { read(); });
    steps_ = std::thread([this] { step(); });
  }
  ~Hostile() override {
    ends_ = true;
    steps_.join();
    reader_->shut_down();
    reads_.join();
  }

  // A new state once the last one has come, so that none is lost because this computer is slow. With
  // NIDO_STATE_HZ in the environment so many a second, come what may.
  void step() {
    if (const char* rate = std::getenv("NIDO_STATE_HZ")) return step_at(std::atof(rate));
    for (long published = 0; !ends_; ++published) {
      board_.advance();
      (void)server_->take_commands();
      (void)server_->publish(board_.clock().now_ns());
      const auto is_ahead = [&] { return newest_ >= 0 && published > newest_ + 8; };
      do {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      } while (is_ahead() && !ends_);
    }
  }
  void step_at(double rate_hz) {
    using Clock = std::chrono::steady_clock;
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_hz));
    for (auto due = Clock::now(); !ends_; due += period) {
      std::this_thread::sleep_until(due);
      if (Clock::now() - due > period) ++late_;
      board_.advance();
      (void)server_->take_commands();
      (void)server_->publish(board_.clock().now_ns());
    }
  }
  // "D COUNT SECONDS", then the state
  void read() {
    for (std::string head = reader_->line(); head.starts_with("D "); head = reader_->line()) {
      reader_->line();
      const long count = std::stol(head.substr(2));
      const long before = newest_.exchange(count);
      if (before >= 0 && count != before + 1) gaps_ += count - before - 1;
    }
  }

  // The asker is answered, and the reader gets on and misses nothing.
  void expect_unnoticed(const std::string& after) {
    const std::string answer = to_text(asker_->ask({yarp::Value::word("get"), yarp::Value::word("axes")}));
    ASSERT_TRUE(answer.starts_with("[is] [axes] 3 ")) << answer << " after " << after;
    const long now = newest_;
    ASSERT_NO_THROW(wait_until([&] { return newest_ > now; })) << after;
    ASSERT_EQ(gaps_, 0) << "after " << after;
  }

  GatewayLink link_;
  FakeRig board_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<Input<msgs::Image>> pictures_;
  std::vector<int> numbers_;
  std::unique_ptr<Client> reader_;
  std::unique_ptr<Client> asker_;
  std::atomic<long> newest_ = -1;
  std::atomic<long> gaps_ = 0;
  std::atomic<long> late_ = 0;  // states that were made a period late or more
  std::atomic<bool> ends_ = false;
  std::thread reads_;
  std::thread steps_;
};

TEST_F(Hostile, NothingThatIsMalformedIsNoticedByOthers) {
  const std::size_t before_MB = resident_MB();
  for (const Attack& attack : connections()) {
    for (const int number : numbers_) {
      Client stranger(number);
      ASSERT_TRUE(stranger.connected()) << attack.what;
      stranger.send(attack.bytes);
      stranger.shut_down();
      stranger.until_end();
    }
    ASSERT_NO_FATAL_FAILURE(expect_unnoticed(attack.what));
  }
  EXPECT_GT(link_.figures().refused, 50U);
  EXPECT_LT(resident_MB(), before_MB + 100);
}

// Sessions as programs hold them, with some bytes changed. 1000 of them, or as many as NIDO_SESSIONS says.
TEST_F(Hostile, MutatedSessions) {
  const char* wanted = std::getenv("NIDO_SESSIONS");
  const int sessions = wanted != nullptr ? std::atoi(wanted) : 1000;
  const std::string hello = yarp::greeting(Carrier::kTcp, "/mutant");
  const auto asks = [&](const yarp::Bottle& bottle) {
    return yarp::message(Carrier::kTcp, yarp::encode(bottle, yarp::Dialect::k3), "7 1.5", true);
  };
  using yarp::Value;
  const std::vector<std::string> bases = {
      hello + asks({Value::word("get"), Value::string("encs")}) +
          asks({Value::word("get"), Value::word("axes")}),
      hello + asks({Value::list({Value::word("dpo"), Value::of(std::int64_t{0})}),
                    Value::list({Value::of(3.0)})}),
      hello + yarp::admin_message(Carrier::kTcp,
                                  yarp::encode({Value::word("list"), Value::word("out")}, yarp::Dialect::k3)),
      hello + yarp::message(Carrier::kTcp, image(8, 8, "rgb\0"s), "1 1.0", false),
      "CONNECT me\r\nd\r\nget encs\r\n*\r\n?\r\na\r\n[list] [in]\r\nq\r\n",
      "NAME_SERVER register /m tcp 127.0.0.1 9\nNAME_SERVER query /m\nNAME_SERVER unregister /m\n",
      "GET /?data=1 HTTP/1.1\r\n\r\n"};
  std::mt19937_64 random(1);
  const std::size_t before_MB = resident_MB();
  for (int i = 0; i < sessions; ++i) {
    std::string bytes = bases[random() % bases.size()];
    for (std::uint64_t n = random() % 5; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    if (random() % 8 == 0) bytes.resize(random() % bytes.size());
    Client mutant(numbers_[random() % numbers_.size()]);
    mutant.send(bytes);
    if (i % 200 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_unnoticed(std::to_string(i) + " mutated sessions"));
    }
  }
  ASSERT_NO_FATAL_FAILURE(expect_unnoticed("all mutated sessions"));
  EXPECT_LT(resident_MB(), before_MB + 100);
  RecordProperty("states_read_without_a_gap", std::to_string(newest_.load()));
  if (std::getenv("NIDO_STATE_HZ") != nullptr)
    std::cout << newest_ << " states read without a gap, " << late_ << " of them made late\n";
}

TEST_F(Hostile, AThousandConnectionsThatSayNothing) {
  std::list<Client> silent;
  for (int i = 0; i < 1000; ++i) {
    silent.emplace_back(numbers_[static_cast<std::size_t>(i) % numbers_.size()]);
    if (i % 100 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_unnoticed(std::to_string(i) + " connections"));
    }
  }
  for (int i = 0; i < 5; ++i) ASSERT_NO_FATAL_FAILURE(expect_unnoticed("1000 connections"));
  EXPECT_LE(link_.figures().connections, 1000U);
}

TEST_F(Hostile, HalfMessagesOfManyConnectionsHaveOneBoundTogether) {
  constexpr std::size_t kBound = (64U << 20U) + (32U << 20U);  // the default, and what one turn can take
  const std::string begun = yarp::greeting(Carrier::kTcp, "") + "YA\x0a\0\0\0RP\x02\x01"s +
                            std::string(8, '\xff') + int32(8) + int32(1'000'000) + int32(0) +
                            std::string(900'000, 'x');
  std::list<Client> half;
  for (int i = 0; i < 200; ++i) {
    half.emplace_back(numbers_[i % 2 == 0 ? 2 : 4]);
    half.back().send(begun);
    EXPECT_LE(link_.figures().held, kBound);
    if (i % 20 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_unnoticed(std::to_string(i) + " halves"));
    }
  }
  ASSERT_NO_FATAL_FAILURE(expect_unnoticed("200 halves"));
  EXPECT_GT(link_.figures().refused, 100U);
  half.clear();
  wait_until([&] { return link_.figures().held < 4U << 20U; });
}

TEST_F(Hostile, WhoNeverReadsHoldsUpNobody) {
  std::list<Client> lazy;
  for (int i = 0; i < 20; ++i) {
    lazy.emplace_back(numbers_[1]);
    ASSERT_TRUE(lazy.back().greet(Carrier::kText, "lazy"));
    lazy.back().send("r\r\n");
    lazy.emplace_back(numbers_[2]);
    ASSERT_TRUE(lazy.back().greet(Carrier::kText, "lazy"));
    lazy.back().send(repeated("help\r\n", 5000));
  }
  for (int i = 0; i < 50; ++i) ASSERT_NO_FATAL_FAILURE(expect_unnoticed("lazy ones"));
}

}  // namespace
}  // namespace nido::test
