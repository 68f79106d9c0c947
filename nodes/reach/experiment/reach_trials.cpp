// nido-reach-trials: puts a ball at random places in the air, has the robot look at it and bring the mark on
// its hand there, and measures how far off the mark really is. The judge of the experiment reach-accuracy: it
// alone asks the world port.
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/reach/settings.h"
#include "trial_ports.h"
#include "trial_world.h"

namespace {

using namespace nido;         // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::reach;  // NOLINT(google-build-using-namespace)

constexpr const char* kBall = "red ball";
constexpr int kViewsOfBall = 5;
constexpr double kLookFirst_s = 0.4;  // the eyes come to rest on the ball, with the hand out of the way
constexpr double kSeeLimit_s = 8.0;
constexpr double kActLimit_s = 30.0;

nlohmann::json json_of(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

struct Settings {
  int trials = 62;
  std::string file;
  std::string side;
  Eigen::Vector3d p_PalmMark_m = Eigen::Vector3d::Zero();
};

// What happens, ball after ball.
class Trials {
 public:
  Trials(Node& node, Settings settings)
      : node_(node), settings_(std::move(settings)), world_(node), random_(node.options().seed) {}

  Status open() { return ports_.open(node_); }

  Status step(Time now) {
    while (auto status = ports_.status->take()) last_status_ = *status;
    const double t = now.seconds();
    switch (phase_) {
      case Phase::kHome:
        if (!asked_) return ask(now, "home", Eigen::Vector3d::Zero());
        if (ended() || t - phase_begin_s_ > kActLimit_s) enter(Phase::kSee, t);
        return watch(now);  // the eyes find the ball meanwhile
      case Phase::kPlace: {
        std::uniform_real_distribution<double> share(0.0, 1.0);
        ball_Root_m_ = {-0.22 - 0.14 * share(random_), 0.0 + 0.22 * share(random_),
                        -0.04 + 0.16 * share(random_)};
        if (settings_.side == "left") ball_Root_m_.y() *= -1.0;
        if (auto put = world_.put(TrialWorld::kBall, ball_Root_m_); !put) return put;
        enter(Phase::kHome, t);
        return {};
      }
      case Phase::kSee:
        return see(now);
      case Phase::kAct:
        if (!asked_) return ask(now, "point", seen_Root_m_);
        if (ended() || t - phase_begin_s_ > kActLimit_s) return measure(now);
        return {};
      case Phase::kOver:
        return announce(now);
    }
    return {};
  }

 private:
  enum class Phase { kPlace, kHome, kSee, kAct, kOver };

  void enter(Phase phase, double now_s) {
    phase_ = phase;
    phase_begin_s_ = now_s;
    asked_ = false;
    views_ = 0;
    seen_Root_m_ = phase == Phase::kAct ? seen_Root_m_ : Eigen::Vector3d::Zero();
  }

  Status ask(Time now, const std::string& action, const Eigen::Vector3d& p_Root_m) {
    msgs::ActionGoal goal;
    goal.header(header_at(now));
    goal.id(++id_);
    goal.action(action);
    goal.object(kBall);
    goal.position().x(p_Root_m.x());
    goal.position().y(p_Root_m.y());
    goal.position().z(p_Root_m.z());
    asked_ = true;
    phase_begin_s_ = now.seconds();
    return ports_.goal->write(goal);
  }

  [[nodiscard]] bool ended() const {
    return last_status_ && last_status_->id() == id_ && last_status_->state() != "running";
  }

  // The eyes look for the ball.
  Status watch(Time now) {
    if (now.seconds() - last_gaze_s_ <= 0.5) return {};
    last_gaze_s_ = now.seconds();
    msgs::GazeGoal gaze;
    gaze.header(header_at(now));
    gaze.mode(views_ > 0 ? "object" : "search");
    gaze.target(kBall);
    return ports_.gaze->write(gaze);
  }

  Status see(Time now) {
    const double t = now.seconds();
    if (Status watched = watch(now); !watched) return watched;
    if (auto percepts = ports_.objects->take_latest();
        percepts && time_of(percepts->header()).seconds() > phase_begin_s_ + kLookFirst_s) {
      for (const auto& object : percepts->objects()) {
        if (object.name() != kBall) continue;
        const Eigen::Vector3d p(object.position().x(), object.position().y(), object.position().z());
        seen_Root_m_ += (p - seen_Root_m_) / ++views_;
      }
    }
    if (views_ >= kViewsOfBall) {
      enter(Phase::kAct, t);
    } else if (t - phase_begin_s_ > kSeeLimit_s) {
      results_.push_back({{"object", json_of(ball_Root_m_)}, {"outcome", "not seen"}});
      return next(t);
    }
    return {};
  }

  Status measure(Time now) {
    const auto mark = world_.mark_Root_m(settings_.side, settings_.p_PalmMark_m);
    if (!mark) return mark.error();
    const bool done = ended() && last_status_->state() == "done";
    results_.push_back({{"object", json_of(ball_Root_m_)},
                        {"seen", json_of(seen_Root_m_)},
                        {"hand", json_of(*mark)},
                        {"hand_error_m", (*mark - ball_Root_m_).norm()},
                        {"seen_error_m", (seen_Root_m_ - ball_Root_m_).norm()},
                        {"duration_s", now.seconds() - phase_begin_s_},
                        {"outcome", done      ? "done"
                                    : ended() ? last_status_->reason()
                                              : "no end within its time"}});
    node_.log_info(fmt::format("ball {} of {}: hand {:.1f} mm from it, seen {:.1f} mm from where it is",
                               results_.size(), settings_.trials, 1000.0 * (*mark - ball_Root_m_).norm(),
                               1000.0 * (seen_Root_m_ - ball_Root_m_).norm()));
    return next(now.seconds());
  }

  Status next(double now_s) {
    std::ofstream file(settings_.file, std::ios::trunc);
    file << nlohmann::json{{"trials", results_}, {"sim_s", now_s}}.dump(1) << '\n';
    file.flush();
    if (!file) return Error{ErrorCode::kFailed, settings_.file + ": cannot be written"};
    enter(static_cast<int>(results_.size()) < settings_.trials ? Phase::kPlace : Phase::kOver, now_s);
    return {};
  }

  Status announce(Time now) {
    if (now.seconds() - last_gaze_s_ < 0.5) return {};
    last_gaze_s_ = now.seconds();
    msgs::StageEvent event;
    event.header(header_at(now));
    event.stage("outcome");
    event.state("done");
    event.text(fmt::format("{} balls in {}", results_.size(), settings_.file));
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
  bool asked_ = false;
  std::uint32_t id_ = 0;
  int views_ = 0;
  Eigen::Vector3d ball_Root_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d seen_Root_m_ = Eigen::Vector3d::Zero();
  nlohmann::json results_ = nlohmann::json::array();
};

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  Settings settings;
  auto urdf = node.parameter<std::string>("urdf", (places->config / "robots" / "icub.urdf").string());
  if (!urdf) return urdf.error();
  auto side = node.parameter<std::string>("side", "right");
  if (!side) return side.error();
  auto trials = node.parameter<int>("trials", settings.trials);
  if (!trials) return trials.error();
  auto file = node.parameter<std::string>("file", "reach_trials.json");
  if (!file) return file.error();
  if (*trials < 1) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameter trials is {}; expected 1 or more", *trials)};
  }
  const auto body = load_body(*urdf, "", *side);
  if (!body) return body.error();
  settings = {*trials, *file, *side, body->p_PalmMark_m};
  Trials procedure(node, settings);
  if (Status opened = procedure.open(); !opened) return opened;
  node.set_ready();
  return node.run([&](Time now) { return procedure.step(now); });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "trials", run); }
