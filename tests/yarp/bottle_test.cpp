// Bottles: both notations, both dialects, and everything that is no Bottle.

#include "nido/yarp/bottle.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(Bottle, ReadsWhatYarpPrograms) {
  // as `yarp rpc` sent them: strings of one kind, then words and a number
  const std::string strings = word(256 + 4) + word(2) + word(3) + "get" + word(4) + "encs";
  EXPECT_EQ(to_text(*decode(strings, Dialect::k3)), "get encs");
  const std::string mixed = word(256) + word(3) + word(9) + "get\0"s + word(9) + "enc\0"s + word(1) + word(2);
  EXPECT_EQ(to_text(*decode(mixed, Dialect::k3)), "[get] [enc] 2");
  EXPECT_EQ(encode(*decode(strings, Dialect::k3), Dialect::k3), strings);
  EXPECT_EQ(encode(*decode(mixed, Dialect::k3), Dialect::k3), mixed);
}

TEST(Bottle, VectorsAreListsOfOneKind) {
  const std::string bytes = encode(vector_bottle({1.5, -2.0}), Dialect::k3);
  ASSERT_EQ(bytes.size(), 24U);
  EXPECT_EQ(bytes.substr(0, 8), word(256 + 10) + word(2));
  EXPECT_EQ(encode(vector_bottle({1.5}), Dialect::k4).substr(0, 4), word(256 + 20));
  EXPECT_EQ(encode({}, Dialect::k3), word(256) + word(0));
}

class TextBothWays : public testing::TestWithParam<const char*> {};
TEST_P(TextBothWays, ComesBack) {
  const Result<Bottle> bottle = parse_bottle(GetParam());
  ASSERT_TRUE(bottle.ok()) << bottle.error().message;
  EXPECT_EQ(to_text(*bottle), GetParam());
  for (const Dialect dialect : {Dialect::k3, Dialect::k4}) {
    const Result<Bottle> again = decode(encode(*bottle, dialect), dialect);
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(to_text(*again), GetParam());
    EXPECT_EQ(*again, *bottle);
  }
}
INSTANTIATE_TEST_SUITE_P(Lines, TextBothWays,
                         testing::Values("", "get encs", "[get] [icmd] [cmds]", "1 -2 3.5 1e+300 -0.0", "()",
                                         "((1 2) (3 4) ((5.5) x) \"a b\")",
                                         "\"quo\\\"te\" \"back\\\\slash\" \"\\n\\r\"",
                                         "\"\" \"12\" \"true\" \"/a/b\"", "true false", "{0 1 255 128}",
                                         "5000000000 -5000000000 2147483647", "inf -inf", "(dpo 3) (45.0)"));

TEST(Bottle, OtherSpellingsAreTaken) {
  EXPECT_EQ(to_text(*parse_bottle("1,2,,3  4")), "1 2 3 4");
  EXPECT_EQ(to_text(*parse_bottle("0x10 .5 1e3 +7 null")), "16 0.5 1000.0 7 [null]");
  EXPECT_TRUE(std::isnan((*parse_bottle("nan"))[0].number));
  EXPECT_EQ(to_text(*parse_bottle("12abc -x -")), "\"12abc\" \"-x\" \"-\"");
}

TEST(Bottle, AllKindsTravelInBothDialects) {
  Bottle bottle;
  for (const Value::Kind kind :
       {Value::Kind::kInt8, Value::Kind::kInt16, Value::Kind::kInt32, Value::Kind::kInt64}) {
    Value value;
    value.kind = kind;
    value.integer = -5;
    bottle.push_back(value);
  }
  Value narrow;
  narrow.kind = Value::Kind::kFloat32;
  narrow.number = 0.25;
  bottle.push_back(narrow);
  Value dict;
  dict.kind = Value::Kind::kDict;
  dict.items = {Value::list({Value::string("key"), Value::of(3.5)})};
  bottle.push_back(dict);
  bottle.push_back(Value::list({narrow, narrow}));
  for (const Dialect dialect : {Dialect::k3, Dialect::k4}) {
    const Result<Bottle> again = decode(encode(bottle, dialect), dialect);
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(*again, bottle);
  }
  const Bottle longer = {Value::word("position")};
  EXPECT_EQ((*decode(encode(longer, Dialect::k4), Dialect::k4))[0].kind, Value::Kind::kWord);
  EXPECT_EQ((*decode(encode(longer, Dialect::k3), Dialect::k3))[0], Value::string("position"));
}

TEST(Bottle, TheDialectIsToldFromTheBytes) {
  const Bottle floats = {Value::of(1.5), Value::string("a"), Value::of(2.5)};
  for (const Dialect spoken : {Dialect::k3, Dialect::k4}) {
    for (const Dialect preferred : {Dialect::k3, Dialect::k4}) {
      const Result<Decoded> decoded = decode_any(encode(floats, spoken), preferred);
      ASSERT_TRUE(decoded.ok());
      EXPECT_EQ(decoded->dialect, spoken);
      EXPECT_EQ(decoded->bottle, floats);
    }
  }
}

TEST(Bottle, WhatLiesAboutItsLengthIsRefused) {
  for (const std::string& bytes :
       {""s, "abc"s, word(256), word(0) + word(0), word(256) + word(-1), word(256) + word(0x7fffffff),
        word(256 + 1) + word(0x7fffffff), word(256 + 4) + word(1) + word(-1),
        word(256 + 4) + word(1) + word(0x7fffffff), word(256 + 12) + word(1) + word(-5),
        word(256) + word(1) + word(999) + word(0), word(256) + word(1) + word(1) + word(5) + "x",
        word(256) + word(1) + word(768) + word(1)}) {
    EXPECT_FALSE(decode_any(bytes, Dialect::k3).ok());
    const auto decoded = decode(bytes, Dialect::k3);
    EXPECT_TRUE(decoded.ok() || !decoded.error().message.empty());
  }
}

TEST(Bottle, ListsNestedWithoutEndAreRefused) {
  std::string bytes = word(256) + word(1);
  for (int i = 0; i < 200'000; ++i) bytes += word(256) + word(1);
  const Result<Bottle> decoded = decode(bytes, Dialect::k3);
  ASSERT_FALSE(decoded.ok());
  EXPECT_NE(decoded.error().message.find("nested"), std::string::npos) << decoded.error().message;
  EXPECT_FALSE(parse_bottle(std::string(100'000, '(')).ok());
  EXPECT_FALSE(parse_bottle(std::string(100'000, '(') + std::string(100'000, ')')).ok());
}

TEST(Bottle, TextThatDoesNotCloseIsRefused) {
  for (const char* line : {"(1", "1)", "\"abc", "[get", "{1", "{256}", "[]", "[waytoolongword]"}) {
    EXPECT_FALSE(parse_bottle(line).ok()) << line;
  }
  EXPECT_TRUE(continues("(1"));
  EXPECT_TRUE(continues("\"a (b)"));
  EXPECT_TRUE(continues("a \\"));
  EXPECT_FALSE(continues("(1) \"(\""));
}

TEST(Bottle, NoBytesBreakTheReader) {
  std::mt19937_64 random(5);
  const std::vector<std::int32_t> words = {0,  1,   2,   4,   9,   10,  12,  17, 20,  32,
                                           64, 128, 256, 257, 266, 512, 768, -1, 1000};
  for (int round = 0; round < 30'000; ++round) {
    std::string bytes =
        word(256 + words[random() % words.size()]) + word(static_cast<std::int32_t>(random() % 5));
    for (std::uint64_t n = random() % 12; n > 0; --n) bytes += word(words[random() % words.size()]);
    bytes.resize(bytes.size() - random() % 3);
    for (const Dialect dialect : {Dialect::k3, Dialect::k4}) {
      const Result<Bottle> decoded = decode(bytes, dialect);
      if (!decoded) continue;
      const Result<Bottle> again = decode(encode(*decoded, dialect), dialect);
      ASSERT_TRUE(again.ok()) << again.error().message;
      EXPECT_EQ(to_text(*again), to_text(*decoded));
    }
  }
}

TEST(Stamp, TextBothWays) {
  EXPECT_EQ(to_text(Stamp{12, 1234.5}), "12 1234.500000");
  EXPECT_EQ(parse_stamp("12 1234.5")->count, 12);
  EXPECT_DOUBLE_EQ(parse_stamp("12 1234.5")->time_s, 1234.5);
  EXPECT_FALSE(parse_stamp("").ok());
  EXPECT_FALSE(parse_stamp("a b").ok());
}

}  // namespace
}  // namespace nido::yarp
