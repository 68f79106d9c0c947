#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

class EveryProfile : public ::testing::TestWithParam<Profile> {};

TEST_P(EveryProfile, CarriesMessagesInOrder) {
  auto sender = make_node("sender");
  auto receiver = make_node("receiver");
  auto out = make_output<String>(*sender, "/sender/words:o", GetParam());
  auto in = make_input<String>(*receiver, "/receiver/words:i", GetParam());
  ASSERT_TRUE(in->connect("/sender/words:o").ok());
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  for (int i = 1; i <= 10; ++i) {
    ASSERT_TRUE(out->write(text("word " + std::to_string(i))).ok());
    ASSERT_TRUE(in->wait_for_message(kPatience_s)) << i;
    const auto received = in->take_received();
    ASSERT_TRUE(received.has_value());
    EXPECT_EQ(received->message.data(), "word " + std::to_string(i));
    EXPECT_EQ(received->source, "/sender/words:o");
    EXPECT_EQ(received->sequence, static_cast<std::uint64_t>(i));
    EXPECT_GT(received->source_time.seconds(), 1e9);
  }
  EXPECT_FALSE(in->take().has_value());
  const auto connections = in->connections();
  ASSERT_EQ(connections.size(), 1U);
  EXPECT_EQ(connections[0].received, 10U);
  EXPECT_EQ(connections[0].lost, 0U);
  EXPECT_TRUE(connections[0].live);
}

TEST_P(EveryProfile, ConnectsBeforeTheSourceExists) {
  auto receiver = make_node("receiver");
  auto in = make_input<String>(*receiver, "/receiver/early:i", GetParam());
  ASSERT_TRUE(in->connect("/sender/late:o").ok());
  ASSERT_TRUE(in->connect("/sender/late:o").ok()) << "connecting twice is no error";
  EXPECT_FALSE(in->connections().at(0).live);
  auto sender = make_node("sender");
  auto out = make_output<String>(*sender, "/sender/late:o", GetParam());
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  ASSERT_TRUE(out->write(text("hello")).ok());
  ASSERT_TRUE(in->wait_for_message(kPatience_s));
  EXPECT_EQ(in->take()->data(), "hello");
}

INSTANTIATE_TEST_SUITE_P(Ports, EveryProfile,
                         ::testing::Values(Profile::kSensor, Profile::kState, Profile::kCommand,
                                           Profile::kEvent));

}  // namespace

}  // namespace nido::testing
