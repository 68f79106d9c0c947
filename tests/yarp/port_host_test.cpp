// Ports as YARP's programs meet them, through sockets.

#include "nido/yarp/port_host.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <list>
#include <mutex>

#include "client.h"
#include "host_fixture.h"

namespace nido::yarp::test {
namespace {

using namespace std::string_literals;

// a port that answers with what it was told, and one that gives
class Ports : public testing::Test {
 protected:
  void SetUp() override {
    PortSpec echo;
    echo.name = "/echo";
    echo.takes = true;
    echo.on_message = [this](Incoming incoming) {
      const Result<Decoded> content = incoming.content();
      {
        const std::lock_guard lock(mutex_);
        envelopes_.push_back(incoming.envelope);
      }
      if (!content)
        return incoming.answer(Bottle{Value::word("fail"), Value::string(content.error().message)});
      Bottle reply{Value::string("you"), Value::string("said")};
      reply.insert(reply.end(), content->bottle.begin(), content->bottle.end());
      incoming.answer(std::move(reply));
    };
    echo_ = ports_.open(std::move(echo));
    PortSpec give;
    give.name = "/give";
    give.gives = true;
    give.on_readers = [this](std::size_t readers) { readers_ = readers; };
    give_ = ports_.open(std::move(give));
  }
  void publish(const std::string& text, const std::string& envelope = "1 0.5") {
    ports_.host().publish("/give", std::make_shared<const Content>(*parse_bottle(text)), envelope);
  }
  void wait_for_readers(std::size_t count) {
    while (readers_ != count) std::this_thread::yield();
  }
  // that others are served as before
  void expect_alive() {
    Client client(echo_);
    ASSERT_TRUE(client.greet(Carrier::kTcp, "/alive"));
    EXPECT_EQ(to_text(client.ask({Value::string("hi")})), "you said hi");
  }

  std::mutex mutex_;
  std::vector<std::string> envelopes_;
  std::atomic<std::size_t> readers_ = 0;
  HostThread ports_;
  int echo_ = 0;
  int give_ = 0;
};

TEST_F(Ports, AnswerInTheDialectThatIsSpoken) {
  for (const Dialect dialect : {Dialect::k3, Dialect::k4}) {
    Client client(echo_);
    ASSERT_TRUE(client.greet(Carrier::kTcp, "/me"));
    client.send(message(Carrier::kTcp, encode({Value::of(1.5)}, dialect), "3 9.5", true));
    const std::string expected = encode(*parse_bottle("you said 1.5"), dialect);
    EXPECT_EQ(client.receive(expected.size()), expected);
    EXPECT_EQ(client.receive(8), yarp_number(0));
  }
  EXPECT_EQ(envelopes_, (std::vector<std::string>{"3 9.5", "3 9.5"}));
}

TEST_F(Ports, TalkToAPersonWithTelnet) {
  Client person(echo_);
  ASSERT_TRUE(person.send("CONNECT anna\r\n"));
  EXPECT_EQ(person.line(), "Welcome anna\r\n");
  person.send("d\r\nget encs\r\n");
  EXPECT_EQ(person.line(), "you said get encs\r\n");
  person.send("get enc 3\r\n");
  EXPECT_EQ(person.line(), "you said get enc 3\r\n");
  person.send("*\r\n");
  EXPECT_EQ(person.line(), "This is /echo at tcp://127.0.0.1:" + std::to_string(echo_) + "/\r\n");
  EXPECT_EQ(person.line(), "There are no outgoing connections\r\n");
  EXPECT_EQ(person.line(), "There is an input connection from anna to /echo using text\r\n");
  person.send("q\r\n");
  EXPECT_EQ(person.until_end(), "");
}

TEST_F(Ports, TextWithAcknowledgements) {
  Client client(echo_);
  ASSERT_TRUE(client.greet(Carrier::kTextAck, "admin"));
  client.send("a\r\n[ver]\r\n");
  EXPECT_EQ(client.line(), "[ver] 1 2 3\r\n");
  EXPECT_EQ(client.line(), "<ACK>\r\n");
  client.send("d\r\n1 (2\r\n3)\r\n");
  EXPECT_EQ(client.line(), "you said 1 (2 3)\r\n");
  EXPECT_EQ(client.line(), "<ACK>\r\n");
  client.send("D\r\nx\r\n");
  EXPECT_EQ(client.line(), "<ACK>\r\n");
}

TEST_F(Ports, GiveToWhomTheyAreConnected) {
  // the reader of somebody else: registers, listens, and is connected from outside
  PortSpec read;
  read.name = "/read";
  read.takes = true;
  std::promise<std::pair<std::string, std::string>> received;
  std::atomic<bool> first = true;
  read.on_message = [&](Incoming incoming) {
    if (first.exchange(false)) received.set_value({to_text(incoming.content()->bottle), incoming.envelope});
    incoming.answer(std::nullopt);
  };
  ports_.open(std::move(read));
  for (const char* carrier : {"tcp", "fast_tcp", "udp", "text", "text_ack"}) {
    received = {};
    first = true;
    Client admin(give_);
    ASSERT_TRUE(admin.greet(Carrier::kTextAck, "admin"));
    admin.send("a\r\n[add] \""s + carrier + "://read\"\r\n");
    EXPECT_EQ(admin.line(), "0 \"Added connection from /give to "s + carrier + "://read\\r\\n\"\r\n");
    EXPECT_EQ(admin.line(), "<ACK>\r\n");
    wait_for_readers(1);
    auto future = received.get_future();
    // a datagram may be lost: again until one came
    do {
      publish("1.5 (2 x)", "7 2.5");
    } while (future.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready);
    EXPECT_EQ(future.get(), (std::pair<std::string, std::string>{"1.5 (2 x)", "7 2.5"})) << carrier;
    admin.send("a\r\n[list] [out] /read\r\n");
    const std::string route = admin.line();
    EXPECT_TRUE(route.starts_with("(from \"/give\") (to \"/read\") (carrier "s + carrier + ")")) << route;
    admin.line();
    admin.send("a\r\n[del] /read\r\n");
    EXPECT_EQ(admin.line(), "0 \"Removed connection from /give to /read\\r\\n\"\r\n");
    admin.line();
    wait_for_readers(0);
  }
}

TEST_F(Ports, SayWhyAConnectionCannotBeMade) {
  Client admin(give_);
  ASSERT_TRUE(admin.greet(Carrier::kTextAck, "admin"));
  const auto add = [&](const std::string& target) {
    admin.send("a\r\n[add] \"" + target + "\"\r\n");
    const std::string answer = admin.line();
    EXPECT_EQ(admin.line(), "<ACK>\r\n");
    return answer;
  };
  EXPECT_EQ(add("tcp://nobody"), "-1 \"Do not know how to connect to /nobody\\r\\n\"\r\n");
  EXPECT_NE(add("mcast://echo").find("carrier mcast is not known"), std::string::npos);
  Client names(ports_.names_port());
  names.send("NAME_SERVER register /gone tcp 127.0.0.1 1\nNAME_SERVER register /far tcp 10.1.2.3 10002\n");
  for (int i = 0; i < 4; ++i) names.line();
  EXPECT_TRUE(add("tcp://gone").starts_with("-1 ")) << "nobody listens there";
  EXPECT_NE(add("tcp://far").find("not on this computer"), std::string::npos);
  Client to_input(echo_);
  ASSERT_TRUE(to_input.greet(Carrier::kTextAck, "admin"));
  to_input.send("a\r\n[add] \"tcp://give\"\r\n");
  EXPECT_EQ(to_input.line(), "-1 \"Outputs not allowed\\r\\n\"\r\n");
}

TEST_F(Ports, AReaderThatReadsNothingHoldsUpNobody) {
  Client lazy(give_);
  ASSERT_TRUE(lazy.greet(Carrier::kFastTcp, "/lazy"));
  lazy.send("YA\x0a\0\0\0RP\x01\x01"s + std::string(8, '\xff') + "\x08\0\0\0\0\0\0\0\0\0\0\0~r\0\x01"s);
  Client eager(give_);
  ASSERT_TRUE(eager.greet(Carrier::kText, "eager"));
  eager.send("r\r\n");
  wait_for_readers(2);
  const std::string big(100'000, 'x');
  for (int i = 0; i < 200; ++i) {
    publish("\"" + big + "\"");
    publish(std::to_string(i));
    // the eager one gets the newest
    for (std::string line = eager.line(); line != std::to_string(i) + "\r\n"; line = eager.line())
      ASSERT_FALSE(line.empty());
  }
  EXPECT_GT(ports_.figures().lost, 50U);
  expect_alive();
}

TEST_F(Ports, WhatBreaksARuleIsRefusedAndNobodyElseNotices) {
  const std::vector<std::string> attacks = {
      "hello world",
      "\r\n\r\n",
      std::string(100'000, 'x'),
      "YA\xe4\x1e\0\0RP\xff\xff\xff\x7f"s,
      greeting(Carrier::kTcp, "/x") + "rubbishrubbish",
      greeting(Carrier::kTcp, "/x") + "YA\x0a\0\0\0RP\xff\xff"s + std::string(3000, '\xff'),
      greeting(Carrier::kText, "x") + std::string(1'000'000, '('),
      greeting(Carrier::kText, "x") + "a\r\n" + std::string(70'000, '(') + "\r\n",
      "NAME_SERVER list\n",
      std::string("NAME_SER") + std::string(200'000, 'x')};
  for (const std::string& attack : attacks) {
    Client client(echo_);
    client.send(attack);
    client.shut_down();
    client.until_end();
    expect_alive();
  }
  EXPECT_GT(ports_.figures().refused, 5U);
  // objects that lie are refused, and the connection goes on
  Client client(echo_);
  ASSERT_TRUE(client.greet(Carrier::kTcp, "/liar"));
  std::string nested = "\0\x01\0\0\x01\0\0\0"s;
  for (int i = 0; i < 50'000; ++i) nested += "\0\x01\0\0\x01\0\0\0"s;
  client.send(message(Carrier::kTcp, nested, {}, true));
  AnswerReader reader(Carrier::kTcp);
  for (;;) {
    const std::string byte = client.receive(1);
    ASSERT_FALSE(byte.empty());
    reader.feed(byte);
    const auto reply = reader.reply(Dialect::k3);
    if (!reply || !*reply) continue;
    EXPECT_EQ((*reply)->bottle.front(), Value::word("fail"));
    break;
  }
  expect_alive();
}

TEST_F(Ports, ServeNamesAtTheSameTime) {
  Client names(ports_.names_port());
  names.send("NAME_SERVER query /echo\n");
  EXPECT_EQ(names.line(),
            "registration name /echo ip 127.0.0.1 port " + std::to_string(echo_) + " type tcp\r\n");
  EXPECT_EQ(names.line(), "*** end of message\r\n");
  Client text(ports_.names_port());
  ASSERT_TRUE(text.greet(Carrier::kTextAck, "x"));
  text.send("d\r\nquery /none\r\n");
  EXPECT_EQ(text.line(), "*** end of message\r\n");
  EXPECT_EQ(text.line(), "<ACK>\r\n");
}

TEST_F(Ports, TheNameServerMakesConnectionsThatAreAskedFor) {
  PortSpec read;
  read.name = "/follower";
  read.takes = true;
  read.on_message = [](Incoming incoming) { incoming.answer(std::nullopt); };
  ports_.open(std::move(read));
  Client names(ports_.names_port());
  names.send("NAME_SERVER subscribe tcp://give /follower\n");
  EXPECT_EQ(names.line(), "[ok]\r\n");
  EXPECT_EQ(names.line(), "*** end of message\r\n");
  wait_for_readers(1);
  Client text(ports_.names_port());
  ASSERT_TRUE(text.greet(Carrier::kTextAck, "x"));
  text.send("d\r\nsubscribe /nobody /follower\r\n");
  EXPECT_TRUE(text.line().starts_with("[fail]"));
}

TEST_F(Ports, ASenderThatComesAgainTakesItsFormerPlace) {
  Client first(echo_);
  ASSERT_TRUE(first.greet(Carrier::kTcp, "/same"));
  Client second(echo_);
  ASSERT_TRUE(second.greet(Carrier::kTcp, "/same"));
  EXPECT_EQ(first.until_end(), "");
  EXPECT_EQ(to_text(second.ask({Value::string("x")})), "you said x");
}

TEST(ManyConnections, AreBoundedAndTheSilentOnesGo) {
  PortHostOptions options;
  options.connections = 50;
  options.handshake_s = 0.5;
  HostThread ports(options);
  PortSpec spec;
  spec.name = "/p";
  spec.takes = true;
  spec.on_message = [](Incoming incoming) { incoming.answer(Bottle{Value::word("ok")}); };
  const int number = ports.open(std::move(spec));
  std::list<Client> silent;
  for (int i = 0; i < 300; ++i) silent.emplace_back(number);
  Client speaks(number);
  ASSERT_TRUE(speaks.greet(Carrier::kTcp, "/speaks"));
  EXPECT_EQ(to_text(speaks.ask({Value::string("x")})), "[ok]");
  EXPECT_LE(ports.figures().connections, 50U);
  for (Client& client : silent) EXPECT_EQ(client.until_end(), "");
  EXPECT_EQ(to_text(speaks.ask({Value::string("x")})), "[ok]");
}

TEST(RegisteredPorts, AreKnownAgainWhenTheNameServerIsStartedAgain) {
  auto names = std::make_unique<HostThread>();
  const int names_port = names->names_port();
  PortHostOptions options;
  options.names = PortHostOptions::Names::kRegister;
  HostThread registered(options, names_port);
  PortSpec spec;
  spec.name = "/here";
  spec.takes = true;
  const int number = registered.open(spec);
  const auto becomes_known = [&] {
    int found = 0;
    for (int tried = 0; tried < 3000 && found == 0; ++tried) {
      names->on_loop([&] {
        names->host().find("/here",
                           [&](std::optional<Contact> contact) { found = contact ? contact->port : 0; });
      });
      if (found == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return found;
  };
  ASSERT_EQ(becomes_known(), number);
  names.reset();
  names = std::make_unique<HostThread>(PortHostOptions{}, names_port);
  EXPECT_EQ(becomes_known(), number);
}

TEST(PortHostOptions, OnlyLoopbackIsListenedOn) {
  auto loop = EventLoop::create();
  PortHostOptions options;
  options.host = "0.0.0.0";
  const auto host = PortHost::open(**loop, options);
  ASSERT_FALSE(host.ok());
  EXPECT_NE(host.error().message.find("loopback"), std::string::npos);
}

// Exchanges recorded between YARP 3.12.3's own programs and these ports: the same bytes get the same answers.
TEST(RecordedExchanges, AreAnsweredAsWhenTheyWereRecorded) {
  std::ifstream file(NIDO_EXCHANGES);
  ASSERT_TRUE(file.good());
  const auto bytes_of = [](const std::string& hex) {
    std::string out;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
      out += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    return out;
  };
  int exchanges = 0;
  std::unique_ptr<HostThread> ports;
  std::unique_ptr<Client> client;
  // "port NAME KIND" begins a connection, "> HEX" is sent by the program, "< HEX" is what it got
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line.starts_with("port ")) {
      ports = std::make_unique<HostThread>();
      PortSpec spec;
      spec.name = line.substr(5);
      spec.gives = spec.takes = true;
      spec.on_message = [](Incoming incoming) { incoming.answer(Bottle{Value::word("ok")}); };
      client = std::make_unique<Client>(ports->open(std::move(spec)));
    } else if (line[0] == '>') {
      ASSERT_TRUE(client->send(bytes_of(line.substr(2))));
    } else {
      const std::string expected = bytes_of(line.substr(2));
      const std::string got = client->receive(expected.size());
      // the welcome of binary carriers tells the port's number, which differs
      if (parse_yarp_number(expected) && expected != yarp_number(0)) {
        EXPECT_TRUE(parse_yarp_number(got).has_value());
      } else {
        EXPECT_EQ(got, expected);
      }
      ++exchanges;
    }
  }
  EXPECT_GT(exchanges, 10);
}

}  // namespace
}  // namespace nido::yarp::test
