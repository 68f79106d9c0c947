#include "latest_sender.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>
#include <vector>

namespace nido::testing {

namespace {

// A network that takes a message whenever it is told to.
class SlowNetwork {
 public:
  LatestSender::Send send() {
    return [this](std::span<const std::uint8_t> payload, std::uint64_t sequence) {
      std::unique_lock lock(mutex_);
      under_way_ = sequence;
      changed_.notify_all();
      changed_.wait(lock, [this] { return may_go_ > 0; });
      --may_go_;
      sent_.emplace_back(sequence, std::vector<std::uint8_t>(payload.begin(), payload.end()));
      changed_.notify_all();
    };
  }
  void wait_until_under_way(std::uint64_t sequence) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return under_way_ == sequence; });
  }
  void let_one_go() {
    const std::lock_guard lock(mutex_);
    ++may_go_;
    changed_.notify_all();
  }
  using Message = std::pair<std::uint64_t, std::vector<std::uint8_t>>;
  std::vector<Message> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return sent_.size() >= count; });
    return sent_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int may_go_ = 0;
  std::uint64_t under_way_ = 0;
  std::vector<Message> sent_;
};

TEST(LatestSender, HoldsNobodyUpAndLeavesOutWhatIsOld) {
  SlowNetwork network;
  LatestSender sender(network.send());
  std::vector<std::uint8_t> picture(1000, 1);
  sender.post(picture, 1);
  network.wait_until_under_way(1);
  // the network is busy: none of these waits, and the last one is what it gets next
  for (std::uint8_t number = 2; number <= 9; ++number) {
    picture.assign(1000, number);
    sender.post(picture, number);
  }
  network.let_one_go();
  network.wait_until_under_way(9);
  network.let_one_go();
  const auto sent = network.wait_for(2);
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_EQ(sent[0], SlowNetwork::Message(1, std::vector<std::uint8_t>(1000, 1)));
  EXPECT_EQ(sent[1], SlowNetwork::Message(9, std::vector<std::uint8_t>(1000, 9)));
}

TEST(LatestSender, EndsWithWhatIsBeingSentAndGivesUpWhatWaits) {
  SlowNetwork network;
  auto sender = std::make_unique<LatestSender>(network.send());
  const std::vector<std::uint8_t> picture(10, 1);
  sender->post(picture, 1);
  network.wait_until_under_way(1);
  sender->post(picture, 2);
  auto end = std::async(std::launch::async, [&] { sender.reset(); });
  network.let_one_go();
  network.let_one_go();
  end.wait();
  // whether the second one was begun before the end was asked for is chance; nothing comes after it
  EXPECT_GE(network.wait_for(1).size(), 1U);
}

TEST(LatestSender, OneThatSentNothingEnds) {
  int sent = 0;
  {
    const LatestSender sender([&sent](std::span<const std::uint8_t>, std::uint64_t) { ++sent; });
  }
  EXPECT_EQ(sent, 0);
}

}  // namespace

}  // namespace nido::testing
