#include "nido/middleware/directory.h"

#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

TEST(Directory, ListsNodesPortsAndCounters) {
  auto watcher = make_node("watcher");
  auto directory = Directory::open(*watcher);
  ASSERT_TRUE(directory.ok());
  {
    auto options = options_of("worker");
    options.parameters["speed"] = 3;
    auto worker = make_node(options);
    EXPECT_EQ(*worker->parameter<int>("speed", 1), 3);
    EXPECT_EQ(*worker->parameter<double>("limits.far_m", 0.5), 0.5);
    auto out = make_output<String>(*worker, "/worker/out:o", Profile::kEvent);
    ASSERT_TRUE(out->write(text("one")).ok());
    worker->set_ready();
    ASSERT_TRUE((*directory)
                    ->wait(
                        [](const Directory& all) {
                          const auto node = all.node("worker");
                          const auto owner = all.owner_of("/worker/out:o");
                          return node && node->state == "ready" && owner && owner->port.written == 1 &&
                                 node->parameters.size() == 2;
                        },
                        kPatience_s));
    const auto owner = (*directory)->owner_of("/worker/out:o");
    EXPECT_EQ(owner->node.pid, static_cast<std::uint32_t>(getpid()));
    EXPECT_EQ(owner->port.type, "std_msgs/msg/String");
    EXPECT_EQ(owner->port.direction, "output");
    EXPECT_EQ(owner->port.profile, "event");
    EXPECT_EQ(owner->node.parameters.at(0), "limits.far_m = 0.5");
    EXPECT_EQ(owner->node.parameters.at(1), "speed = 3");
    worker->set_failed("the motor is hot");
    EXPECT_TRUE((*directory)
                    ->wait(
                        [](const Directory& all) {
                          const auto node = all.node("worker");
                          return node && node->state == "failed" && node->detail == "the motor is hot";
                        },
                        kPatience_s));
  }
  EXPECT_TRUE((*directory)->wait([](const Directory& all) { return !all.node("worker"); }, kPatience_s))
      << "a node that ended is gone";
}

TEST(Directory, RewiresFromOutside) {
  auto source = make_node("source");
  auto out = make_output<String>(*source, "/source/out:o", Profile::kEvent);
  auto sink = make_node("sink");
  auto in = make_input<String>(*sink, "/sink/in:i", Profile::kEvent);
  NodeOptions hidden = options_of("tool");
  hidden.hidden = true;
  auto tool = make_node(hidden);
  auto directory = Directory::open(*tool);
  ASSERT_TRUE(directory.ok());

  auto status = (*directory)->connect("/source/out:o", "/sink/in:i", kPatience_s);
  ASSERT_TRUE(status.ok()) << status.error().message;
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  ASSERT_TRUE(out->write(text("wired")).ok());
  ASSERT_TRUE(in->wait_for_message(kPatience_s));
  EXPECT_EQ(in->take()->data(), "wired");

  ASSERT_TRUE((*directory)->disconnect("/source/out:o", "/sink/in:i", kPatience_s).ok());
  EXPECT_TRUE(in->connections().empty());

  status = (*directory)->disconnect("/source/out:o", "/sink/in:i", kPatience_s);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kNotFound);
  status = (*directory)->connect("/source/out:o", "/nowhere/in:i", 0.2);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kNotFound);
  EXPECT_NE(status.error().message.find("/nowhere/in:i"), std::string::npos);
  status = (*directory)->connect("/sink/in:i", "/source/out:o", kPatience_s);
  ASSERT_FALSE(status.ok()) << "the wrong way round";
  EXPECT_FALSE((*directory)->node("tool").has_value()) << "a hidden node is not announced";
}

TEST(Control, AnswersAndRefuses) {
  auto node = make_node("worker");
  auto other = make_node("other");
  const auto ask = [&](const std::string& command) {
    const auto answer = other->call("/worker/control", command, kPatience_s);
    return answer ? *answer : "no answer: " + answer.error().message;
  };
  EXPECT_TRUE(ask("info").starts_with("[ok] worker starting"));
  EXPECT_TRUE(ask("dance").starts_with("[fail] 'dance' is not understood"));
  EXPECT_EQ(ask("stop"), "[ok]");
  EXPECT_TRUE(node->run([](Time) { return Status(); }).ok()) << "returns, as it was stopped";
}

}  // namespace

}  // namespace nido::testing
