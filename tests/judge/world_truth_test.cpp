#include "nido/judge/world_truth.h"

#include <gtest/gtest.h>

#include <map>

namespace nido {
namespace {

class WorldTruthTest : public testing::Test {
 protected:
  WorldTruth make(const std::string& hand = "right") {
    return {[this](const std::string& line) -> Result<std::string> {
              lines_.push_back(line);
              const auto found = answers_.find(line);
              if (found == answers_.end()) return Error{ErrorCode::kTimeout, "no answer"};
              return found->second;
            },
            hand};
  }
  std::map<std::string, std::string> answers_;
  std::vector<std::string> lines_;
};

TEST_F(WorldTruthTest, ReadsPoseAndSize) {
  answers_["world where \"blue cube\""] =
      "-0.3 0.1 -0.05 0 0 0.7071067811865476 0.7071067811865476 0.05 0.06 0.07";
  const auto truth = make().object("blue cube");
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  EXPECT_NEAR(truth->X_RootObject.translation().x(), -0.3, 1e-12);
  // a quarter turn about z: the object's x axis shows along root y
  EXPECT_NEAR(truth->X_RootObject.linear()(1, 0), 1.0, 1e-9);
  EXPECT_NEAR(truth->size_m.z(), 0.07, 1e-12);
}

TEST_F(WorldTruthTest, HeldMeansByAHandAlone) {
  for (const auto& [answer, held] :
       {std::pair{"1 0", true}, {"1 1", false}, {"0 0", false}, {"0 1", false}}) {
    answers_["world touching \"red ball\""] = answer;
    EXPECT_EQ(*make().held("red ball"), held) << answer;
  }
}

TEST_F(WorldTruthTest, ReadsYesAndNo) {
  answers_["world inside \"red ball\" \"basket\""] = "0";
  EXPECT_FALSE(*make().inside("red ball", "basket"));
  answers_["world inside \"red ball\" \"basket\""] = "1";
  EXPECT_TRUE(*make().inside("red ball", "basket"));
}

TEST_F(WorldTruthTest, WhereEitherHandMayActBothPalmsAreToldOf) {
  answers_["world palm right"] = "-0.3 0.1 0 0 0 0 1";
  answers_["world palm left"] = "-0.3 -0.2 0 0 0 0 1";
  EXPECT_EQ(make().X_RootPalms()->size(), 1U);
  const auto both = make("nearer").X_RootPalms();
  ASSERT_TRUE(both.ok()) << both.error().message;
  ASSERT_EQ(both->size(), 2U);
  EXPECT_NEAR((*both)[1].translation().y(), -0.2, 1e-12);
}

TEST_F(WorldTruthTest, ARefusalIsASentenceThatQuotesIt) {
  answers_["world where \"red ball\""] = "[fail] \"there is no red ball\"";
  const auto truth = make().object("red ball");
  ASSERT_FALSE(truth.ok());
  EXPECT_NE(truth.error().message.find("there is no red ball"), std::string::npos);
  EXPECT_EQ(make().X_RootPalms().error().code, ErrorCode::kTimeout);
}

}  // namespace
}  // namespace nido
