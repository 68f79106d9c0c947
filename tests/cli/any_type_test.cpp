#include "nido/cli/any_type.h"

#include <gtest/gtest.h>

#include "nido/msgs/types.h"

namespace nido {
namespace {

#define NIDO_COUNT(package, folder, type) +1
constexpr std::size_t kTypeCount = 0 NIDO_MSGS(NIDO_COUNT);
#undef NIDO_COUNT

TEST(AnyType, KnowsEveryMessageByBothNames) {
  EXPECT_EQ(any_types().size(), kTypeCount);
  ASSERT_NE(find_any_type("sensor_msgs/msg/Image"), nullptr);
  EXPECT_EQ(find_any_type("sensor_msgs/msg/Image"), find_any_type("sensor_msgs::msg::dds_::Image_"));
  EXPECT_EQ(find_any_type("sensor_msgs/msg/Imagination"), nullptr);
}

TEST(AnyType, EveryMessageSurvivesTheWayToJsonAndBack) {
  for (const auto& type : any_types()) {
    auto message = type.type.make_message();
    const Json json = type.to_json(message.get(), 0);
    ASSERT_TRUE(json.is_object()) << type.name;
    EXPECT_EQ(json.size(), type.fields.size()) << type.name;
    auto again = type.type.make_message();
    const Status status = type.from_json(json, again.get());
    ASSERT_TRUE(status.ok()) << type.name << ": " << status.error().message;
    EXPECT_EQ(type.to_json(again.get(), 0), json) << type.name;
    EXPECT_GT(type.wire_size(message.get()), 0U) << type.name;
  }
}

TEST(AnyType, FieldsOfEveryKindAreSetAndRead) {
  const AnyType* type = find_any_type("nido_msgs/msg/Touch");
  ASSERT_NE(type, nullptr);
  msgs::Touch touch;
  const Json json = {{"header", {{"stamp", {{"sec", 3}, {"nanosec", 4}}}, {"frame_id", "hand"}}},
                     {"on", {true, false}},
                     {"force_n", {0.5, 2}}};
  const Status status = type->from_json(json, &touch);
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(touch.header().stamp().nanosec(), 4U);
  EXPECT_EQ(touch.header().frame_id(), "hand");
  EXPECT_TRUE(touch.on()[0]);
  EXPECT_FALSE(touch.on()[1]);
  EXPECT_EQ(touch.force_n()[1], 2.0);
}

TEST(AnyType, LongSequencesAreCutInTextAndCompleteInJson) {
  msgs::Image image;
  image.data().assign(1000, 7);
  const AnyType* type = find_any_type("sensor_msgs/msg/Image");
  EXPECT_EQ(type->to_json(&image, 0)["data"].size(), 1000U);
  const std::string text = text_of(type->to_json(&image, 24));
  EXPECT_NE(text.find("data: [7,7,7,7, ...] (1000 in all)"), std::string::npos) << text;
}

struct Wrong {
  const char* type;
  const char* json;
  const char* sentence;
};
class WrongMessages : public testing::TestWithParam<Wrong> {};
TEST_P(WrongMessages, AreRefusedByFieldFoundAndAllowed) {
  const AnyType* type = find_any_type(GetParam().type);
  ASSERT_NE(type, nullptr);
  auto message = type->type.make_message();
  const Status status = type->from_json(Json::parse(GetParam().json), message.get());
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message, GetParam().sentence);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
}
INSTANTIATE_TEST_SUITE_P(
    All, WrongMessages,
    testing::Values(
        Wrong{"nido_msgs/msg/JointCommand", R"({"mod": "position"})",
              "there is no field 'mod'; did you mean 'mode'?; allowed: header, mode, joint, value"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"mode": 3})", "'mode' is 3; expected text"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"joint": [0, "one"]})",
              "'joint.1' is \"one\"; expected a whole number from -2147483648 to 2147483647"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"joint": 0})", "'joint' is 0; expected a list"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"header": {"stamp": {"nanosec": -1}}})",
              "'header.stamp.nanosec' is -1; expected a whole number from 0 to 4294967295"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"header": {"stamp": {"sec": 2147483648}}})",
              "'header.stamp.sec' is 2147483648; expected a whole number from -2147483648 to 2147483647"},
        Wrong{"nido_msgs/msg/JointCommand", R"({"header": {"frame": "x"}})",
              "'header': there is no field 'frame'; did you mean 'frame_id'?; allowed: stamp, frame_id"},
        Wrong{"nido_msgs/msg/JointCommand", R"([1])",
              "'' is [1]; expected a map with the fields header, mode, joint, value"},
        Wrong{"nido_msgs/msg/Touch", R"({"on": [1]})", "'on.0' is 1; expected true or false"},
        Wrong{"sensor_msgs/msg/Image", R"({"data": [256]})",
              "'data.0' is 256; expected a whole number from 0 to 255"},
        Wrong{"sensor_msgs/msg/CameraInfo", R"({"k": [1, 2]})", "'k' is [1,2]; expected a list of 9"}));

TEST(AnyType, AListOfAnythingIsItsText) {
  const AnyType* type = find_any_type("nido_msgs/msg/Values");
  ASSERT_NE(type, nullptr);
  const auto message = type->type.make_message();
  const std::string text = R"([seen] 3 2.5 "blue cube" (1 (2 3)) {1 255})";
  const auto words = json_of_words(*type, {text});
  ASSERT_TRUE(words.ok());
  ASSERT_TRUE(type->from_json(*words, message.get()).ok());
  EXPECT_EQ(type->to_json(message.get(), 0)["text"], text);
  const Status open = type->from_json(Json{{"text", "(1 2"}}, message.get());
  ASSERT_FALSE(open.ok());
  EXPECT_EQ(open.error().message, "character 5: a '(' is not closed");
  EXPECT_FALSE(type->from_json(Json{{"test", "1"}}, message.get()).ok());
}

TEST(Words, AMapOrFieldsOrTheOnlyValue) {
  const AnyType* command = find_any_type("nido_msgs/msg/JointCommand");
  const Json expected = {{"mode", "position"}, {"joint", {0, 1}}};
  EXPECT_EQ(*json_of_words(*command, {"{mode: position, joint: [0, 1]}"}), expected);
  EXPECT_EQ(*json_of_words(*command, {"mode=position", "joint=[0, 1]"}), expected);
  EXPECT_EQ(*json_of_words(*command, {"header.stamp.sec=4"}), (Json{{"header", {{"stamp", {{"sec", 4}}}}}}));
  const AnyType* text = find_any_type("std_msgs/msg/String");
  EXPECT_EQ(*json_of_words(*text, {"hello", "there"}), (Json{{"data", "hello there"}}));
  EXPECT_EQ(*json_of_words(*text, {"3"}), (Json{{"data", "3"}}));
  EXPECT_EQ(*json_of_words(*command, {"mode='3'"}), (Json{{"mode", "3"}}));
  auto wrong = json_of_words(*command, {"position"});
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().message,
            "'position' is no FIELD=VALUE; give one map, as in '{mode: ...}', or fields of "
            "nido_msgs/msg/JointCommand");
  EXPECT_FALSE(json_of_words(*command, {"{mode: ["}).ok());
}

}  // namespace
}  // namespace nido
