// Ports while the system has no files left.

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <set>

#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

// For as long as it lives this process gets `more` further files and no others.
class FewFiles {
 public:
  explicit FewFiles(int more) {
    getrlimit(RLIMIT_NOFILE, &before_);
    std::set<int> free;
    while (static_cast<int>(free.size()) <= more) {
      free.insert(dup(0));
    }
    for (const int fd : free) {
      close(fd);
    }
    rlimit few = before_;
    few.rlim_cur = static_cast<rlim_t>(*free.rbegin());
    setrlimit(RLIMIT_NOFILE, &few);
  }
  ~FewFiles() { setrlimit(RLIMIT_NOFILE, &before_); }
  FewFiles(const FewFiles&) = delete;
  FewFiles& operator=(const FewFiles&) = delete;

 private:
  rlimit before_{};
};

class Hardship : public ::testing::Test {
 protected:
  Hardship() {
    // the ways of DDS itself are open from here on
    EXPECT_TRUE(first_->connect("/giver/out:o"));
    EXPECT_TRUE(first_->wait_for_sources(1, kPatience_s));
    EXPECT_TRUE(out_->wait_for_readers(1, kPatience_s));
  }
  const std::unique_ptr<Node> giver_ = make_node("giver");
  const std::unique_ptr<Node> taker_ = make_node("taker");
  const std::unique_ptr<Output<String>> out_ =
      make_output<String>(*giver_, "/giver/out:o", Profile::kEvent, 100);
  const std::unique_ptr<Input<String>> first_ =
      make_input<String>(*taker_, "/taker/first:i", Profile::kEvent, 100);
};

// none: the input gets no socket; one: the input gets it, the output cannot take it in
TEST_F(Hardship, AConnectionThatThereAreNoFilesForIsMadeWhenThereAreSome) {
  // kept: what is closed would be files again
  std::vector<std::unique_ptr<Input<String>>> inputs;
  for (const int files : {0, 1}) {
    const std::string name = "/taker/late" + std::to_string(files) + ":i";
    inputs.push_back(make_input<String>(*taker_, name, Profile::kEvent, 100));
    const auto& late = inputs.back();
    {
      const FewFiles few(files);
      ASSERT_TRUE(late->connect("/giver/out:o"));
      EXPECT_FALSE(late->wait_for_sources(1, 0.3));
      ASSERT_TRUE(out_->write(text("to the first")));
      ASSERT_TRUE(first_->wait_for_message(kPatience_s)) << "who is connected goes on";
      EXPECT_EQ(first_->take()->data(), "to the first");
    }
    ASSERT_TRUE(late->wait_for_sources(1, kPatience_s)) << files;
    ASSERT_TRUE(out_->wait_for_readers(inputs.size() + 1, kPatience_s)) << files;
    ASSERT_TRUE(out_->write(text("to all")));
    ASSERT_TRUE(late->wait_for_message(kPatience_s));
    EXPECT_EQ(late->take()->data(), "to all");
    ASSERT_TRUE(first_->wait_for_message(kPatience_s));
    EXPECT_EQ(first_->take()->data(), "to all");
  }
}

TEST_F(Hardship, ALargeMessageThatThereAreNoFilesForIsRefusedOrCounted) {
  const auto large = text(std::string(100'000, 'x'));
  std::uint64_t came = 0;
  {
    // no shared memory
    const FewFiles few(0);
    const auto status = out_->write(large);
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.error().message.find("/giver/out:o"), std::string::npos) << status.error().message;
    EXPECT_NE(status.error().message.find("no shared memory"), std::string::npos) << status.error().message;
    // small ones need none
    ASSERT_TRUE(out_->write(text("small")));
    ASSERT_TRUE(first_->wait_for_message(kPatience_s));
    EXPECT_EQ(first_->take()->data(), "small");
  }
  {
    // shared memory, but the reader cannot take it in
    const FewFiles few(1);
    ASSERT_TRUE(out_->write(large));
    ASSERT_TRUE(out_->write(text("behind it")));
    std::string got;
    while (got != "behind it") {
      ASSERT_TRUE(first_->wait_for_message(kPatience_s));
      got = first_->take()->data();
      came += got == large.data() ? 1 : 0;
    }
    // some other file of this process may have been closed meanwhile, then it came
    EXPECT_EQ(first_->connections().at(0).lost + came, 1U);
  }
  // the same piece of shared memory again, and again
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(out_->write(large));
    ASSERT_TRUE(first_->wait_for_message(kPatience_s)) << i;
    EXPECT_EQ(first_->take()->data().size(), 100'000U);
  }
  EXPECT_EQ(first_->connections().at(0).lost + came, 1U);
}

// a command port that cannot send has two reasons, of which only one is a reader that does not read
TEST_F(Hardship, ACommandThatThereIsNoMemoryForSaysSo) {
  const auto commands = make_output<String>(*giver_, "/giver/command:o", Profile::kCommand);
  const auto taker = make_input<String>(*taker_, "/taker/command:i", Profile::kCommand);
  ASSERT_TRUE(taker->connect("/giver/command:o"));
  ASSERT_TRUE(commands->wait_for_readers(1, kPatience_s));
  const FewFiles few(0);
  const auto status = commands->write(text(std::string(100'000, 'x')));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kFailed);
  EXPECT_NE(status.error().message.find("no shared memory"), std::string::npos) << status.error().message;
}

}  // namespace

}  // namespace nido::testing
