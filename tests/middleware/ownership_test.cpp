#include "child_process.h"
#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

TEST(Ownership, SecondOwnerOfAPortIsToldTheFirst) {
  ChildProcess first(NIDO_TEST_PEER, {"idle", "--domain", std::to_string(own_domain())});
  ASSERT_EQ(first.line_with("READY"), "");
  auto node = make_node("second");
  const auto port = node->open_output<String>("/idle/out:o", Profile::kState);
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.error().code, ErrorCode::kTaken);
  for (const std::string& word : {std::string("/idle/out:o"), "process " + std::to_string(first.pid()),
                                  std::string("middleware_peer"), std::string("host ")}) {
    EXPECT_NE(port.error().message.find(word), std::string::npos) << port.error().message;
  }
  // in another domain the name is free
  NodeOptions elsewhere = options_of("elsewhere");
  elsewhere.domain = own_domain() == 229 ? 228 : own_domain() + 1;
  auto other = make_node(elsewhere);
  EXPECT_NE(make_output<String>(*other, "/idle/out:o", Profile::kState), nullptr);
}

TEST(Ownership, NameIsFreeAgainHoweverTheOwnerEnded) {
  auto node = make_node("second");
  {
    ChildProcess first(NIDO_TEST_PEER, {"idle", "--domain", std::to_string(own_domain())});
    ASSERT_EQ(first.line_with("READY"), "");
    first.signal(SIGKILL);
    first.wait_for_end();
  }
  { EXPECT_NE(make_output<String>(*node, "/idle/out:o", Profile::kState), nullptr); }
  EXPECT_NE(make_output<String>(*node, "/idle/out:o", Profile::kState), nullptr)
      << "closed in the same process";
}

TEST(Ownership, SecondNodeOfANameIsRefused) {
  auto first = make_node("only");
  const auto second = Node::create(options_of("only"));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kTaken);
  EXPECT_NE(second.error().message.find("node only"), std::string::npos) << second.error().message;
}

TEST(Ownership, ManyQuestionsDoNotBlockTheName) {
  auto owner = make_node("owner");
  auto port = make_output<String>(*owner, "/owner/out:o", Profile::kState);
  auto other = make_node("other");
  for (int i = 0; i < 300; ++i) {
    const auto refused = other->open_output<String>("/owner/out:o", Profile::kState);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kTaken);
  }
}

TEST(Ownership, BadNamesAreRefusedWithTheReason) {
  auto node = make_node("node");
  for (const char* name : {"", "vision/out:o", "/", "/a//b:o", "/a b:o", "/a/b:o/", "/a:x"}) {
    const auto port = node->open_output<String>(name, Profile::kState);
    ASSERT_FALSE(port.ok()) << name;
    EXPECT_EQ(port.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(port.error().message.find(std::string("'") + name + "'"), std::string::npos)
        << port.error().message;
  }
}

}  // namespace

}  // namespace nido::testing
