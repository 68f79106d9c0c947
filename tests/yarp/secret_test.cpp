// Ports with a secret take nothing from who does not know it.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "client.h"
#include "host_fixture.h"
#include "nido/yarp/devices.h"
#include "nido/yarp/secret_handshake.h"

namespace nido::yarp::test {
namespace {

constexpr const char* kSecret = "open sesame 1234";

PortHostOptions with_secret(const std::string& secret = kSecret) {
  PortHostOptions options;
  options.secret = secret;
  return options;
}

// The connecting end of the handshake; false when the far end hangs up.
bool prove(Client& client, const std::string& secret) {
  SecretHandshake handshake(secret, SecretHandshake::End::kConnects);
  std::string got = client.receive(40);
  for (int rounds = 0; rounds < 2; ++rounds) {
    std::string out;
    if (!handshake.feed(got, out)) {
      // it goes on regardless
      client.send(std::string(40, 'x'));
      return client.receive(40).size() == 40;
    }
    if (handshake.is_done()) return true;
    client.send(out);
    got = client.receive(40);
  }
  return false;
}

class Secret : public testing::Test {
 protected:
  Secret() {
    PortSpec echo;
    echo.name = "/echo";
    echo.takes = true;
    echo.on_message = [this](Incoming incoming) {
      ++taken_;
      incoming.answer(Bottle{Value::word("ok")});
    };
    echo_ = ports_.open(std::move(echo));
  }
  std::atomic<int> taken_ = 0;
  HostThread ports_{with_secret()};
  int echo_ = 0;
};

TEST_F(Secret, WhoKnowsItIsAnswered) {
  Client client(echo_);
  ASSERT_TRUE(prove(client, kSecret));
  ASSERT_TRUE(client.greet(Carrier::kTcp, "/friend"));
  EXPECT_EQ(to_text(client.ask({Value::string("x")})), "[ok]");
  Client names(ports_.names_port());
  ASSERT_TRUE(prove(names, kSecret));
  names.send("NAME_SERVER query /echo\n");
  EXPECT_TRUE(names.line().starts_with("registration name /echo "));
}

TEST_F(Secret, NothingIsTakenFromWhoDoesNot) {
  const std::string command = greeting(Carrier::kTcp, "/stranger") +
                              message(Carrier::kTcp, encode({Value::string("x")}, Dialect::k3), {}, true);
  for (const int number : {echo_, ports_.names_port()}) {
    Client wrong(number);
    EXPECT_FALSE(prove(wrong, "open barley 1234"));
    for (const std::string& bytes :
         {command, std::string("CONNECT me\r\nget encs\r\n") + std::string(60, ' '),
          std::string("NAME_SERVER list\n") + std::string(60, ' '), std::string(5000, '\0')}) {
      Client stranger(number);
      stranger.send(bytes);
      EXPECT_EQ(stranger.until_end().substr(0, 100).size(), 40U) << "more than the first proof is said";
    }
  }
  EXPECT_EQ(taken_, 0);
  EXPECT_EQ(ports_.figures().refused, 10U);
}

TEST_F(Secret, AProofCannotBeUsedAgain) {
  SecretHandshake one(kSecret, SecretHandshake::End::kAccepts);
  SecretHandshake two(kSecret, SecretHandshake::End::kConnects);
  std::string first = one.begin();
  std::string second;
  ASSERT_TRUE(two.feed(first, second).ok());
  Client replays(echo_);
  replays.receive(40);
  replays.send(second);
  EXPECT_EQ(replays.receive(1), "");
}

TEST_F(Secret, PortsWithOneSecretConnectToEachOther) {
  PortHostOptions options = with_secret();
  PortSpec give;
  give.name = "/give";
  give.gives = true;
  ports_.open(std::move(give));
  std::promise<Status> done;
  ports_.on_loop([&] {
    ports_.host().connect("/give", "/echo", Carrier::kFastTcp,
                          [&](const Status& status) { done.set_value(status); });
  });
  const Status connected = done.get_future().get();
  ASSERT_TRUE(connected.ok()) << connected.error().message;
  ports_.host().publish("/give", std::make_shared<const Content>(Bottle{Value::string("x")}), {});
  while (taken_ == 0) std::this_thread::yield();
}

// A robot that wants the secret, as devices of the family yarp see it.
class SecretRobot : public Secret {
 protected:
  static Result<std::shared_ptr<Network>> network(int names_port, const std::string& secret) {
    NetworkOptions options;
    options.names_port = names_port;
    options.secret = secret;
    return Network::open(options);
  }
};

TEST_F(SecretRobot, IsAskedCommandedAndReadByWhoKnowsIt) {
  PortSpec give;
  give.name = "/give";
  give.gives = true;
  ports_.open(std::move(give));
  const auto net = network(ports_.names_port(), kSecret);
  ASSERT_TRUE(net.ok()) << net.error().message;
  const Result<Bottle> reply = (*net)->ask("/echo", {Value::string("x")});
  ASSERT_TRUE(reply.ok()) << reply.error().message;
  EXPECT_EQ(to_text(*reply), "[ok]");
  const auto stream = (*net)->stream_to("/echo", "/commands");
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  ASSERT_TRUE((*stream)->send({Value::string("y")}).ok());
  while (taken_ < 2) std::this_thread::yield();
  std::atomic<int> came = 0;
  const auto taken = (*net)->subscribe("/give", "/readings", 1000, [&](const auto&, const auto&) { ++came; });
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  while (came == 0) {
    ports_.host().publish("/give", std::make_shared<const Content>(Bottle{Value::string("z")}), {});
    std::this_thread::yield();
  }
}

TEST_F(SecretRobot, SaysInASentenceWhyThereIsNone) {
  const auto wrong = network(ports_.names_port(), "open barley 1234");
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("does not know the secret"), std::string::npos)
      << wrong.error().message;
  const auto none = network(ports_.names_port(), "");
  ASSERT_FALSE(none.ok());
  // a robot without a secret says nothing first
  HostThread open_ports;
  NetworkOptions options;
  options.names_port = open_ports.names_port();
  options.secret = kSecret;
  options.timeout_s = 0.3;
  const auto nobody = Network::open(options);
  ASSERT_FALSE(nobody.ok());
  EXPECT_NE(nobody.error().message.find("auth.conf"), std::string::npos) << nobody.error().message;
}

TEST(SecretFile, IsYarpsAndNobodyElseMayReadIt) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("auth" + std::to_string(getpid()) + ".conf");
  const auto write = [&](const std::string& text, mode_t mode) {
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
  };
  write("[AUTH]\nkey open_sesame\n", 0600);
  const Result<std::string> secret = read_secret(path);
  ASSERT_TRUE(secret.ok()) << secret.error().message;
  EXPECT_EQ(*secret, "open_sesame");
  write("[AUTH]\nkey open_sesame\n", 0644);
  EXPECT_FALSE(read_secret(path).ok());
  write("[AUTH]\nkey short\n", 0600);
  EXPECT_FALSE(read_secret(path).ok());
  write("key open_sesame\n", 0600);
  EXPECT_FALSE(read_secret(path).ok());
  std::filesystem::remove(path);
  EXPECT_FALSE(read_secret(path).ok());
}

}  // namespace
}  // namespace nido::yarp::test
