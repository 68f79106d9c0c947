// nido-teaching-trials: the person who shows things and says what they are called, and the judge of what the
// robot makes of it. It alone knows where things really are. docs/vision.md
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "nido/middleware/node.h"
#include "nido/middleware/stamp.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "nido/speech/phrases.h"
#include "nido/speech/speech_core.h"
#include "nido/speech/voice.h"

namespace {

using namespace nido;  // NOLINT(google-build-using-namespace): a program's own file

constexpr double kTable_Root_m = -0.0826;
constexpr double kFloor_Root_m = -0.5976;
constexpr double kCall_s = 20.0;    // wall time: a loaded machine answers late
constexpr double kClear_s = 3.5;    // nothing lies there: longer than vision remembers things
constexpr double kShown_s = 1.0;    // before the person speaks
constexpr double kLearn_s = 4.0;    // that the robot gets to learn, from the end of the sentence
constexpr double kLook_s = 4.0;     // that it gets to look at the table
constexpr double kNear_m = 0.03;    // a thing is where it is said to be
constexpr int kPresentations = 3;   // at most, of one thing
constexpr int kOthers = 5;          // things beside the taught one
constexpr std::size_t kTick = 160;  // samples of sound in a tick of 10 ms

const std::array<const char*, 6> kNewColours = {"purple", "amber", "teal", "lime", "rose", "golden"};
const std::array<const char*, 3> kShapes = {"cylinder", "ball", "cube"};
const std::array<const char*, 6> kKnown = {"blue cube", "blue ball",  "red cube",
                                           "red ball",  "green cube", "green ball"};
const std::array<const char*, 4> kVoices = {"en-us", "en-us+f3", "en-gb", "en-us+m3"};

double half_height_m(const std::string& name) { return name.ends_with("cube") ? 0.025 : 0.03; }

struct Placed {
  std::string thing;   // in the world
  std::string called;  // by the robot, if it is right
  Eigen::Vector3d p_Root_m;
};

struct Ports {
  std::unique_ptr<Input<msgs::Heard>> heard;
  std::unique_ptr<Input<msgs::StageEvent>> taught;
  std::unique_ptr<Input<msgs::Percepts>> objects;
  std::unique_ptr<Output<msgs::GazeGoal>> gaze;
  std::unique_ptr<Output<msgs::Audio>> voice;
  std::unique_ptr<Output<msgs::StageEvent>> outcome;
};

template <class Port, class Opened>
Status keep(std::unique_ptr<Port>& port, Opened opened) {
  if (!opened) return opened.error();
  port = std::move(opened).value();
  return {};
}

Status open_ports(Node& node, Ports& ports) {
  if (Status s = keep(ports.heard, node.open_input<msgs::Heard>("/teaching_trials/heard:i", Profile::kEvent));
      !s) {
    return s;
  }
  if (Status s =
          keep(ports.taught, node.open_input<msgs::StageEvent>("/teaching_trials/taught:i", Profile::kEvent));
      !s) {
    return s;
  }
  if (Status s =
          keep(ports.objects, node.open_input<msgs::Percepts>("/teaching_trials/objects:i", Profile::kState));
      !s) {
    return s;
  }
  if (Status s =
          keep(ports.gaze, node.open_output<msgs::GazeGoal>("/teaching_trials/gaze:o", Profile::kEvent));
      !s) {
    return s;
  }
  if (Status s =
          keep(ports.voice, node.open_output<msgs::Audio>("/teaching_trials/voice:o", Profile::kEvent));
      !s) {
    return s;
  }
  return keep(ports.outcome,
              node.open_output<msgs::StageEvent>("/teaching_trials/outcome:o", Profile::kState));
}

// One after the other: what happens in a lesson and in the test after it.
class Teaching {
 public:
  Teaching(Node& node, Ports& ports, int count, std::vector<std::string> names, std::string file)
      : node_(node),
        ports_(ports),
        count_(count),
        names_(std::move(names)),
        file_(std::move(file)),
        random_(node.options().seed) {
    std::vector<std::string> colours(kNewColours.begin(), kNewColours.end());
    std::shuffle(colours.begin(), colours.end(), random_);
    for (const std::string& colour : colours)
      things_.push_back(colour + " " + kShapes[random_() % kShapes.size()]);
    std::shuffle(names_.begin(), names_.end(), random_);
  }

  Status step(Time now) {
    const double t = now.seconds() - since_s_;
    hear();
    switch (phase_) {
      case Phase::kClear:
        if (!entered_) {
          entered_ = true;
          if (Status s = clear(); !s) return s;
          if (Status s = look(now, "point", ""); !s) return s;
        }
        if (t > kClear_s) enter(testing_ ? Phase::kTest : Phase::kShow, now);
        return {};
      case Phase::kShow:
        if (!entered_) {
          entered_ = true;
          if (Status s =
                  put({things_[number_], names_[number_], on_table(-0.32, 0.06, things_[number_])}, turn());
              !s) {
            return s;
          }
        }
        if (t > kShown_s) enter(Phase::kSay, now);
        return {};
      case Phase::kSay:
        return say(now);
      case Phase::kLearn:
        if (taught_ || t > kLearn_s) {
          testing_ = (taught_ && taught_->state() == "done") || presentations_ >= kPresentations;
          enter(testing_ ? Phase::kClear : Phase::kShow, now);
        }
        return {};
      case Phase::kTest:
        if (!entered_) {
          entered_ = true;
          if (Status s = set_the_table(); !s) return s;
          if (Status s = look(now, "search", names_[number_]); !s) return s;
        }
        return t > kLook_s ? judge(now) : Status{};
      case Phase::kOver:
        return announce(now);
    }
    return {};
  }

 private:
  enum class Phase { kClear, kShow, kSay, kLearn, kTest, kOver };

  void enter(Phase phase, Time now) {
    phase_ = phase;
    since_s_ = now.seconds();
    entered_ = false;
  }

  void hear() {
    while (const auto heard = ports_.heard->take())
      heard_ = heard->accepted() ? heard->text() : heard->reason();
    while (auto taught = ports_.taught->take()) taught_ = std::move(*taught);
    if (auto percepts = ports_.objects->take_latest()) percepts_ = std::move(*percepts);
  }

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double turn() { return between(-M_PI, M_PI); }
  static Eigen::Vector3d on_table(double x_m, double y_m, const std::string& thing) {
    return {x_m, y_m, kTable_Root_m + half_height_m(thing)};
  }

  Status world(const std::string& line) {
    auto answer = node_.call("/icubSim/world", line, kCall_s);
    if (!answer) return answer.error();
    if (answer->rfind("[fail]", 0) == 0)
      return Error{ErrorCode::kFailed, "the world answered " + *answer + " to: " + line};
    return {};
  }

  Status put(const Placed& placed, double yaw_rad) {
    // the world port's frame: x left, y up, z forward, on the floor
    if (Status s =
            world(fmt::format("world rot \"{}\" -90 0 {:.5f}", placed.thing, 90 + yaw_rad * 180 / M_PI));
        !s) {
      return s;
    }
    const Eigen::Vector3d& p = placed.p_Root_m;
    if (Status s = world(fmt::format("world set \"{}\" {:.6f} {:.6f} {:.6f}", placed.thing, -p.y(),
                                     p.z() - kFloor_Root_m, -p.x() - 0.026));
        !s) {
      return s;
    }
    placed_.push_back(placed);
    return {};
  }

  // What lies on the table goes back behind the robot.
  Status clear() {
    const auto away = std::move(placed_);
    placed_.clear();
    for (std::size_t i = 0; i < away.size(); ++i) {
      if (Status s = put({away[i].thing, "", {1.5, 1.0 + 0.1 * static_cast<double>(i), -0.5}}, 0); !s)
        return s;
    }
    placed_.clear();
    return {};
  }

  // At the place where things are shown, or for a thing.
  Status look(Time now, const std::string& mode, const std::string& target) {
    msgs::GazeGoal gaze;
    gaze.header(header_at(now, "root"));
    gaze.mode(mode);
    gaze.target(target);
    gaze.point().x(-0.32);
    gaze.point().y(0.06);
    gaze.point().z(-0.055);
    return ports_.gaze->write(gaze);
  }

  // The sentence, as a microphone would give it: 10 ms a tick.
  Status say(Time now) {
    if (!entered_) {
      entered_ = true;
      ++presentations_;
      heard_.clear();
      taught_.reset();
      auto sentence = speak(kNaming + names_[number_], {kVoices[random_() % kVoices.size()], 150}, 0.5, 0.8);
      if (!sentence) return sentence.error();
      sound_ = std::move(*sentence);
      sound_at_ = 0;
    }
    if (sound_at_ >= sound_.size()) {
      enter(Phase::kLearn, now);
      return {};
    }
    const std::size_t end = std::min(sound_.size(), sound_at_ + kTick);
    msgs::Audio audio;
    audio.header(header_at(now));
    audio.sample_rate_hz(kSpeechRate_hz);
    audio.channels(1);
    audio.samples().assign(sound_.begin() + static_cast<std::ptrdiff_t>(sound_at_),
                           sound_.begin() + static_cast<std::ptrdiff_t>(end));
    sound_at_ = end;
    return ports_.voice->write(audio);
  }

  // The taught thing and five others: those it knows, and those that it was taught before.
  Status set_the_table() {
    std::vector<Placed> others;
    for (const char* known : kKnown) others.push_back({known, known, {}});
    for (std::size_t i = 0; i < number_; ++i) others.push_back({things_[i], names_[i], {}});
    std::shuffle(others.begin(), others.end(), random_);
    others.resize(kOthers);
    others.insert(others.begin(), {things_[number_], names_[number_], {}});
    for (Placed& thing : others) {
      for (int attempt = 0; attempt < 500; ++attempt) {
        thing.p_Root_m = on_table(between(-0.43, -0.25), between(-0.14, 0.24), thing.thing);
        const bool free = std::all_of(placed_.begin(), placed_.end(), [&](const Placed& other) {
          // beside one another, and none right behind another
          const Eigen::Vector3d apart = thing.p_Root_m - other.p_Root_m;
          return std::abs(apart.y()) > 0.075 || std::abs(apart.x()) > 0.13;
        });
        if (free) break;
      }
      if (Status s = put(thing, turn()); !s) return s;
    }
    return {};
  }

  Status judge(Time now) {
    bool named = false;
    double error_m = 0;
    int wrong = 0;
    int others = 0;
    for (const auto& seen : percepts_.objects()) {
      const Eigen::Vector3d p(seen.position().x(), seen.position().y(), seen.position().z());
      const Placed* nearest = nullptr;
      for (const Placed& placed : placed_) {
        if (nearest == nullptr || (placed.p_Root_m - p).norm() < (nearest->p_Root_m - p).norm())
          nearest = &placed;
      }
      const bool right =
          nearest != nullptr && (nearest->p_Root_m - p).norm() < kNear_m && nearest->called == seen.name();
      if (!right) {
        ++wrong;
      } else if (nearest == &placed_.front()) {
        named = true;
        error_m = (nearest->p_Root_m - p).norm();
      } else {
        ++others;
      }
    }
    const std::string text = taught_ ? taught_->text() : "nothing was learned";
    results_.push_back({{"thing", things_[number_]},
                        {"name", names_[number_]},
                        {"heard", heard_},
                        {"presentations", presentations_},
                        {"taught", text},
                        {"named_right", named},
                        {"position_error_m", error_m},
                        {"others_named_right", others},
                        {"wrong_names", wrong}});
    node_.log_info(
        fmt::format("{} called {}: {}; {} presentations, {}, {} of {} others named, {} wrong names",
                    things_[number_], names_[number_], named ? "found and named" : "not named",
                    presentations_, text, others, kOthers, wrong));
    std::ofstream file(file_);
    file << results_.dump(1) << '\n';
    if (!file.flush()) return Error{ErrorCode::kFailed, file_ + ": cannot be written"};
    testing_ = false;
    presentations_ = 0;
    ++number_;
    enter(static_cast<int>(number_) < count_ ? Phase::kClear : Phase::kOver, now);
    return {};
  }

  Status announce(Time now) {
    if (entered_) return {};
    entered_ = true;
    msgs::StageEvent end;
    end.header(header_at(now));
    end.stage("outcome");
    end.state("done");
    end.text(fmt::format("{} things were taught", results_.size()));
    return ports_.outcome->write(end);
  }

  Node& node_;
  Ports& ports_;
  int count_;
  std::vector<std::string> names_;
  std::string file_;
  std::mt19937_64 random_;
  std::vector<std::string> things_;
  Phase phase_ = Phase::kClear;
  double since_s_ = 0;
  bool entered_ = false;
  bool testing_ = false;
  std::size_t number_ = 0;
  int presentations_ = 0;
  std::string heard_;
  std::optional<msgs::StageEvent> taught_;
  msgs::Percepts percepts_;
  std::vector<Placed> placed_;  // on the table now; the taught one first
  std::vector<std::int16_t> sound_;
  std::size_t sound_at_ = 0;
  nlohmann::json results_ = nlohmann::json::array();
};

Status run(Node& node) {
  const auto count = node.parameter<int>("count", 5);
  if (!count) return count.error();
  const auto names = node.parameter<std::vector<std::string>>("names", {});
  if (!names) return names.error();
  const auto file = node.parameter<std::string>("file", "teaching.json");
  if (!file) return file.error();
  const int most = static_cast<int>(std::min(kNewColours.size(), names->size()));
  if (*count < 1 || *count > most) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameter count is {}; allowed are 1 to {}", *count, most)};
  }
  Ports ports;
  if (Status opened = open_ports(node, ports); !opened) return opened;
  node.set_ready();
  Teaching teaching(node, ports, *count, *names, *file);
  return node.run([&](Time now) { return teaching.step(now); });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "teaching_trials", run); }
