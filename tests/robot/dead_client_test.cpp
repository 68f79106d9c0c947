// A client that dies while it streams: however it moved joints of the simulated robot, they stand 100 ms
// after the last command that came.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "limits/limited_control_board.h"
#include "rigs.h"
#include "simulated_rig.h"

namespace nido::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::int64_t kAllowed_ns = 100'000'000;  // from the last command until a joint stands
constexpr std::int64_t kWatched_ns = 400'000'000;  // and as long as this it is watched
constexpr double kStanding_rad_s = 3 * kDegree;    // of 100 to 300 degrees/s that joints can
constexpr double kDrift_rad = 0.5 * kDegree;       // of where it stood then
constexpr double kBeyond_rad = 0.5 * kDegree;      // of a limit, at any time
constexpr std::array kStreamed = {ControlMode::kDirect, ControlMode::kVelocity, ControlMode::kTorque,
                                  ControlMode::kPwm};

void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

// All boards of the simulated robot under their limits, as the robot process has them.
class Body {
 public:
  Body() {
    for (const sim::PartInfo& part : robot_->simulation().parts()) {
      devices_.push_back(required(sim::SimulatedControlBoard::create(robot_, part.name)));
      LimitOptions options;
      options.part = part.name;
      boards_.push_back(required(LimitedControlBoard::create(*devices_.back(), clock_, std::move(options))));
    }
  }
  [[nodiscard]] std::size_t parts() const { return boards_.size(); }
  [[nodiscard]] LimitedControlBoard& board(std::size_t part) { return *boards_[part]; }
  [[nodiscard]] std::int64_t now_ns() const { return clock_.now_ns(); }
  void advance() {
    const std::int64_t next_ns = clock_.now_ns() + kPeriod_ns;
    for (auto& board : boards_) must(board->step_to(next_ns));
    must(robot_->step_to(next_ns));
    clock_.set_ns(next_ns);
  }
  void reset() {
    robot_->simulation().reset();
    for (auto& board : boards_) {
      std::vector<int> all;
      for (int joint = 0; joint < board->axes(); ++joint) all.push_back(joint);
      must(board->stop(all));
    }
  }

 private:
  ManualClock clock_;
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::vector<std::unique_ptr<IControlBoard>> devices_;
  std::vector<std::unique_ptr<LimitedControlBoard>> boards_;
};

// A client of one part: what it moves, how, and what becomes of that when it dies.
class Client {
 public:
  Client(Body& body, std::uint64_t seed)
      : body_(body), random_(seed), board_(body.board(draw_below(body.parts()))) {
    for (int joint = 0; joint < board_.axes(); ++joint) joints_.push_back(joint);
  }

  // Anywhere in the joints' ranges, or as near as other limbs and the trunk let them come.
  void go_somewhere() {
    std::vector<double> target_rad;
    std::vector<double> speed_rad_s;
    for (const JointLimits& limits : limits_) {
      target_rad.push_back(limits.min_rad + draw(0.05, 0.95) * (limits.max_rad - limits.min_rad));
      speed_rad_s.push_back(limits.max_velocity_rad_s);
    }
    must(board_.set_reference_speeds(joints_, speed_rad_s));
    must(board_.move_to(joints_, target_rad));
    for (int period = 0; period < 300 && (period < 20 || is_moving()); ++period) body_.advance();
  }

  // One joint or all of the part, every 10 to 50 ms, for at most 1.5 s; the last command is the last thing.
  void stream_and_die() {
    if (draw_below(4) > 0) joints_ = {static_cast<int>(draw_below(joints_.size()))};
    mode_ = kStreamed[draw_below(kStreamed.size())];
    const std::uint64_t every = 1 + draw_below(5);
    std::vector<double> share;
    for (std::size_t i = 0; i < joints_.size(); ++i) share.push_back(draw(-1, 1));
    for (std::uint64_t left = draw_below(30);; --left) {
      command(share);
      if (left == 0) break;
      for (std::uint64_t period = 0; period < every; ++period) body_.advance();
    }
  }

  // What is wrong with how the joints come to rest; empty: nothing.
  std::string watch() {
    const std::int64_t died_ns = body_.now_ns();
    std::vector<double> stood_rad;
    speeds_rad_s_.assign(limits_.size(), "");
    while (body_.now_ns() < died_ns + kWatched_ns) {
      body_.advance();
      const std::int64_t since_ns = body_.now_ns() - died_ns;
      const JointReading now = required(board_.read_joints());
      if (since_ns == kAllowed_ns) stood_rad = now.position_rad;
      for (const int joint : joints_) {
        const auto j = static_cast<std::size_t>(joint);
        speeds_rad_s_[j] += " " + std::to_string(now.velocity_rad_s[j]).substr(0, 5);
        const double out_rad =
            std::max(limits_[j].min_rad - now.position_rad[j], now.position_rad[j] - limits_[j].max_rad);
        if (out_rad > kBeyond_rad) return complaint(joint, since_ns, "is beyond its limit");
        if (since_ns < kAllowed_ns) continue;
        if (since_ns == kAllowed_ns && std::abs(now.velocity_rad_s[j]) > kStanding_rad_s)
          return complaint(joint, since_ns, "moves");
        if (std::abs(now.position_rad[j] - stood_rad[j]) > kDrift_rad)
          return complaint(joint, since_ns, "has gone on");
      }
    }
    return {};
  }

 private:
  std::uint64_t draw_below(std::uint64_t end) { return random_() % end; }
  double draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  [[nodiscard]] bool is_moving() const {
    const JointReading now = required(board_.read_joints());
    return std::any_of(now.velocity_rad_s.begin(), now.velocity_rad_s.end(),
                       [](double speed_rad_s) { return std::abs(speed_rad_s) > 1e-3; });
  }
  std::string complaint(int joint, std::int64_t since_ns, const std::string& what) const {
    return required(board_.axis_name(joint)) + " " + what + " " + std::to_string(since_ns / 1'000'000) +
           " ms after the last command in mode " + std::string(to_string(mode_)) +
           "; its speeds were, rad/s:" + speeds_rad_s_[static_cast<std::size_t>(joint)];
  }
  void command(const std::vector<double>& share) {
    std::vector<double> values;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const JointLimits& limits = limits_[static_cast<std::size_t>(joints_[i])];
      values.push_back(mode_ == ControlMode::kDirect
                           ? limits.min_rad + (share[i] + 1) / 2 * (limits.max_rad - limits.min_rad)
                       : mode_ == ControlMode::kVelocity ? share[i] * limits.max_velocity_rad_s
                       : mode_ == ControlMode::kTorque   ? share[i] * limits.max_torque_Nm
                                                         : share[i]);
    }
    must(mode_ == ControlMode::kDirect     ? board_.set_positions(joints_, values)
         : mode_ == ControlMode::kVelocity ? board_.set_velocities(joints_, values)
         : mode_ == ControlMode::kTorque   ? board_.set_torques(joints_, values)
                                           : board_.set_duty_cycles(joints_, values));
  }

  Body& body_;
  std::mt19937_64 random_;
  LimitedControlBoard& board_;
  std::vector<JointLimits> limits_ = required(board_.limits());
  std::vector<int> joints_;
  ControlMode mode_ = ControlMode::kPosition;
  std::vector<std::string> speeds_rad_s_;  // by joint, every control period since the last command
};

// 40 of them, or as many as NIDO_DEAD_CLIENTS says.
TEST(DeadClient, ItsJointsStandWithinATenthOfASecond) {
  const char* wanted = std::getenv("NIDO_DEAD_CLIENTS");
  const std::uint64_t count = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 40;
  Body body;
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    body.reset();
    Client client(body, seed);
    client.go_somewhere();
    client.stream_and_die();
    EXPECT_EQ(client.watch(), "") << "client " << seed;
  }
}

}  // namespace
}  // namespace nido::test
