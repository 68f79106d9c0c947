// nido-judge: watches a run, decides whether it did what was asked, writes report.json, report.html and
// pictures. The only node that asks the simulator what is really so. docs/report.md

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <optional>

#include "nido/judge/judge_core.h"
#include "nido/judge/stage_pictures.h"
#include "nido/judge/world_truth.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"

namespace nido {
namespace {

using Camera = StagePictures::Camera;

struct Parameters {
  std::string out;
  std::string app;
  std::string robot;
  std::string world;
  std::string phrases;
  std::string world_port;
  std::string hand;
  JudgeSettings judge;
};

// "/a/b/table.yaml" is the world "table"
std::string stem(const std::string& file) { return std::filesystem::path(file).stem().string(); }

Result<Parameters> read_parameters(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  Parameters p;
  std::string audio_source;
  std::string audio_text;
  const std::string default_phrases = (places->config / "phrases.yaml").string();
  struct Text {
    const char* key;
    std::string* value;
    std::string if_absent;
  };
  for (const Text& text : {Text{"out", &p.out, "out/judge"},
                           {"app", &p.app, "speech_and_action"},
                           {"robot", &p.robot, ""},
                           {"world", &p.world, ""},
                           {"phrases", &p.phrases, default_phrases},
                           {"world_port", &p.world_port, "/icubSim/world"},
                           {"hand", &p.hand, "right"},
                           {"basket", &p.judge.basket, p.judge.basket},
                           {"phrase", &p.judge.expected, ""},
                           {"audio.source", &audio_source, ""},
                           {"audio.text", &audio_text, ""}}) {
    const auto read = node.parameter<std::string>(text.key, text.if_absent);
    if (!read) return read.error();
    *text.value = *read;
  }
  if (p.judge.expected.empty() && audio_source == "synthesis") p.judge.expected = audio_text;
  const auto lessons = node.parameter<std::vector<std::string>>("lessons", {});
  if (!lessons) return lessons.error();
  p.judge.lessons = *lessons;
  for (const auto& [key, value] : {std::pair{"table_z_m", &p.judge.table_z_m},
                                   {"limit_s", &p.judge.limit_s},
                                   {"settle_s", &p.judge.settle_s},
                                   {"settle_limit_s", &p.judge.settle_limit_s},
                                   {"lift_m", &p.judge.lift_m},
                                   {"hold_s", &p.judge.hold_s},
                                   {"reach_m", &p.judge.reach_m}}) {
    const auto read = node.parameter<double>(key, *value);
    if (!read) return read.error();
    *value = *read;
  }
  return p;
}

double seconds_of(const msgs::Header& header) {
  return header.stamp().sec() + 1e-9 * header.stamp().nanosec();
}
std::int64_t ns_of(const msgs::Header& header) {
  return header.stamp().sec() * std::int64_t{1'000'000'000} + header.stamp().nanosec();
}

class JudgeNode {
 public:
  JudgeNode(Node& node, Parameters parameters, JudgeCore core)
      : node_(node),
        parameters_(std::move(parameters)),
        core_(std::move(core)),
        truth_([&n = node,
                port = parameters_.world_port](const std::string& line) { return n.call(port, line, 3.0); },
               parameters_.hand),
        pictures_(parameters_.out) {}

  Status open() {
    if (Status s = input(stage_, "/judge/stage:i", "/goal_selection/stage:o", Profile::kEvent, 64); !s)
      return s;
    if (Status s = input(heard_, "/judge/heard:i", "/speech/heard:o", Profile::kEvent, 16); !s) return s;
    if (Status s = input(objects_, "/judge/objects:i", "/vision/objects:o", Profile::kState, 4); !s) return s;
    if (Status s = input(hand_, "/judge/hand:i", "/vision/hand:o", Profile::kState, 4); !s) return s;
    if (Status s = input(eyes_[0], "/judge/left:i", "/icubSim/cam/left/image:o", Profile::kSensor, 4); !s)
      return s;
    if (Status s = input(eyes_[1], "/judge/right:i", "/icubSim/cam/right/image:o", Profile::kSensor, 4); !s)
      return s;
    if (Status s = input(eyes_[2], "/judge/outside:i", "/icubSim/cam/outside/image:o", Profile::kSensor, 4);
        !s) {
      return s;
    }
    auto outcome = node_.open_output<msgs::StageEvent>("/judge/outcome:o", Profile::kState);
    if (!outcome) return outcome.error();
    outcome_ = std::move(outcome).value();
    return {};
  }

  Status tick(Time now) {
    if (!begun_) {
      begun_ = now;
      wall_start_ = std::chrono::steady_clock::now();
    }
    now_ = now;
    take_pictures_in();
    while (const auto message = heard_->take()) {
      core_.heard({now.seconds(), seconds_of(message->header()), message->accepted() ? message->text() : "",
                   message->reason()});
    }
    while (const auto message = stage_->take()) {
      const StageSeen line{seconds_of(message->header()), message->stage(), message->state(),
                           message->object(), message->text()};
      if (core_.stage(line)) tell(line);
    }
    if (!announced_ && core_.tick(now.seconds(), truth_)) return announce();
    return {};
  }

  // The run was stopped: leaves a report of what there was.
  Status close() {
    if (announced_) return {};
    core_.give_up(now_.seconds(), "The run was stopped before it was over.");
    return write_report();
  }

 private:
  // Connected by the launch file, or, when that says nothing, to where the default app has it.
  template <class T>
  Status input(std::unique_ptr<Input<T>>& port, const std::string& name, const std::string& usual_source,
               Profile profile, std::size_t depth) {
    auto opened = node_.open_input<T>(name, profile, depth);
    if (!opened) return opened.error();
    port = std::move(opened).value();
    for (const auto& [source, own] : node_.options().connections) {
      if (own == name) return {};
    }
    return port->connect(usual_source);
  }

  void take_pictures_in() {
    for (std::size_t i = 0; i < eyes_.size(); ++i) {
      while (const auto message = eyes_[i]->take()) {
        if (message->encoding() != "rgb8" || message->step() != message->width() * 3) continue;
        pictures_.frame(static_cast<Camera>(i), {ns_of(message->header()), static_cast<int>(message->width()),
                                                 static_cast<int>(message->height()), message->data()});
      }
    }
    if (const auto message = objects_->take_latest()) {
      std::vector<FoundBox> boxes;
      for (const auto& percept : message->objects()) {
        boxes.push_back({percept.name(), percept.left_box(), percept.right_box()});
      }
      pictures_.found(ns_of(message->header()), std::move(boxes));
    }
    while (const auto message = hand_->take()) {
      if (parameters_.hand != "nearer" && message->side() != parameters_.hand) continue;
      pictures_.hand({message->side() + " hand", message->left_box(), message->right_box()},
                     message->visible());
    }
  }

  void tell(const StageSeen& line) {
    StoryLine story{line.time_s, line.stage, line.state, line.text};
    std::vector<std::string> troubles;
    story.pictures =
        pictures_.capture(line.state == "done" ? line.stage : line.stage + "-" + line.state, troubles);
    for (const std::string& trouble : troubles) node_.log_warning(trouble);
    story_.push_back(std::move(story));
  }

  Status announce() {
    announced_ = true;
    const Outcome& outcome = *core_.outcome();
    tell({now_.seconds(), "outcome", outcome.success ? "done" : "failed", outcome.object, outcome.sentence});
    const Status written = write_report();
    if (!written) node_.log_error(written.error().message);

    msgs::StageEvent message;
    message.header().stamp().sec(static_cast<std::int32_t>(now_.ns / 1'000'000'000));
    message.header().stamp().nanosec(static_cast<std::uint32_t>(now_.ns % 1'000'000'000));
    message.stage("outcome");
    message.state(outcome.success ? "done" : "failed");
    message.object(outcome.object);
    message.text(outcome.sentence);
    if (const Status sent = outcome_->write(message); !sent) return sent;
    return written;
  }

  Status write_report() {
    Report report;
    report.is_app = true;
    report.name = parameters_.app;
    report.title =
        parameters_.judge.expected.empty() ? parameters_.app : "\"" + parameters_.judge.expected + "\"";
    report.seed = node_.options().seed;
    report.robot = stem(parameters_.robot);
    report.world = stem(parameters_.world);
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start_).count();
    report.sim_s = begun_ ? now_.seconds() - begun_->seconds() : 0.0;
    report.metrics = core_.metrics();
    if (report.wall_s > 0.0) report.add("real_time_factor", {report.sim_s / report.wall_s, ""});
    report.outcome = core_.outcome();
    report.story = story_;
    return report.save(parameters_.out);
  }

  Node& node_;
  Parameters parameters_;
  JudgeCore core_;
  WorldTruth truth_;
  StagePictures pictures_;
  std::unique_ptr<Input<msgs::StageEvent>> stage_;
  std::unique_ptr<Input<msgs::Heard>> heard_;
  std::unique_ptr<Input<msgs::Percepts>> objects_;
  std::unique_ptr<Input<msgs::HandView>> hand_;
  std::array<std::unique_ptr<Input<msgs::Image>>, 3> eyes_;  // left, right, outside
  std::unique_ptr<Output<msgs::StageEvent>> outcome_;
  std::vector<StoryLine> story_;
  std::optional<Time> begun_;
  Time now_;
  std::chrono::steady_clock::time_point wall_start_ = std::chrono::steady_clock::now();
  bool announced_ = false;
};

Status run(Node& node) {
  auto parameters = read_parameters(node);
  if (!parameters) return parameters.error();
  const auto book = PhraseBook::load(parameters->phrases);
  if (!book) return book.error();
  auto core = JudgeCore::create(*book, parameters->judge);
  if (!core) return core.error();
  std::error_code error;
  std::filesystem::create_directories(parameters->out, error);
  if (error) {
    return Error{ErrorCode::kFailed,
                 fmt::format("cannot make the folder {}: {}", parameters->out, error.message())};
  }
  // pictures of an earlier run in the same folder would be taken for this one's
  for (const auto& entry : std::filesystem::directory_iterator(parameters->out, error)) {
    if (entry.path().filename().string().starts_with("stage-")) std::filesystem::remove(entry.path(), error);
  }
  JudgeNode judge(node, std::move(parameters).value(), std::move(core).value());
  if (Status opened = judge.open(); !opened) return opened;
  node.set_ready();
  const Status ran = node.run([&](Time now) { return judge.tick(now); });
  const Status closed = judge.close();
  return ran ? closed : ran;
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) { return nido::node_main(argc, argv, "judge", nido::run); }
