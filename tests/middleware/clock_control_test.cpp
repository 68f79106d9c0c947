#include "nido/middleware/clock_control.h"

#include <atomic>
#include <chrono>
#include <thread>

#include "test_node.h"

namespace nido::testing {

namespace {

constexpr std::int64_t kPeriod_ns = 10'000'000;

// A node that owns the clock and does nothing but make ticks.
class Owner {
 public:
  explicit Owner(bool is_paused) : node_(make_node("owner")) {
    auto control = ClockControl::open(*node_, std::nullopt, is_paused);
    EXPECT_TRUE(control.ok());
    control_ = std::move(*control);
    thread_ = std::thread([this] {
      for (std::int64_t tick = 0; control_->wait(Time{tick * kPeriod_ns}).ok();) ticks_ = ++tick;
    });
  }
  ~Owner() {
    node_->stop();
    thread_.join();
  }
  std::string ask(Node& other, const std::string& text) {
    const auto answer = other.call("/clock/rpc:i", text, kPatience_s);
    return answer ? *answer : "no answer: " + answer.error().message;
  }
  [[nodiscard]] std::int64_t ticks() const { return ticks_; }
  bool wait_for_ticks(std::int64_t count) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
    while (ticks_ < count && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    return ticks_ >= count;
  }

 private:
  std::unique_ptr<Node> node_;
  std::unique_ptr<ClockControl> control_;
  std::atomic<std::int64_t> ticks_{0};
  std::thread thread_;
};

TEST(ClockControl, StepsExactlyAsOftenAsAsked) {
  Owner owner(true);
  auto other = make_node("other");
  EXPECT_EQ(owner.ask(*other, "get"), "[ok] time_s=0 state=paused rate=max");
  EXPECT_EQ(owner.ask(*other, "step"), "[ok] time_s=0.01 state=paused rate=max");
  EXPECT_EQ(owner.ask(*other, "step 24"), "[ok] time_s=0.25 state=paused rate=max");
  EXPECT_EQ(owner.ticks(), 25);
}

TEST(ClockControl, RunsAndPauses) {
  Owner owner(true);
  auto other = make_node("other");
  EXPECT_TRUE(owner.ask(*other, "run").find("state=running") != std::string::npos);
  EXPECT_TRUE(owner.wait_for_ticks(100));
  EXPECT_TRUE(owner.ask(*other, "pause").find("state=paused") != std::string::npos);
  // the tick that was being made ends; then time stands still, and steps are counted from there
  owner.ask(*other, "step");
  const std::int64_t at = owner.ticks();
  const std::string stepped = owner.ask(*other, "step 5");
  EXPECT_EQ(stepped, owner.ask(*other, "get"));
  EXPECT_EQ(owner.ticks(), at + 5);
}

TEST(ClockControl, KeepsTheRateThatIsSet) {
  Owner owner(false);
  auto other = make_node("other");
  EXPECT_TRUE(owner.wait_for_ticks(100));
  EXPECT_TRUE(owner.ask(*other, "rate 0.001").ends_with("rate=0.001"));
  EXPECT_TRUE(owner.ask(*other, "rate max").ends_with("rate=max"));
  EXPECT_TRUE(owner.wait_for_ticks(owner.ticks() + 100)) << "a wait for a far moment is given up";
}

TEST(ClockControl, APauseWhileAFarMomentIsWaitedForLetsNoTickBegin) {
  Owner owner(true);
  auto other = make_node("other");
  owner.ask(*other, "rate 0.0001");
  owner.ask(*other, "run");
  // the first tick is made at once, the next one is due after 100 s
  ASSERT_TRUE(owner.wait_for_ticks(1));
  owner.ask(*other, "pause");
  EXPECT_EQ(owner.ask(*other, "step 5"), "[ok] time_s=0.06 state=paused rate=0.0001");
  EXPECT_EQ(owner.ticks(), 6);
}

TEST(ClockControl, RefusesWhatMakesNoSense) {
  Owner owner(true);
  auto other = make_node("other");
  for (const char* wrong : {"rate 0", "rate -1", "rate nan", "rate fast", "rate", "step 0", "step -3",
                            "step 1.5", "step 99999999999", "pause 3", "dance", "step 1 2"}) {
    EXPECT_TRUE(owner.ask(*other, wrong).starts_with("[fail] ")) << wrong;
  }
  EXPECT_EQ(owner.ask(*other, "get"), "[ok] time_s=0 state=paused rate=max");
}

}  // namespace

}  // namespace nido::testing
