#include "test_node.h"

namespace nido::testing {

namespace {

TEST(Service, AnswersAndNamesWhatIsMissing) {
  auto server = make_node("server");
  auto client = make_node("client");
  auto service =
      server->open_service("/server/rpc:i", [](const std::string& line) { return "you said " + line; });
  ASSERT_TRUE(service.ok());
  for (int i = 0; i < 20; ++i) {
    const auto answer = client->call("/server/rpc:i", std::to_string(i), kPatience_s);
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(*answer, "you said " + std::to_string(i));
  }
  const auto missing = client->call("/nobody/rpc:i", "hello", 0.2);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("/nobody/rpc:i"), std::string::npos);
}

}  // namespace

}  // namespace nido::testing
