// What strangers may send to the ports of a gateway: everything is refused, the robot's other clients notice
// nothing, and memory is bounded.

#include <sys/resource.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <list>
#include <random>

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
using yarp::test::Client;
using namespace std::string_literals;

std::string int32(std::int32_t value) {
  std::string out;
  for (int i = 0; i < 4; ++i) out += static_cast<char>(static_cast<std::uint32_t>(value) >> (8 * i));
  return out;
}

std::string repeated(const std::string& piece, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += piece;
  return out;
}

std::string image(std::int32_t width, std::int32_t height, const std::string& code) {
  return int32(256) + int32(4) + int32(9) + "mat\0"s + int32(9) + code + int32(257) + int32(5) + int32(3) +
         int32(64) + int32(8) + int32(width) + int32(height) + int32(12) + int32(64) + std::string(64, 'x');
}

struct Attack {
  const char* what;
  std::string bytes;
};

constexpr std::int32_t kHuge = 0x7fffffff;

// objects that lie about themselves, in a message of their own
std::vector<Attack> objects() {
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
std::vector<Attack> connections() {
  const std::string hello = yarp::greeting(Carrier::kTcp, "/stranger");
  const std::string index = "YA\x0a\0\0\0RP\x02\x01"s + std::string(8, '\xff');
  std::vector<Attack> all = {
      {"wrong magic", "YB\xe4\x1e\0\0RPxxxxxxxxxxxxxxxxxxxxxxx"s},
      {"zeros", std::string(5000, '\0')},
      {"half a header", hello.substr(0, 5)},
      {"half a message", hello + yarp::message(Carrier::kTcp, "abc", {}, true).substr(0, 20)},
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
      all.push_back({object.what, hello + yarp::message(Carrier::kTcp, object.bytes, "1 2.0", wants_reply)});
    }
    all.push_back({object.what, hello + yarp::admin_message(Carrier::kTcp, object.bytes)});
    all.push_back({object.what, "NAME_SER" + object.bytes});
  }
  return all;
}

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

  // A new state once the last one has come, so that none is lost because this computer is slow.
  void step() {
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
