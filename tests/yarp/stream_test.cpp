// Connections as bytes: the recorded words of YARP's programs, and everything that breaks a rule.

#include "nido/yarp/stream.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace nido::yarp {
namespace {

using namespace std::string_literals;

std::string word(std::int32_t value) {
  std::string out(4, '\0');
  std::memcpy(out.data(), &value, 4);
  return out;
}

// a connection, fed in pieces of a size, and all its events
std::vector<Event> events_of(const std::string& bytes, std::size_t piece = 1'000'000) {
  ReceivingStream stream;
  std::vector<Event> events;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    stream.feed(std::string_view(bytes).substr(at, piece));
    while (std::optional<Event> event = stream.next()) events.push_back(std::move(*event));
  }
  return events;
}

template <class T>
const T& as(const Event& event) {
  const T* found = std::get_if<T>(&event);
  if (found == nullptr) throw std::runtime_error("another event: " + std::to_string(event.index()));
  return *found;
}

// what `yarp rpc` sends for `get encs`
const std::string kRpc = "YA\xe4\x1e\0\0RP"s + word(9) + "anon_rpc\0"s;
const std::string kAsk = "YA\x0a\0\0\0RP\x02\x01"s + std::string(8, '\xff') + word(8) + word(23) + word(0) +
                         word(0) + "~d\0\x01"s + word(260) + word(2) + word(3) + "get" + word(4) + "encs";
const std::string kEnd =
    "YA\x0a\0\0\0RP\x01\x01"s + std::string(8, '\xff') + word(10) + word(0) + word(2) + "~\0\0\x01q\0"s;

TEST(ReceivingStream, UnderstandsWhatYarpRpcSends) {
  for (const std::size_t piece : {1, 3, 8, 1000}) {
    const std::vector<Event> events = events_of(kRpc + kAsk + kAsk + kEnd, piece);
    ASSERT_EQ(events.size(), 4U);
    EXPECT_EQ(as<Opened>(events[0]).carrier, Carrier::kTcp);
    EXPECT_EQ(as<Opened>(events[0]).sender, "anon_rpc");
    EXPECT_TRUE(as<Data>(events[1]).wants_reply);
    EXPECT_EQ(to_text(*decode(as<Data>(events[2]).bytes, Dialect::k3)), "get encs");
    as<Quit>(events[3]);
  }
}

TEST(ReceivingStream, ReadsWhatOurSenderWrites) {
  for (const Carrier carrier :
       {Carrier::kTcp, Carrier::kFastTcp, Carrier::kUdp, Carrier::kText, Carrier::kTextAck}) {
    const bool text = is_text(carrier);
    const std::string content = text ? "1 (2 3)" : encode(*parse_bottle("1 (2 3)"), Dialect::k3);
    const std::vector<Event> events = events_of(
        greeting(carrier, "/w") + message(carrier, content, "7 1.5", false) +
            message(carrier, content, "", true) + admin_message(carrier, content) + goodbye(carrier),
        5);
    ASSERT_EQ(events.size(), 5U) << to_string(carrier);
    EXPECT_EQ(as<Opened>(events[0]).carrier, carrier);
    EXPECT_EQ(as<Opened>(events[0]).sender, "/w");
    EXPECT_EQ(as<Data>(events[1]).bytes, content);
    EXPECT_EQ(as<Data>(events[1]).envelope, "7 1.5");
    EXPECT_FALSE(as<Data>(events[1]).wants_reply);
    EXPECT_TRUE(as<Data>(events[2]).wants_reply);
    EXPECT_EQ(as<Admin>(events[3]).bytes, content);
    as<Quit>(events[4]);
  }
}

TEST(ReceivingStream, APersonWithTelnet) {
  const std::vector<Event> events = events_of(
      "CONNECT me\r\nd\r\nget encs\r\nget enc 3\r\nd 12 1.5\n(1\n2)\n\r\nD\nx\na\n[list] "
      "[out]\n*\n?\n/b\n!/b\n~/c\nr\nq\n",
      2);
  ASSERT_EQ(events.size(), 13U);
  EXPECT_EQ(as<Data>(events[1]).bytes, "get encs");
  EXPECT_EQ(as<Data>(events[2]).bytes, "get enc 3");
  EXPECT_TRUE(as<Data>(events[2]).wants_reply);
  EXPECT_EQ(as<Data>(events[3]).bytes, "(1 2)");
  EXPECT_EQ(as<Data>(events[3]).envelope, "12 1.5");
  EXPECT_FALSE(as<Data>(events[4]).wants_reply);
  EXPECT_EQ(as<Admin>(events[5]).bytes, "[list] [out]");
  as<Describe>(events[6]);
  as<ShowHelp>(events[7]);
  EXPECT_EQ(as<AddOutput>(events[8]).target, "/b");
  EXPECT_EQ(as<AddOutput>(events[9]).what, AddOutput::What::kDisconnectOutput);
  EXPECT_EQ(as<AddOutput>(events[10]).target, "/c");
  as<Reverse>(events[11]);
  as<Quit>(events[12]);
}

TEST(ReceivingStream, NamesAndBrowsers) {
  const std::vector<Event> names = events_of("NAME_SERVER query /a\r\nNAME_SERVER list\n", 3);
  ASSERT_EQ(names.size(), 2U);
  EXPECT_EQ(as<NameRequest>(names[0]).line, "query /a");
  EXPECT_EQ(as<NameRequest>(names[1]).line, "list");
  EXPECT_EQ(as<HttpRequest>(events_of("GET /x HTTP/1.1\r\n\r\n")[0]).path, "/x");
}

class Broken : public testing::TestWithParam<std::string> {};
TEST_P(Broken, IsRefusedWithAReason) {
  for (const std::size_t piece : {7, 1'000'000}) {
    const std::vector<Event> events = events_of(GetParam(), piece);
    ASSERT_FALSE(events.empty());
    EXPECT_FALSE(as<Refused>(events.back()).reason.empty());
  }
}
const std::string kIndexHead = "YA\x0a\0\0\0RP"s;
INSTANTIATE_TEST_SUITE_P(
    Bytes, Broken,
    testing::Values(
        "hello world", "hi\n", "YA\x01\x02\x03\x04\x05\x06"s, "YA\0\0\0\0RP"s, "YA\xe4\x1e\0\0RP"s + word(-1),
        "YA\xe4\x1e\0\0RP"s + word(0x7fffffff), "YA\xe4\x1e\0\0RP"s + word(1001), kRpc + "YA\x0b\0\0\0RP"s,
        kRpc + "rubbish!", kRpc + kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(-1) + word(0),
        kRpc + kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(0x7fffffff) + word(0),
        kRpc + kIndexHead + "\x02\x01"s + std::string(8, '\xff') + word(0x7fffffff) + word(0x7fffffff) +
            word(0),
        kRpc + kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(8) + word(0) + "12345678",
        kRpc + kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(8) + word(0) + word(9000) +
            "~\0\0\x01"s,
        kRpc + kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(8) + word(0) + word(0) + "~Z\0\x01"s,
        "CONNECT " + std::string(2000, 'x'), "CONNECT me\nd\n" + std::string(200'000, 'x'),
        "CONNECT me\nd\n" + std::string(100'000, '(') + "\n", "NAME_SERVER " + std::string(100'000, 'x')));

TEST(ReceivingStream, KeepsNoMoreThanAMessage) {
  ReceivingStream stream({.message = 1000});
  stream.feed(kRpc);
  while (stream.next()) {
  }
  stream.feed(kIndexHead + "\x01\x01"s + std::string(8, '\xff') + word(1000) + word(0));
  EXPECT_FALSE(stream.next().has_value());
  EXPECT_TRUE(stream.hungry());
  stream.feed(std::string(1000 + 64 * 1024, 'x'));
  EXPECT_FALSE(stream.hungry());
}

TEST(ReceivingStream, NoBytesBreakIt) {
  std::mt19937_64 random(3);
  const std::string session = kRpc + kAsk + kAsk + kAsk + kEnd;
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = session;
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    for (const Event& event : events_of(bytes, 1 + random() % 64)) {
      if (const auto* data = std::get_if<Data>(&event)) (void)decode_any(data->bytes, Dialect::k3);
    }
  }
}

TEST(Datagrams, CarryMessagesOfAnySizeAndDropWhatIsBroken) {
  const std::string bytes = message(Carrier::kUdp, std::string(200'000, 'x'), "1 2.5", false);
  const std::vector<std::string> datagrams = to_datagrams(bytes);
  ASSERT_EQ(datagrams.size(), 4U);
  DatagramReader reader;
  const auto gather = [&](const std::vector<std::string>& sent) {
    std::string out;
    for (const std::string& datagram : sent) {
      if (const auto piece = reader.take(datagram))
        out = piece->restarts ? std::string(piece->bytes) : out + std::string(piece->bytes);
    }
    return out;
  };
  EXPECT_EQ(gather(datagrams), bytes);
  std::vector<std::string> lossy = datagrams;
  lossy.erase(lossy.begin() + 1);
  EXPECT_NE(gather(lossy), bytes);
  std::vector<std::string> flipped = datagrams;
  flipped[2][100] = static_cast<char>(flipped[2][100] ^ 1);
  EXPECT_NE(gather(flipped), bytes);
  EXPECT_FALSE(reader.take("short").has_value());
  EXPECT_EQ(gather(datagrams), bytes) << "it does not recover";
  EXPECT_EQ(crc32("123456789"), 0xcbf43926U);
}

TEST(AnswerReader, TakesRepliesAndAcknowledgements) {
  AnswerReader reader(Carrier::kTcp);
  reader.feed(yarp_number(10'005));
  EXPECT_EQ(**reader.welcome(), 10'005);
  const std::string reply = encode(*parse_bottle("[ok] 1.5"), Dialect::k3) + yarp_number(0);
  for (const char byte : reply) {
    EXPECT_FALSE((*reader.reply(Dialect::k3)).has_value());
    reader.feed(std::string_view(&byte, 1));
  }
  EXPECT_EQ(to_text((*reader.reply(Dialect::k3))->bottle), "[ok] 1.5");
  EXPECT_TRUE(*reader.ack());
  reader.feed("nonsense");
  EXPECT_FALSE(reader.ack().ok());
}

}  // namespace
}  // namespace nido::yarp
