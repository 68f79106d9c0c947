#include <algorithm>
#include <numeric>

#include "delay_log.h"
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
  const auto& delays = connections[0].delays;
  EXPECT_EQ(std::accumulate(delays.begin(), delays.end(), std::uint64_t{0}), 10U) << "each has its delay";
  EXPECT_EQ(delays[0], 0U) << "nothing travels in less than a microsecond";
}

TEST(DelayLog, CountsWhatCameAfterItsTime) {
  constexpr std::int64_t kMs = 1'000'000;
  ConnectionCounters counters;
  DelayLog log;
  log.note(1000 * kMs, 1003 * kMs, counters);  // the first has no rhythm yet
  log.note(1010 * kMs, 1011 * kMs, counters);
  EXPECT_EQ(counters.late, 0U);
  log.note(1020 * kMs, 1035 * kMs, counters);  // the one of 1030 was due
  EXPECT_EQ(counters.late, 1U);
  log.note(1030 * kMs, 1030 * kMs, counters);
  log.note(1040 * kMs, 9'000'000 * kMs, counters);
  EXPECT_EQ(counters.late, 2U);
  EXPECT_EQ(counters.delays[0], 1U);
  EXPECT_EQ(counters.delays[10], 1U) << "1 ms is from 512 to less than 1024 us, rounded down";
  EXPECT_EQ(counters.delays[12], 1U) << "3 ms";
  EXPECT_EQ(counters.delays[14], 1U) << "15 ms";
  EXPECT_EQ(counters.delays.back(), 1U);
  EXPECT_EQ(delay_text(counters), "late=2 us=1:1,1024:1,4096:1,16384:1,33554432:1");
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

TEST(Port, FansInAndOut) {
  auto node = make_node("hub");
  auto a = make_output<String>(*node, "/hub/a:o", Profile::kEvent);
  auto b = make_output<String>(*node, "/hub/b:o", Profile::kEvent);
  auto other = make_node("leaf");
  auto first = make_input<String>(*other, "/leaf/first:i", Profile::kEvent);
  auto second = make_input<String>(*other, "/leaf/second:i", Profile::kEvent);
  for (auto* in : {first.get(), second.get()}) {
    ASSERT_TRUE(in->connect("/hub/a:o").ok());
    ASSERT_TRUE(in->connect("/hub/b:o").ok());
  }
  ASSERT_TRUE(a->wait_for_readers(2, kPatience_s));
  ASSERT_TRUE(b->wait_for_readers(2, kPatience_s));
  ASSERT_TRUE(first->wait_for_sources(2, kPatience_s));
  ASSERT_TRUE(second->wait_for_sources(2, kPatience_s));
  ASSERT_TRUE(a->write(text("from a")).ok());
  ASSERT_TRUE(b->write(text("from b")).ok());
  for (auto* in : {first.get(), second.get()}) {
    std::vector<std::string> got;
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(in->wait_for_message(kPatience_s));
      got.push_back(in->take()->data());
    }
    std::sort(got.begin(), got.end());
    EXPECT_EQ(got, (std::vector<std::string>{"from a", "from b"}));
  }
}

TEST(Port, LateJoinerGetsTheLastState) {
  auto node = make_node("keeper");
  auto out = make_output<String>(*node, "/keeper/state:o", Profile::kState);
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(out->write(text("state " + std::to_string(i))).ok());
  }
  auto late = make_node("late");
  auto in = make_input<String>(*late, "/late/state:i", Profile::kState);
  ASSERT_TRUE(in->connect("/keeper/state:o").ok());
  ASSERT_TRUE(in->wait_for_message(kPatience_s));
  EXPECT_EQ(in->take()->data(), "state 5");
  EXPECT_FALSE(in->take().has_value());
  EXPECT_EQ(in->connections().at(0).lost, 0U) << "what was before the connection is no loss";
}

TEST(Port, AFloodIsBoundedAndCountedAsLoss) {
  auto node = make_node("flood");
  auto out = make_output<String>(*node, "/flood/out:o", Profile::kCommand);
  auto other = make_node("slow");
  constexpr std::size_t kDepth = 8;
  auto in = make_input<String>(*other, "/slow/in:i", Profile::kCommand, kDepth);
  ASSERT_TRUE(in->connect("/flood/out:o").ok());
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  constexpr int kCount = 5000;
  for (int i = 1; i <= kCount; ++i) {
    // on a busy machine the reader may fall behind: the sender is told, and tries again
    auto status = out->write(text(std::to_string(i)));
    for (int attempt = 0; !status && attempt < 50; ++attempt) {
      EXPECT_EQ(status.error().code, ErrorCode::kTimeout);
      EXPECT_NE(status.error().message.find("/flood/out:o"), std::string::npos);
      status = out->write(text(std::to_string(i)));
    }
    ASSERT_TRUE(status.ok()) << i << " " << status.error().message;
  }
  // the last message is there when all have passed
  std::vector<std::string> kept;
  while (kept.empty() || kept.back() != std::to_string(kCount)) {
    ASSERT_TRUE(in->wait_for_message(kPatience_s));
    kept.push_back(in->take()->data());
  }
  const auto counters = in->connections().at(0);
  EXPECT_EQ(counters.received, static_cast<std::uint64_t>(kCount));
  EXPECT_EQ(counters.lost + kept.size(), static_cast<std::uint64_t>(kCount))
      << "every message was taken or counted";
}

TEST(Port, DisconnectEndsTheFlow) {
  auto node = make_node("speaker");
  auto out = make_output<String>(*node, "/speaker/out:o", Profile::kEvent);
  auto other = make_node("hearer");
  auto in = make_input<String>(*other, "/hearer/in:i", Profile::kEvent);
  ASSERT_TRUE(in->connect("/speaker/out:o").ok());
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(in->disconnect("/speaker/out:o").ok());
  EXPECT_TRUE(in->connections().empty());
  const auto again = in->disconnect("/speaker/out:o");
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kNotFound);
  EXPECT_NE(again.error().message.find("/speaker/out:o"), std::string::npos);
}

TEST(Port, AMisfitIsRefusedInWordsThatNameBothEnds) {
  auto node = make_node("giver");
  auto out = make_output<String>(*node, "/giver/out:o", Profile::kSensor);
  auto other = make_node("taker");
  auto wrong_profile = make_input<String>(*other, "/taker/profile:i", Profile::kCommand);
  auto wrong_type = make_input<msgs::Image>(*other, "/taker/type:i", Profile::kSensor);
  auto fine = make_input<String>(*other, "/taker/fine:i", Profile::kSensor);
  ASSERT_TRUE(fine->connect("/giver/out:o").ok());
  ASSERT_TRUE(fine->wait_for_sources(1, kPatience_s)) << "from here on the output is known to the taker";
  const auto profile = wrong_profile->connect("/giver/out:o");
  const auto type = wrong_type->connect("/giver/out:o");
  for (const auto* status : {&profile, &type}) {
    ASSERT_FALSE(status->ok());
    EXPECT_EQ(status->error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(status->error().message.find("/giver/out:o (node giver)"), std::string::npos)
        << status->error().message;
    EXPECT_NE(status->error().message.find("(node taker)"), std::string::npos) << status->error().message;
  }
  EXPECT_NE(profile.error().message.find("profile command"), std::string::npos) << profile.error().message;
  EXPECT_NE(type.error().message.find("sensor_msgs/msg/Image"), std::string::npos) << type.error().message;
}

TEST(Port, ImagesArriveWholeAtSixtyHertz) {
  auto node = make_node("camera");
  auto out = make_output<msgs::Image>(*node, "/camera/image:o", Profile::kSensor);
  auto other = make_node("viewer");
  auto in = make_input<msgs::Image>(*other, "/viewer/image:i", Profile::kSensor);
  ASSERT_TRUE(in->connect("/camera/image:o").ok());
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  msgs::Image image;
  image.width(320);
  image.height(240);
  image.encoding("rgb8");
  image.step(960);
  image.data().resize(320 * 240 * 3);
  for (int frame = 0; frame < 60; ++frame) {
    for (std::size_t i = 0; i < image.data().size(); ++i) {
      image.data()[i] = static_cast<std::uint8_t>(i * 7 + static_cast<std::size_t>(frame));
    }
    ASSERT_TRUE(out->write(image).ok());
    ASSERT_TRUE(in->wait_for_message(kPatience_s)) << frame;
    const auto got = in->take();
    ASSERT_TRUE(got.has_value());
    ASSERT_EQ(got->data(), image.data()) << frame;
  }
}

}  // namespace

}  // namespace nido::testing
