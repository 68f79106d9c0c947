// Types that are known by their definition only.

#include "nido/cli/idl_type.h"

#include <gtest/gtest.h>

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/fixed_size_string.hpp>

#include "nido/msgs/type_support.h"
#include "nido/recorder/idl_text.h"

namespace nido {
namespace {

constexpr const char* kLab = R"(
#include "std.idl"
// what the lab's own sensor says
module lab_msgs {
  module msg {
    module dds_ {
      const unsigned long AXES = 3;
      typedef double triple[AXES];
      enum Mood { CALM, BUSY, ALARMED };
      @final struct Sample_ {
        @default (value=0) octet channel;
        triple axes;
        sequence<short, 4> raw;
        boolean good;
        string<8> label;
        Mood mood;
        long long ticks, spare;
      };
      struct Packet_ { unsigned long number; sequence<lab_msgs::msg::dds_::Sample_> samples; };
    };
  };
};
)";

std::shared_ptr<const IdlType> lab_type(const std::string& name) {
  IdlTypes types;
  const Status added = types.add(kLab);
  EXPECT_TRUE(added.ok()) << added.error().message;
  return types.definition(name);
}

TEST(IdlType, MessagesComeBackAsTheyWere) {
  const auto type = lab_type("lab_msgs/msg/Packet");
  ASSERT_NE(type, nullptr);
  const Json packet = Json::parse(R"({"number": 7, "samples": [
      {"channel": 3, "axes": [1.5, -2.0, 0.0], "raw": [1, -2], "good": true, "label": "left", "mood": "BUSY",
       "ticks": -9000000000, "spare": 1},
      {"channel": 0, "axes": [0.0, 0.0, 0.0], "raw": [], "good": false, "label": "", "mood": "CALM",
       "ticks": 0, "spare": 0}]})");
  const auto bytes = cdr_of_json(*type, packet);
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  const auto back = json_of_cdr(*type, *bytes);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(*back, packet);
  // fields that are not named are 0 or empty
  const auto empty = json_of_cdr(*type, *cdr_of_json(*type, Json::object()));
  EXPECT_EQ(*empty, Json::parse(R"({"number": 0, "samples": []})"));
}

// The same bytes as the code that fastddsgen makes.
TEST(IdlType, BytesAreThoseOfTheCompiledTypes) {
  for (const char* name :
       {"sensor_msgs/msg/JointState", "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage",
        "nido_msgs/msg/NodeInfo", "nido_msgs/msg/Percepts", "sensor_msgs/msg/Imu"}) {
    SCOPED_TRACE(name);
    IdlTypes types;
    ASSERT_TRUE(types.add(idl_text_of(name)).ok());
    const auto type = types.definition(name);
    ASSERT_NE(type, nullptr);
    const AnyType* compiled = find_any_type(name);
    ASSERT_NE(compiled, nullptr);
    // every field something else than its default
    int count = 0;
    const std::function<Json(const IdlType&)> sample = [&](const IdlType& one) -> Json {
      Json value;
      switch (one.kind) {
        case IdlType::Kind::kStruct:
          value = Json::object();
          for (const auto& field : one.fields) value[field.name] = sample(*field.type);
          return value;
        case IdlType::Kind::kString:
          return Json("text " + std::to_string(++count));
        case IdlType::Kind::kBool:
          return Json(++count % 2 == 0);
        case IdlType::Kind::kFloat:
        case IdlType::Kind::kDouble:
          return Json(++count * 0.5);
        case IdlType::Kind::kSequence:
        case IdlType::Kind::kArray:
          value = Json::array();
          for (std::size_t i = 0; i < (one.size > 0 ? one.size : 3); ++i) value.push_back(sample(*one.item));
          return value;
        default:
          return Json(++count % 100);
      }
    };
    const Json json = sample(*type);
    const auto message = compiled->type.make_message();
    ASSERT_TRUE(compiled->from_json(json, message.get()).ok());
    const std::unique_ptr<eprosima::fastdds::dds::TopicDataType> support(compiled->type.make_support());
    eprosima::fastrtps::rtps::SerializedPayload_t payload(
        support->getSerializedSizeProvider(message.get())());
    ASSERT_TRUE(support->serialize(message.get(), &payload));
    const std::string_view bytes(reinterpret_cast<const char*>(payload.data), payload.length);
    const auto own = cdr_of_json(*type, json);
    ASSERT_TRUE(own.ok()) << own.error().message;
    // the library may count the bytes that align the end
    ASSERT_LE(own->size(), bytes.size());
    EXPECT_EQ(*own, bytes.substr(0, own->size()));
    const auto back = json_of_cdr(*type, bytes);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(*back, json);
  }
}

TEST(IdlType, OtherByteOrderAndCdr2AreRead) {
  IdlTypes types;
  ASSERT_TRUE(types.add("struct P { octet a; double b; };").ok());
  const auto type = types.definition("P");
  ASSERT_NE(type, nullptr);
  using namespace std::string_literals;
  EXPECT_EQ((*json_of_cdr(*type, "\0\0\0\0\x05\0\0\0\0\0\0\0\x3f\xf8\0\0\0\0\0\0"s)).dump(),
            R"({"a":5,"b":1.5})");
  EXPECT_EQ((*json_of_cdr(*type, "\0\7\0\0\x05\0\0\0\0\0\0\0\0\0\xf8\x3f"s)).dump(), R"({"a":5,"b":1.5})");
  EXPECT_FALSE(json_of_cdr(*type, "\0\3\0\0\x05\0\0\0\0\0\0\0\0\0\xf8\x3f"s).ok()) << "a parameter list";
}

TEST(IdlType, WrongValuesAreRefusedWithTheirPlace) {
  const auto type = lab_type("lab_msgs/msg/Packet");
  const auto refusal = [&](const char* json) {
    const auto bytes = cdr_of_json(*type, Json::parse(json));
    return bytes.ok() ? std::string("taken") : bytes.error().message;
  };
  EXPECT_EQ(refusal(R"({"number": -1})"), "'number' is -1; expected a whole number from 0 to 4294967295");
  EXPECT_EQ(refusal(R"({"nummer": 1})"),
            "there is no field 'nummer'; did you mean 'number'?; allowed: number, samples");
  EXPECT_EQ(refusal(R"({"samples": [{"axes": [1, 2]}]})"), "'samples.0.axes' is [1,2]; expected a list of 3");
  EXPECT_EQ(refusal(R"({"samples": [{"mood": "SAD"}]})"),
            "'samples.0.mood' is \"SAD\"; expected one of CALM, BUSY, ALARMED");
  EXPECT_EQ(refusal(R"({"samples": [{"label": "far too long"}]})"),
            "'samples.0.label' is \"far too long\"; expected at most 8 bytes");
  EXPECT_EQ(refusal(R"({"samples": [{"raw": [1, 2, 3, 4, 5]}]})"),
            "'samples.0.raw' is [1,2,3,4,5]; expected at most 4 items");
}

TEST(IdlType, DefinitionsThatAreWrongAreRefusedWithTheirLine) {
  const auto refusal = [](const char* text) {
    IdlTypes types;
    const Status added = types.add(text);
    return added.ok() ? std::string("taken") : added.error().message;
  };
  EXPECT_EQ(refusal("struct A { long x; };"), "taken");
  EXPECT_EQ(
      refusal("struct A {\n  far::Away x;\n};"),
      "line 2: a type that is defined before (give the file that defines it, too) is expected, found 'far'");
  EXPECT_EQ(refusal("struct A { long x; "), "line 1: a type is expected, found the end");
  EXPECT_EQ(refusal("module m { struct A { long x; }; "), "line 1: '}' is expected, found the end");
  EXPECT_EQ(refusal("union U"), "line 1: module, struct, enum, typedef or const is expected, found 'union'");
  EXPECT_EQ(refusal("struct A { };"), "line 1: a field is expected, found '}'");
  EXPECT_EQ(refusal("typedef octet big[1000000]; typedef big huge[1000000];"),
            "line 1: a smaller array is expected, found ']'");
  std::string deep;
  for (int i = 0; i < 10'000; ++i) deep += "sequence<";
  EXPECT_NE(refusal(("struct A { " + deep).c_str()), "taken");
}

TEST(IdlType, NoBytesBreakTheReader) {
  const auto type = lab_type("lab_msgs/msg/Packet");
  std::uint64_t state = 1;
  const auto next = [&state] { return static_cast<char>((state = state * 6364136223846793005U + 1) >> 56); };
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes("\0\1\0\0", 4);
    for (int k = 0; k < i % 80; ++k) bytes += k % 4 == 0 ? next() : '\0';
    (void)json_of_cdr(*type, bytes);
  }
}

}  // namespace
}  // namespace nido
