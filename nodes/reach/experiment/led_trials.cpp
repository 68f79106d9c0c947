// nido-led-trials: a person who leads the hand. The robot reaches for a ball; the person pushes its hand a
// bit to the side with a fist while the arm yields, and leaves it there; the next reach tells what was
// learned. The judge of the experiment reach-correction: it alone asks the world port.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "trial_ports.h"
#include "trial_world.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::reach;  // NOLINT(google-build-using-namespace)

constexpr const char* kBall = "red ball";
constexpr double kBallSize_m = 0.06;
constexpr int kViewsOfBall = 5;
constexpr double kSeeLimit_s = 8.0;
constexpr double kActLimit_s = 30.0;
constexpr double kYieldFirst_s = 0.3;   // the arm has heard that it shall yield
constexpr double kFistBegins_m = 0.14;  // from the palm's middle
constexpr double kFistEnds_m = 0.20;
constexpr double kPush_m_s = 0.03;
constexpr double kMostStep_m = 0.0006;  // of the fist, a tick
constexpr double kPushLimit_s = 12.0;
const Eigen::Vector3d kAside_Root_m(0.8, 0.0, 0.3);  // where the fist waits

nlohmann::json json_of(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

struct Settings {
  int trials = 10;
  std::string file;
  std::string side;
};

class Trials {
 public:
  Trials(Node& node, Settings settings)
      : node_(node), settings_(std::move(settings)), world_(node), random_(node.options().seed) {}

  Status open() { return ports_.open(node_); }

  Status step(Time now) {
    while (auto status = ports_.status->take()) last_status_ = *status;
    const double t_s = now.seconds() - phase_begin_s_;
    switch (phase_) {
      case Phase::kPlace:
        return place(now);
      case Phase::kHome:
        if (!asked_) return ask(now, "home");
        if (over(t_s)) enter(again_ ? Phase::kReach : Phase::kSee, now);
        return watch(now);
      case Phase::kSee:
        return see(now, t_s);
      case Phase::kReach:
        if (!asked_) return ask(now, "reach");
        if (!over(t_s)) return watch(now);
        return again_ ? measure_after(now) : measure_before(now);
      case Phase::kPush:
        if (!asked_) return ask(now, "yield");
        return t_s < kYieldFirst_s ? Status{} : push(now, t_s);
      case Phase::kLeave:
        return leave(now, t_s);
      case Phase::kOver:
        return announce(now);
    }
    return {};
  }

 private:
  enum class Phase { kPlace, kHome, kSee, kReach, kPush, kLeave, kOver };

  void enter(Phase phase, Time now) {
    phase_ = phase;
    phase_begin_s_ = now.seconds();
    asked_ = false;
  }
  [[nodiscard]] bool over(double t_s) const {
    const bool ended = last_status_ && last_status_->id() == id_ && last_status_->state() != "running";
    return ended || t_s > kActLimit_s;
  }

  Status place(Time now) {
    const auto between = [this](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random_);
    };
    const double mirror = settings_.side == "left" ? -1.0 : 1.0;
    ball_Root_m_ = {between(-0.34, -0.24), mirror * between(0.04, 0.20), between(-0.04, 0.08)};
    // towards the other side, or down, or anything between: there a fist finds the edge or the back of a hand
    const double down = between(0.0, M_PI / 2);
    direction_ = {between(-0.3, 0.3), -mirror * std::cos(down), -std::sin(down)};
    direction_.normalize();
    length_m_ = between(0.02, 0.04);
    views_ = 0;
    again_ = false;
    if (Status s = world_.put(TrialWorld::kBall, ball_Root_m_); !s) return s;
    if (Status s = world_.put(TrialWorld::kFist, kAside_Root_m); !s) return s;
    enter(Phase::kHome, now);
    return {};
  }

  Status ask(Time now, const std::string& action) {
    asked_ = true;
    msgs::ActionGoal goal;
    goal.header(header_at(now));
    goal.id(++id_);
    goal.action(action);
    goal.object(fmt::format("number {} ball",
                            results_.size() + 1));  // each a thing of its own, to be corrected for itself
    goal.position().x(seen_Root_m_.x());
    goal.position().y(seen_Root_m_.y());
    goal.position().z(seen_Root_m_.z());
    goal.size().x(kBallSize_m);
    goal.size().y(kBallSize_m);
    goal.size().z(kBallSize_m);
    return ports_.goal->write(goal);
  }

  // The eyes look for the ball, and then at it.
  Status watch(Time now) {
    if (now.seconds() - last_gaze_s_ <= 0.5) return {};
    last_gaze_s_ = now.seconds();
    msgs::GazeGoal gaze;
    gaze.header(header_at(now));
    gaze.mode(views_ > 0 ? "object" : "search");
    gaze.target(kBall);
    return ports_.gaze->write(gaze);
  }

  Status see(Time now, double t_s) {
    if (Status watched = watch(now); !watched) return watched;
    if (auto percepts = ports_.objects->take_latest();
        percepts && time_of(percepts->header()).seconds() > phase_begin_s_ + 0.4) {
      for (const auto& object : percepts->objects()) {
        if (object.name() != kBall) continue;
        const Eigen::Vector3d p(object.position().x(), object.position().y(), object.position().z());
        seen_Root_m_ = views_ == 0 ? p : Eigen::Vector3d(seen_Root_m_ + (p - seen_Root_m_) / (views_ + 1));
        ++views_;
      }
    }
    if (views_ >= kViewsOfBall) {
      enter(Phase::kReach, now);
    } else if (t_s > kSeeLimit_s) {
      return next(now, {{"outcome", "not seen"}});
    }
    return {};
  }

  Status measure_before(Time now) {
    if (last_status_->state() != "done") return next(now, {{"outcome", last_status_->reason()}});
    const auto palm = world_.X_RootPalm(settings_.side);
    if (!palm) return palm.error();
    palm_Root_m_ = palm->translation();
    fist_m_ = kFistBegins_m;
    last_push_s_ = now.seconds() + kYieldFirst_s;
    enter(Phase::kPush, now);
    return {};
  }

  // The fist goes on until the hand has gone as far as the person wants.
  Status push(Time now, double t_s) {
    const auto palm = world_.X_RootPalm(settings_.side);
    if (!palm) return palm.error();
    if ((palm->translation() - palm_Root_m_).norm() >= length_m_ || t_s > kPushLimit_s) {
      enter(Phase::kLeave, now);
      asked_ = true;
      return {};
    }
    fist_m_ -= std::min(kMostStep_m, kPush_m_s * (now.seconds() - last_push_s_));
    last_push_s_ = now.seconds();
    return world_.put(TrialWorld::kFist, palm_Root_m_ - fist_m_ * direction_);
  }

  Status leave(Time now, double t_s) {
    if (fist_m_ < kFistEnds_m) {
      fist_m_ += 0.002;
      return world_.put(TrialWorld::kFist, fist_m_ < kFistEnds_m
                                               ? Eigen::Vector3d(palm_Root_m_ - fist_m_ * direction_)
                                               : kAside_Root_m);
    }
    if (!over(t_s)) return watch(now);
    const auto palm = world_.X_RootPalm(settings_.side);
    if (!palm) return palm.error();
    led_Root_m_ = palm->translation();
    again_ = true;
    enter(Phase::kHome, now);
    return {};
  }

  Status measure_after(Time now) {
    if (last_status_->state() != "done") return next(now, {{"outcome", last_status_->reason()}});
    const auto palm = world_.X_RootPalm(settings_.side);
    if (!palm) return palm.error();
    // where it was led is where it should be
    const double before_m = (palm_Root_m_ - led_Root_m_).norm();
    const double after_m = (palm->translation() - led_Root_m_).norm();
    node_.log_info(fmt::format("trial {} of {}: {:.1f} mm off before, {:.1f} mm after", results_.size() + 1,
                               settings_.trials, 1000.0 * before_m, 1000.0 * after_m));
    return next(now, {{"outcome", "done"},
                      {"reached", json_of(palm_Root_m_)},
                      {"led", json_of(led_Root_m_)},
                      {"again", json_of(palm->translation())},
                      {"before_m", before_m},
                      {"after_m", after_m}});
  }

  Status next(Time now, const nlohmann::json& result) {
    results_.push_back(result);
    std::ofstream file(settings_.file, std::ios::trunc);
    file << nlohmann::json{{"trials", results_}, {"sim_s", now.seconds()}}.dump(1) << '\n';
    if (!file.flush()) return Error{ErrorCode::kFailed, settings_.file + ": cannot be written"};
    enter(static_cast<int>(results_.size()) < settings_.trials ? Phase::kPlace : Phase::kOver, now);
    return {};
  }

  Status announce(Time now) {
    if (asked_) return {};
    asked_ = true;
    msgs::StageEvent event;
    event.header(header_at(now));
    event.stage("outcome");
    event.state("done");
    event.text(fmt::format("{} reaches were corrected, in {}", results_.size(), settings_.file));
    return ports_.outcome->write(event);
  }

  Node& node_;
  Settings settings_;
  TrialWorld world_;
  std::mt19937_64 random_;
  TrialPorts ports_;
  std::optional<msgs::ActionStatus> last_status_;
  Phase phase_ = Phase::kPlace;
  double phase_begin_s_ = 0.0;
  double last_gaze_s_ = -10.0;
  double last_push_s_ = 0.0;
  bool asked_ = false;
  bool again_ = false;  // after the correction
  std::uint32_t id_ = 0;
  int views_ = 0;
  Eigen::Vector3d ball_Root_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d seen_Root_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d palm_Root_m_ = Eigen::Vector3d::Zero();  // where the hand came by itself
  Eigen::Vector3d led_Root_m_ = Eigen::Vector3d::Zero();   // where it was led
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();    // in which it is pushed
  double length_m_ = 0.0;
  double fist_m_ = 0.0;  // before the palm's first place, against the direction
  nlohmann::json results_ = nlohmann::json::array();
};

Status run(Node& node) {
  Settings settings;
  auto side = node.parameter<std::string>("side", "right",
                                          {.about = "the hand that is led", .choices = {"right", "left"}});
  if (!side) return side.error();
  auto trials = node.parameter<int>("trials", settings.trials);
  if (!trials) return trials.error();
  auto file = node.parameter<std::string>("file", "led_trials.json");
  if (!file) return file.error();
  if (*trials < 1) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameter trials is {}; expected 1 or more", *trials)};
  }
  Trials procedure(node, {*trials, *file, *side});
  if (Status opened = procedure.open(); !opened) return opened;
  node.set_ready();
  return node.run([&](Time now) { return procedure.step(now); });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "trials", run); }
