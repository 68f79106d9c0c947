#include "nido/middleware/parameter.h"

#include "test_node.h"

namespace nido::testing {

namespace {

std::string ask(Node& other, const std::string& command) {
  const auto answer = other.call("/worker/control", command, kPatience_s);
  return answer ? *answer : "no answer: " + answer.error().message;
}

TEST(Parameters, WrongTypeIsRefusedByName) {
  auto options = options_of("worker");
  options.parameters["camera"]["width"] = "wide";
  auto node = make_node(options);
  const auto width = node->parameter<int>("camera.width", 320);
  ASSERT_FALSE(width.ok());
  EXPECT_EQ(width.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(width.error().message, "parameter camera.width of node worker cannot be 'wide': int is expected");
}

TEST(Parameters, ValuesOutsideOfTheRangeAreRefused) {
  auto options = options_of("worker");
  options.parameters["speed"] = 3;
  options.parameters["side"] = "top";
  options.parameters["gains"] = std::vector<double>{1, -1};
  options.parameters["share"] = ".nan";
  auto node = make_node(options);
  const auto message = [](const auto& result) { return result.ok() ? "taken" : result.error().message; };
  EXPECT_EQ(message(node->parameter<double>("speed", 1, {.unit = "rad/s", .min = 0, .max = 2})),
            "parameter speed of node worker cannot be '3': from 0 to 2 rad/s is allowed");
  EXPECT_EQ(message(node->parameter<std::string>("side", "left", {.choices = {"left", "right"}})),
            "parameter side of node worker cannot be 'top': one of left, right is allowed");
  EXPECT_EQ(message(node->parameter<std::vector<double>>("gains", {}, {.min = 0})),
            "parameter gains of node worker cannot be '[1, -1]': at least 0 is allowed");
  EXPECT_EQ(message(node->parameter<double>("share", 1, {.max = 1})),
            "parameter share of node worker cannot be '.nan': a number is expected");
  EXPECT_EQ(message(node->parameter<double>("speed", 1, {.max = 3})), "taken");
}

TEST(Parameters, AreDescribedToOthers) {
  auto options = options_of("worker");
  options.parameters["camera"]["size"] = std::vector<int>{640, 480};
  auto node = make_node(options);
  auto other = make_node("other");
  ASSERT_TRUE(node->parameter<std::vector<int>>("camera.size", {320, 240}, {.unit = "px"}).ok());
  ASSERT_TRUE(node->parameter<std::vector<double>>("weights", {0.1, 0.3}).ok());
  ASSERT_TRUE(node->live_parameter<double>("speed", 0.5, {"how fast it turns", "rad/s", 0, 2, {}}).ok());
  const std::string answer = ask(*other, "parameters");
  ASSERT_TRUE(answer.starts_with("[ok]\n")) << answer;
  const auto parameters = parse_parameters(answer.substr(5));
  ASSERT_TRUE(parameters.ok()) << parameters.error().message;
  ASSERT_EQ(parameters->size(), 3U);
  EXPECT_EQ((*parameters)[2].value, "[0.1, 0.3]");
  EXPECT_EQ((*parameters)[0].key, "camera.size");
  EXPECT_EQ((*parameters)[0].type, "list of int");
  EXPECT_EQ((*parameters)[0].value, "[640, 480]");
  EXPECT_FALSE((*parameters)[0].live);
  const ParameterDescription& speed = (*parameters)[1];
  EXPECT_EQ(speed.type, "double");
  EXPECT_EQ(speed.value, "0.5");
  EXPECT_TRUE(speed.live);
  EXPECT_EQ(speed.about.about, "how fast it turns");
  EXPECT_EQ(speed.about.unit, "rad/s");
  EXPECT_EQ(speed.about.min, 0.0);
  EXPECT_EQ(speed.about.max, 2.0);

  // what is saved makes the same node again
  auto again = options_of("again");
  again.parameters = parameter_tree(*parameters);
  auto copy = make_node(again);
  EXPECT_EQ(copy->parameter<std::vector<int>>("camera.size", {}).value(), (std::vector<int>{640, 480}));
  EXPECT_EQ(copy->parameter<double>("speed", 0).value(), 0.5);
}

TEST(Parameters, LiveOnesAreSetWithinTheirRangeAndOthersNot) {
  auto node = make_node("worker");
  auto other = make_node("other");
  EXPECT_EQ(ask(*other, "set speed 1"),
            "[fail] node worker has no parameter speed; it has none that can be set while it runs");
  const auto speed = node->live_parameter<double>("speed", 0.5, {.min = 0, .max = 2});
  ASSERT_TRUE(speed.ok());
  ASSERT_TRUE(node->parameter<int>("size", 3).ok());
  EXPECT_EQ(ask(*other, "set speed 1.5"), "[ok]");
  EXPECT_EQ((*speed)->get(), 1.5);
  EXPECT_EQ(ask(*other, "set speed 2.5"),
            "[fail] parameter speed of node worker cannot be '2.5': from 0 to 2 is allowed");
  EXPECT_EQ(ask(*other, "set speed [1"), "[fail] '[1' is no value: end of sequence flow not found");
  EXPECT_EQ(ask(*other, "set size 4"),
            "[fail] node worker reads its parameter size only when it starts; those that can be set while it "
            "runs: speed");
  EXPECT_EQ((*speed)->get(), 1.5);
  EXPECT_NE(ask(*other, "parameters").find("value: 1.5"), std::string::npos);
}

}  // namespace

}  // namespace nido::testing
