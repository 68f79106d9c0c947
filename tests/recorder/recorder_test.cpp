#include "nido/recorder/recorder.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "contents.h"
#include "nido/recorder/replayer.h"
#include "temp_folder.h"
#include "test_node.h"

namespace nido {
namespace {

using nido::test::contents_of;
using nido::test::data_of;
using nido::test::TempFolder;
using nido::testing::kPatience_s;
using nido::testing::make_node;
using nido::testing::make_output;
using nido::testing::options_of;
using nido::testing::text;

std::unique_ptr<Node> hidden_node(const std::string& name) {
  auto options = options_of(name);
  options.hidden = true;
  return make_node(options);
}

// A recorder with what it stands on.
struct Rig {
  explicit Rig(RecorderOptions options) : looker(hidden_node("looker")) {
    auto opened_directory = Directory::open(*looker);
    EXPECT_TRUE(opened_directory.ok());
    directory = std::move(*opened_directory);
    auto opened = Recorder::open(*looker, *directory, std::move(options));
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    if (opened) recorder = std::move(*opened);
  }
  // Polls until the condition holds.
  template <class Condition>
  bool poll_until(const Condition& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      EXPECT_TRUE(recorder->poll().ok());
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  [[nodiscard]] RecordedPort port(const std::string& name) const {
    for (const auto& port : recorder->ports()) {
      if (port.name == name) return port;
    }
    return {};
  }
  std::unique_ptr<Node> looker;
  std::unique_ptr<Directory> directory;
  std::unique_ptr<Recorder> recorder;
};

RecorderOptions into(const std::string& file, std::vector<std::string> ports) {
  RecorderOptions options;
  options.file = file;
  options.ports = std::move(ports);
  return options;
}

msgs::JointState joints(int n) {
  msgs::JointState state;
  for (int i = 0; i < n; ++i) {
    state.name().push_back("joint_" + std::to_string(i));
    state.position().push_back(0.1 * i);
  }
  return state;
}

TEST(Recorder, TakesAPortThatAppearsWhileItRecords) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  Rig rig(into(file, {"/source/joints:o", "/source/text"}));
  EXPECT_EQ(rig.recorder->missing(), (std::vector<std::string>{"/source/joints:o", "/source/text"}));
  auto source = make_node("source");
  auto output = make_output<msgs::JointState>(*source, "/source/joints:o", Profile::kEvent, 64);
  ASSERT_TRUE(rig.poll_until([&] { return output->reader_count() == 1; }));
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(output->write(joints(i)).ok());
  ASSERT_TRUE(rig.poll_until([&] { return rig.port("/source/joints:o").messages == 10; }));
  // one more, later, by the name without its ending
  auto words = make_output<msgs::String>(*source, "/source/text:o", Profile::kState);
  ASSERT_TRUE(words->write(text("the last one")).ok());
  ASSERT_TRUE(rig.poll_until([&] { return rig.port("/source/text:o").messages == 1; }));
  EXPECT_TRUE(rig.recorder->missing().empty());
  ASSERT_TRUE(rig.recorder->close().ok());
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok());
  const auto contents = contents_of(**reader);
  const auto& messages = contents.at("/source/joints:o");
  ASSERT_EQ(messages.size(), 10U);
  for (std::uint32_t i = 0; i < 10; ++i) {
    EXPECT_EQ(messages[i].sequence, i + 1);
    EXPECT_GE(messages[i].log_time_ns, messages[i].publish_time_ns);
  }
  // CDR, little-endian
  EXPECT_EQ(messages[0].data.substr(0, 4), std::string("\0\1\0\0", 4));
  for (const auto& [id, channel] : (*reader)->channels()) {
    EXPECT_EQ(channel.message_encoding, "cdr");
    EXPECT_EQ(channel.metadata.at("node"), "source");
    const auto& schema = (*reader)->schemas().at(channel.schema_id);
    EXPECT_EQ(schema.encoding, "omgidl");
    EXPECT_NE(schema.data.find("struct"), std::string::npos);
  }
  EXPECT_EQ((*reader)->metadata_named("nido.losses")->at("total"), "0");
  EXPECT_EQ((*reader)->metadata_named("nido.recording")->at("clock"), "wall");
}

TEST(Recorder, WhatIsReplayedIsTheSameBitForBit) {
  const TempFolder folder;
  const std::string first = (folder.path() / "first.mcap").string();
  const std::string second = (folder.path() / "second.mcap").string();
  {
    Rig rig(into(first, {}));
    auto source = make_node("source");
    auto one = make_output<msgs::JointState>(*source, "/source/joints:o", Profile::kEvent, 64);
    auto two = make_output<msgs::String>(*source, "/source/text:o", Profile::kCommand, 64);
    auto three = make_output<msgs::Image>(*source, "/source/eye:o", Profile::kEvent, 64);
    ASSERT_TRUE(rig.poll_until(
        [&] { return one->reader_count() + two->reader_count() + three->reader_count() == 3; }));
    msgs::Image image;
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(one->write(joints(i)).ok());
      // lengths of every remainder by four
      ASSERT_TRUE(two->write(text(std::string(static_cast<std::size_t>(i), 'x'))).ok());
      image.data().assign(static_cast<std::size_t>(i) * 10'000, static_cast<std::uint8_t>(i));
      ASSERT_TRUE(three->write(image).ok());
      ASSERT_TRUE(
          rig.poll_until([&] { return rig.port("/source/eye:o").messages == static_cast<unsigned>(i + 1); }));
    }
    ASSERT_TRUE(rig.poll_until([&] {
      return rig.port("/source/joints:o").messages == 20 && rig.port("/source/text:o").messages == 20;
    }));
    ASSERT_TRUE(rig.recorder->close().ok());
  }
  {
    Rig rig(into(second, {"/source/*"}));
    auto node = make_node("replay");
    auto side = hidden_node("side");
    auto reader = mcap::Reader::open(first);
    ASSERT_TRUE(reader.ok());
    ReplayOptions options;
    options.ports = {"/source/*"};
    options.rate = 20.0;
    options.readers = 1;
    options.wait_s = kPatience_s;
    auto replayer = Replayer::open(*node, *side, std::move(*reader), options);
    ASSERT_TRUE(replayer.ok()) << replayer.error().message;
    Status status;
    std::thread player([&] { status = (*replayer)->run([](const auto&) { return false; }); });
    EXPECT_TRUE(rig.poll_until([&] {
      return rig.port("/source/joints:o").messages == 20 && rig.port("/source/text:o").messages == 20 &&
             rig.port("/source/eye:o").messages == 20;
    }));
    player.join();
    EXPECT_TRUE(status.ok()) << status.error().message;
    EXPECT_EQ((*replayer)->progress().messages, 60U);
    ASSERT_TRUE(rig.recorder->close().ok());
    EXPECT_EQ(rig.port("/source/text:o").profile, "command");
  }
  const auto before = contents_of(first);
  const auto after = contents_of(second);
  for (const std::string name : {"/source/joints:o", "/source/text:o", "/source/eye:o"}) {
    EXPECT_EQ(data_of(before.at(name)), data_of(after.at(name))) << name;
  }
}

TEST(Recorder, ReplayNeedsTheNamesForItself) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  {
    auto writer = mcap::Writer::create(file);
    ASSERT_TRUE(writer.ok());
    const auto channel =
        (*writer)->add_channel({0, 0, "/source/text:o", "cdr", {{"type", "std_msgs/msg/String"}}});
    ASSERT_TRUE(
        (*writer)->write(mcap::Message{*channel, 1, 1, 1, std::string_view("\0\1\0\0\1\0\0\0\0", 9)}).ok());
    const auto odd = (*writer)->add_channel({0, 0, "/odd", "json", {}});
    ASSERT_TRUE((*writer)->write(mcap::Message{*odd, 1, 1, 1, "{}"}).ok());
  }
  auto node = make_node("replay");
  auto side = hidden_node("side");
  const auto open = [&](std::vector<std::string> ports, std::vector<std::string> except) {
    auto reader = mcap::Reader::open(file);
    EXPECT_TRUE(reader.ok());
    ReplayOptions options;
    options.ports = std::move(ports);
    options.except = std::move(except);
    return Replayer::open(*node, *side, std::move(*reader), options);
  };
  {
    auto owner = make_node("owner");
    auto output = make_output<msgs::String>(*owner, "/source/text:o", Profile::kEvent);
    const auto refused = open({"/source/text:o"}, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kTaken);
    EXPECT_NE(refused.error().message.find("/source/text:o has an owner"), std::string::npos);
  }
  EXPECT_EQ(open({}, {}).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(open({"/no/such"}, {}).error().code, ErrorCode::kNotFound);
  EXPECT_TRUE(open({}, {"/odd"}).ok());
}

TEST(Recorder, WhatDoesNotFitIsCountedAsLost) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  RecorderOptions options = into(file, {"/source/text:o"});
  options.memory_bytes = 20'000;
  Rig rig(options);
  auto source = make_node("source");
  auto output = make_output<msgs::String>(*source, "/source/text:o", Profile::kCommand, 64);
  ASSERT_TRUE(rig.poll_until([&] { return output->reader_count() == 1; }));
  // the recorder sleeps while they come
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(output->write(text(std::string(5'000, 'x'))).ok());
  auto probe = hidden_node("probe");
  auto arrived = probe->open_input<msgs::String>("/probe/text:i", Profile::kCommand, 100);
  ASSERT_TRUE(arrived.ok());
  ASSERT_TRUE((*arrived)->connect("/source/text:o").ok());
  ASSERT_TRUE((*arrived)->wait_for_sources(1, kPatience_s));
  ASSERT_TRUE(output->wait_for_readers(2, kPatience_s));
  ASSERT_TRUE(output->write(text("end")).ok());
  ASSERT_TRUE((*arrived)->wait_for_message(kPatience_s));
  ASSERT_TRUE(rig.poll_until([&] {
    const auto port = rig.port("/source/text:o");
    return port.messages + port.lost >= 31;
  }));
  const auto port = rig.port("/source/text:o");
  EXPECT_EQ(port.messages + port.lost, 31U);
  EXPECT_GE(port.lost, 25U);
  EXPECT_GE(port.messages, 3U);
  ASSERT_TRUE(rig.recorder->close().ok());
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->message_count(), port.messages);
  EXPECT_EQ((*reader)->metadata_named("nido.losses")->at("/source/text:o"), std::to_string(port.lost));
  EXPECT_EQ((*reader)->metadata_named("nido.losses")->at("total"), std::to_string(port.lost));
}

TEST(Recorder, SimulatedTimeIsTheTimeOfTheMessages) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  auto robot = make_node("robot");
  auto output = make_output<msgs::String>(*robot, "/robot/text:o", Profile::kEvent, 64);
  ASSERT_TRUE(robot->publish_clock(Time::from_seconds(100)).ok());
  auto options = into(file, {"/robot/*"});
  options.clock = RecorderOptions::Clock::kSimulated;
  Rig rig(options);
  EXPECT_TRUE(rig.recorder->on_simulated_time());
  ASSERT_TRUE(rig.poll_until([&] { return output->reader_count() == 1; }));
  for (const double time_s : {101.0, 102.5, 103.25}) {
    const Time time = Time::from_seconds(time_s);
    ASSERT_TRUE(robot->publish_clock(time).ok());
    // the clock and the port are two ways: some messages may be there before the clock
    ASSERT_TRUE(rig.poll_until([&] {
      EXPECT_TRUE(output->write(text("word")).ok());
      return rig.port("/robot/text:o").last_ns == static_cast<std::uint64_t>(time.ns);
    }));
  }
  ASSERT_TRUE(rig.recorder->close().ok());
  const auto contents = contents_of(file);
  // /clock is followed, but was not asked for
  EXPECT_EQ(contents.size(), 1U);
  const auto& messages = contents.at("/robot/text:o");
  ASSERT_GE(messages.size(), 3U);
  EXPECT_EQ(messages.back().log_time_ns, 103'250'000'000U);
  EXPECT_GE(messages.front().log_time_ns, 100'000'000'000U);
  for (std::size_t i = 1; i < messages.size(); ++i)
    EXPECT_GE(messages[i].log_time_ns, messages[i - 1].log_time_ns);
}

TEST(Recorder, RefusesWhatIsNoOutput) {
  const TempFolder folder;
  auto looker = hidden_node("looker");
  auto directory = Directory::open(*looker);
  ASSERT_TRUE(directory.ok());
  const auto open = [&](const std::string& port, const std::string& file) {
    return Recorder::open(*looker, **directory, into(file, {port}));
  };
  const std::string file = (folder.path() / "a.mcap").string();
  EXPECT_NE(open("/vision/left:i", file).error().message.find("is an input"), std::string::npos);
  EXPECT_EQ(open("no name", file).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(open("/a:o", (folder.path() / "no" / "a.mcap").string()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(open("/a:o", folder.path().string()).error().code, ErrorCode::kInvalidArgument);
  // what is refused leaves no file
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Recorder, AnOldFileIsKept) {
  const TempFolder folder;
  const std::string file = folder.write("a.mcap", "old");
  ASSERT_TRUE(keep_old_file(file).ok());
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(nido::test::read_text(file + "~"), "old");
  EXPECT_TRUE(keep_old_file(file).ok());
}

TEST(Recorder, PatternsChoosePorts) {
  EXPECT_TRUE(port_matches("/icubSim/cam/left/image:o", {"/icubSim/cam/*"}));
  EXPECT_TRUE(port_matches("/icubSim/cam/left/image:o", {"/no", "/icubSim/cam/left/image"}));
  EXPECT_TRUE(port_matches("/icubSim/cam/left/image:o", {"*image:o"}));
  EXPECT_FALSE(port_matches("/icubSim/cam/left/image:o", {"/icubSim/cam"}));
  EXPECT_FALSE(port_matches("/icubSim/cam/left/image:o", {}));
}

// Two nodes in lockstep, a recorder that takes part, and messages that the ticks cannot wait for.
TEST(Recorder, InLockstepEveryMessageIsRecorded) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  constexpr int kTicks = 200;
  auto owner_options = options_of("robot");
  owner_options.clock = ClockMode::kLockstep;
  owner_options.parameters["lockstep"]["nodes"].push_back("recorder");
  owner_options.parameters["lockstep"]["nodes"].push_back("worker");
  auto robot = make_node(owner_options);
  auto member_options = options_of("recorder");
  member_options.clock = ClockMode::kLockstep;
  member_options.period_s = 0.0001;
  auto member = make_node(member_options);
  auto worker_options = options_of("worker");
  worker_options.clock = ClockMode::kLockstep;
  auto worker = make_node(worker_options);
  auto state = make_output<msgs::JointState>(*robot, "/robot/state:o", Profile::kSensor);
  auto echo = make_output<msgs::String>(*worker, "/worker/text:o", Profile::kSensor);
  for (auto* node : {robot.get(), member.get(), worker.get()}) node->set_ready();

  auto looker = hidden_node("looker");
  auto directory = Directory::open(*looker);
  ASSERT_TRUE(directory.ok());
  auto options = into(file, {});
  options.clock = RecorderOptions::Clock::kSimulated;
  auto recorder = Recorder::open(*looker, **directory, options, member.get());
  ASSERT_TRUE(recorder.ok()) << recorder.error().message;

  std::thread owner([&] {
    for (int k = 1; k <= kTicks; ++k) {
      EXPECT_TRUE(state->write(joints(k % 7)).ok());
      const auto status = robot->publish_clock({10'000'000LL * k});
      ASSERT_TRUE(status.ok()) << "tick " << k << ": " << status.error().message;
    }
  });
  std::thread works(
      [&] { (void)worker->run([&](Time now) { return echo->write(text(std::to_string(now.ns))); }); });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!(*recorder)->follows({"robot", "worker"}) && std::chrono::steady_clock::now() < deadline) {
    ASSERT_TRUE((*recorder)->poll().ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::thread records(
      [&] { EXPECT_TRUE(member->run([&](Time now) { return (*recorder)->take_tick(now); }).ok()); });
  owner.join();
  worker->stop();
  works.join();
  member->stop();
  records.join();
  ASSERT_TRUE((*recorder)->close().ok());
  for (const auto& port : (*recorder)->ports()) {
    EXPECT_EQ(port.lost, 0U) << port.name;
    EXPECT_EQ(port.refused, "") << port.name;
  }
  auto contents = contents_of(file);
  ASSERT_EQ(contents["/clock"].size(), static_cast<std::size_t>(kTicks));
  for (std::size_t i = 0; i < contents["/clock"].size(); ++i) {
    EXPECT_EQ(contents["/clock"][i].log_time_ns, 10'000'000U * (i + 1));
  }
  // what was written before the first tick is a matter of chance to readers, and is not handed out
  EXPECT_EQ(contents["/robot/state:o"].size(), static_cast<std::size_t>(kTicks - 1));
  EXPECT_EQ(contents["/robot/state:o"].back().sequence, static_cast<std::uint32_t>(kTicks));
  // what came after the last tick is there, too
  EXPECT_EQ(contents["/worker/text:o"].size(), static_cast<std::size_t>(kTicks));
}

// A port of profile sensor at full speed, which alone would drop most of it.
TEST(Recorder, ReplayInLockstepLosesNothingAtFullSpeed) {
  const TempFolder folder;
  const std::string first = (folder.path() / "first.mcap").string();
  const std::string second = (folder.path() / "second.mcap").string();
  constexpr std::uint32_t kTicks = 200;
  constexpr std::uint32_t kEach = 5;
  {
    auto writer = mcap::Writer::create(first);
    ASSERT_TRUE(writer.ok());
    const auto channel = (*writer)->add_channel(
        {0, 0, "/eye:o", "cdr", {{"type", "other_msgs/msg/Thing"}, {"profile", "sensor"}}});
    for (std::uint32_t i = 0; i < kTicks * kEach; ++i) {
      const std::string data =
          std::string("\0\1\0\0", 4) + std::string(1 + i % 9, static_cast<char>(i % 251));
      const std::uint64_t time_ns = 10'000'000U * (1 + i / kEach);
      ASSERT_TRUE((*writer)->write(mcap::Message{*channel, i + 1, time_ns, time_ns, data}).ok());
    }
  }
  auto member_options = options_of("recorder");
  member_options.clock = ClockMode::kLockstep;
  member_options.period_s = 0.0001;
  auto member = make_node(member_options);
  member->set_ready();
  auto looker = hidden_node("looker");
  auto directory = Directory::open(*looker);
  ASSERT_TRUE(directory.ok());
  auto options = into(second, {});
  options.clock = RecorderOptions::Clock::kSimulated;
  auto recorder = Recorder::open(*looker, **directory, options, member.get());
  ASSERT_TRUE(recorder.ok()) << recorder.error().message;

  auto player_options = options_of("replay");
  player_options.clock = ClockMode::kLockstep;
  player_options.parameters["lockstep"]["nodes"].push_back("recorder");
  auto player = make_node(player_options);
  auto side = hidden_node("side");
  auto reader = mcap::Reader::open(first);
  ASSERT_TRUE(reader.ok());
  ReplayOptions replay;
  replay.rate.reset();
  auto replayer = Replayer::open(*player, *side, std::move(*reader), replay);
  ASSERT_TRUE(replayer.ok()) << replayer.error().message;
  player->set_ready();
  Status played;
  std::thread plays([&] { played = (*replayer)->run([](const auto&) { return false; }); });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!(*recorder)->follows({"replay"}) && std::chrono::steady_clock::now() < deadline) {
    ASSERT_TRUE((*recorder)->poll().ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::thread records([&] { (void)member->run([&](Time now) { return (*recorder)->take_tick(now); }); });
  plays.join();
  EXPECT_TRUE(played.ok()) << played.error().message;
  member->stop();
  records.join();
  ASSERT_TRUE((*recorder)->close().ok());
  auto before = contents_of(first)["/eye:o"];
  const auto after = contents_of(second)["/eye:o"];
  // what comes before the first tick is not handed out
  before.erase(before.begin(), before.begin() + kEach);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    // on the way messages are filled up to a multiple of four bytes
    EXPECT_EQ(after[i].data.substr(0, before[i].data.size()), before[i].data) << i;
    EXPECT_LT(after[i].data.size(), before[i].data.size() + 4) << i;
    EXPECT_EQ(after[i].log_time_ns, before[i].log_time_ns) << i;
  }
}

}  // namespace
}  // namespace nido
