#include "nido/judge/world_truth.h"

#include <gtest/gtest.h>

#include <map>

namespace nido {
namespace {

class WorldTruthTest : public testing::Test {
 protected:
  WorldTruth make() {
    return {[this](const std::string& line) -> Result<std::string> {
              lines_.push_back(line);
              const auto found = answers_.find(line);
              if (found == answers_.end()) return Error{ErrorCode::kTimeout, "no answer"};
              return found->second;
            },
            "right"};
  }
  std::map<std::string, std::string> answers_;
  std::vector<std::string> lines_;
};

TEST_F(WorldTruthTest, ReadsPoseAndSize) {
  answers_["world truth pose \"blue cube\""] = "-0.3 0.1 -0.05 0.7071067811865476 0 0 0.7071067811865476";
  answers_["world truth size \"blue cube\""] = "0.05 0.06 0.07";
  const auto truth = make().object("blue cube");
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  EXPECT_NEAR(truth->X_RootObject.translation().x(), -0.3, 1e-12);
  // a quarter turn about z: the object's x axis shows along root y
  EXPECT_NEAR(truth->X_RootObject.linear()(1, 0), 1.0, 1e-9);
  EXPECT_NEAR(truth->size_m.z(), 0.07, 1e-12);
}

TEST_F(WorldTruthTest, ABearIsMeasuredFromItsMiddle) {
  answers_["world truth pose \"teddy bear\""] = "-0.3 0.1 -0.08 1 0 0 0";
  answers_["world truth size \"teddy bear\""] = "0.05 0.06 0.08";
  const auto truth = make().object("teddy bear");
  ASSERT_TRUE(truth.ok());
  EXPECT_NEAR(truth->X_RootObject.translation().z(), -0.04, 1e-12);
}

TEST_F(WorldTruthTest, ReadsYesAndNo) {
  answers_["world truth held \"red ball\""] = "1";
  answers_["world truth inside \"red ball\" \"basket\""] = "0";
  EXPECT_TRUE(*make().held("red ball"));
  EXPECT_FALSE(*make().inside("red ball", "basket"));
}

TEST_F(WorldTruthTest, ARefusalIsASentenceThatQuotesIt) {
  answers_["world truth pose \"red ball\""] = "[fail] \"there is no red ball\"";
  const auto truth = make().object("red ball");
  ASSERT_FALSE(truth.ok());
  EXPECT_NE(truth.error().message.find("there is no red ball"), std::string::npos);
  EXPECT_EQ(make().X_RootPalm().error().code, ErrorCode::kTimeout);
}

}  // namespace
}  // namespace nido
