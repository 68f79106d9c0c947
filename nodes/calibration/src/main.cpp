// nido-calibration: moves the hand before the eyes and finds out how the body differs from its drawing.
// docs/calibration.md

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "nido/calibration/pose_chooser.h"
#include "nido/calibration/self_calibration.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/reach/joint_path.h"
#include "nido/vision/blob.h"
#include "nido/vision/eye_ports.h"
#include "nido/vision/templates.h"

namespace nido::calibration {
namespace {

constexpr double kArmSpeed_rad_s = 1.4;
constexpr double kNeckSpeed_rad_s = 0.8;
constexpr double kEyeSpeed_rad_s = 1.5;
constexpr double kStill_rad = 0.0005;  // change of every joint in a tick that counts as rest
constexpr int kStillTicks = 8;
constexpr double kSettleLimit_s = 1.5;
constexpr double kLookLimit_s = 0.5;
constexpr double kNearExpected_px = 90.0;  // a mark is looked for so far from where it is believed
constexpr int kMinBlob_px = 12;
constexpr int kBelieveEvery = 10;  // poses
constexpr int kMostMisses = 40;    // poses one after the other in which the hand is not seen

struct Ports {
  vision::EyePorts eyes;
  std::unique_ptr<Input<msgs::JointState>> arm;
  std::unique_ptr<Output<msgs::JointCommand>> head_command;
  std::unique_ptr<Output<msgs::JointCommand>> torso_command;
  std::unique_ptr<Output<msgs::JointCommand>> arm_command;
  std::unique_ptr<Output<msgs::StageEvent>> outcome;
};

Status open_ports(Node& node, Ports& ports) {
  if (Status s = ports.eyes.open(node, "/calibration"); !s) return s;
  if (Status s = open_into(node, ports.arm, "/calibration/arm:i", Profile::kState); !s) return s;
  if (Status s = open_into(node, ports.head_command, "/calibration/head:o", Profile::kCommand); !s) return s;
  if (Status s = open_into(node, ports.torso_command, "/calibration/torso:o", Profile::kCommand); !s)
    return s;
  if (Status s = open_into(node, ports.arm_command, "/calibration/arm:o", Profile::kCommand); !s) return s;
  return open_into(node, ports.outcome, "/calibration/outcome:o", Profile::kEvent);
}

msgs::JointCommand command_of(Time now, const Eigen::VectorXd& q_rad) {
  msgs::JointCommand command;
  command.header(header_at(now));
  command.mode("direct");
  for (Eigen::Index i = 0; i < q_rad.size(); ++i) {
    command.joint().push_back(static_cast<std::int32_t>(i));
    command.value().push_back(q_rad(i));
  }
  return command;
}

struct Settings {
  std::string side;
  int poses = 100;
  std::string file;
  std::string views_file;
  std::uint64_t seed = 1;
};

using Body = Eigen::Matrix<double, reach::kJoints + 6, 1>;  // torso, arm, head

class Procedure {
 public:
  Procedure(Node& node, Settings settings, const RobotModel& drawn, std::string urdf_path,
            const vision::TemplateSet& templates)
      : node_(node),
        settings_(std::move(settings)),
        drawn_(drawn),
        urdf_path_(std::move(urdf_path)),
        finders_{vision::BlobFinder(vision::ColourTable(templates.colours), kMinBlob_px),
                 vision::BlobFinder(vision::ColourTable(templates.colours), kMinBlob_px)},
        colours_{templates.colour_index(templates.knuckle_colour),
                 templates.colour_index(templates.wrist_colour)} {}

  Status open() { return open_ports(node_, ports_); }

  Status step(Time now) {
    take_in();
    if (phase_ == Phase::kOver) return announce(now);
    if (!known_) return {};
    if (!command_) {
      command_ = measured_;
      auto chooser = PoseChooser::create(drawn_, settings_.side, cameras_[0], settings_.seed);
      if (!chooser) return chooser.error();
      chooser_.emplace(std::move(*chooser));
      if (Status begun = begin_move(now); !begun) return begun;
    }
    switch (phase_) {
      case Phase::kMove: {
        const double share = reach::minimum_jerk(std::min(1.0, (now.seconds() - begin_s_) / duration_s_));
        command_ = from_ + share * (to_ - from_);
        if (share >= 1.0) enter(Phase::kSettle, now);
        break;
      }
      case Phase::kSettle:
        if (still_ticks_ >= kStillTicks || now.seconds() - begin_s_ > kSettleLimit_s)
          enter(Phase::kLook, now);
        break;
      case Phase::kLook:
        if (pictures_of_this_pose()) {
          if (Status looked = look(now); !looked) return looked;
        } else if (now.seconds() - begin_s_ > kLookLimit_s) {
          if (Status begun = begin_move(now); !begun) return begun;
        }
        break;
      case Phase::kOver:
        break;
    }
    return send(now);
  }

  // What was seen is kept when the run ends early.
  Status save() {
    if (saved_ || views_.empty()) return {};
    saved_ = true;
    if (!settings_.views_file.empty()) {
      const Status kept = save_views(settings_.views_file, {cameras_, views_},
                                     fmt::format("nido launch self_calibration --seed {}", settings_.seed));
      if (!kept) return kept;
    }
    if (settings_.file.empty()) return {};
    const auto found = calibrate(drawn_, settings_.side, cameras_, views_, default_unknowns(settings_.side));
    if (!found) return found.error();
    summary_ = fmt::format("{} poses, the pictures agree to {:.2f} px", found->poses, found->rms_px);
    return found->corrections.save(settings_.file,
                                   "how this robot differs from its URDF, by nido-calibration: " + summary_);
  }

 private:
  enum class Phase { kMove, kSettle, kLook, kOver };

  void enter(Phase phase, Time now) {
    phase_ = phase;
    begin_s_ = now.seconds();
    still_ticks_ = 0;
  }

  template <class Vector>
  static bool take_state(Input<msgs::JointState>& port, Vector&& out) {
    const auto state = port.take_latest();
    if (!state || state->position().size() < static_cast<std::size_t>(out.size())) return false;
    for (Eigen::Index i = 0; i < out.size(); ++i) out(i) = state->position()[static_cast<std::size_t>(i)];
    return true;
  }

  void take_in() {
    const Body before = measured_;
    heard_[0] = take_state(*ports_.eyes.torso, measured_.head<reach::kTorsoJoints>()) || heard_[0];
    heard_[1] =
        take_state(*ports_.arm, measured_.segment<reach::kArmJoints>(reach::kTorsoJoints)) || heard_[1];
    heard_[2] = take_state(*ports_.eyes.head, measured_.tail<6>()) || heard_[2];
    for (std::size_t e = 0; e < 2; ++e) {
      if (auto message = ports_.eyes.image[e]->take_latest()) {
        images_[e].stamp_ns = time_of(message->header()).ns;
        images_[e].width = static_cast<int>(message->width());
        images_[e].height = static_cast<int>(message->height());
        images_[e].rgb = std::move(message->data());
      }
      if (const auto info = ports_.eyes.info[e]->take_latest()) {
        cameras_[e] = {info->k()[0],
                       info->k()[4],
                       info->k()[2],
                       info->k()[5],
                       static_cast<int>(info->width()),
                       static_cast<int>(info->height())};
        heard_[3 + e] = true;
      }
    }
    known_ = std::ranges::all_of(heard_, [](bool heard) { return heard; });
    still_ticks_ = (measured_ - before).cwiseAbs().maxCoeff() < kStill_rad ? still_ticks_ + 1 : 0;
  }

  Status begin_move(Time now) {
    const auto pose = chooser_->next(command_->head<reach::kJoints>());
    if (!pose) return Error{ErrorCode::kFailed, "no pose was found in which the eyes should see the hand"};
    from_ = *command_;
    to_.head<reach::kJoints>() = pose->arm_rad;
    to_.tail<6>() = pose->head_rad;
    const Body way = (to_ - from_).cwiseAbs();
    // minimum jerk: the fastest moment is 1.875 times the mean
    duration_s_ = 1.875 * std::max({0.1, way.head<reach::kJoints>().maxCoeff() / kArmSpeed_rad_s,
                                    way.segment<3>(reach::kJoints).maxCoeff() / kNeckSpeed_rad_s,
                                    way.tail<3>().maxCoeff() / kEyeSpeed_rad_s});
    enter(Phase::kMove, now);
    return {};
  }

  [[nodiscard]] bool pictures_of_this_pose() const {
    const auto since = static_cast<std::int64_t>(begin_s_ * 1e9);
    return images_[0].stamp_ns == images_[1].stamp_ns && images_[0].stamp_ns > since;
  }

  Status look(Time now) {
    PoseView view;
    view.axes_rad = chooser_->axes(measured_.head<reach::kJoints>(), measured_.tail<6>());
    const auto expected = chooser_->expected_px(view.axes_rad);
    for (std::size_t e = 0; e < 2; ++e) {
      const bool fits = images_[e].width == cameras_[e].width_px &&
                        images_[e].height == cameras_[e].height_px &&
                        images_[e].rgb.size() == static_cast<std::size_t>(images_[e].width) *
                                                     static_cast<std::size_t>(images_[e].height) * 3;
      if (!fits)
        return Error{ErrorCode::kInvalidArgument, "a picture is not of the camera's size or not rgb8"};
      const auto& blobs = finders_[e].find(images_[e]);
      for (std::size_t m = 0; m < 2; ++m) {
        double nearest_px = kNearExpected_px;
        for (const vision::Blob& blob : blobs) {
          if (blob.colour != colours_[m] || blob.touches_border || !expected[e][m]) continue;
          const double off_px = (blob.centroid_px - *expected[e][m]).norm();
          if (off_px >= nearest_px) continue;
          nearest_px = off_px;
          view.mark_px[e][m] = blob.centroid_px;
        }
      }
    }
    if (view.mark_px[0][0] && view.mark_px[1][0]) {
      views_.push_back(std::move(view));
      misses_ = 0;
      if (views_.size() % kBelieveEvery == 0) believe();
    } else if (++misses_ > kMostMisses) {
      return Error{
          ErrorCode::kFailed,
          fmt::format("the mark on the {} hand was not seen by both eyes in {} poses one after the other",
                      settings_.side, misses_)};
    }
    if (static_cast<int>(views_.size()) < settings_.poses) return begin_move(now);
    phase_ = Phase::kOver;
    const Status kept = save();
    node_.log_info("calibration: " + (kept ? summary_ : kept.error().message));
    return kept;
  }

  // The eyes find the hand better the better the body is known.
  void believe() {
    node_.log_info(fmt::format("calibration: {} of {} poses", views_.size(), settings_.poses));
    if (views_.size() > 50 && views_.size() % 50 != 0) return;
    const auto found = calibrate(drawn_, settings_.side, cameras_, views_, default_unknowns(settings_.side));
    if (!found) return;
    const auto body = load_corrected_model(urdf_path_, found->corrections);
    if (body) chooser_->believe(*body);
  }

  Status send(Time now) {
    if (Status s = ports_.torso_command->write(command_of(now, command_->head<reach::kTorsoJoints>())); !s)
      return s;
    const Eigen::VectorXd arm = command_->segment<reach::kArmJoints>(reach::kTorsoJoints);
    if (Status s = ports_.arm_command->write(command_of(now, arm)); !s) return s;
    return ports_.head_command->write(command_of(now, command_->tail<6>()));
  }

  Status announce(Time now) {
    if (now.seconds() - announced_s_ < 0.5) return {};
    announced_s_ = now.seconds();
    msgs::StageEvent event;
    event.header(header_at(now));
    event.stage("outcome");
    event.state("done");
    event.text(summary_);
    return ports_.outcome->write(event);
  }

  Node& node_;
  Settings settings_;
  const RobotModel& drawn_;
  std::string urdf_path_;
  std::array<vision::BlobFinder, 2> finders_;
  std::array<int, 2> colours_;
  Ports ports_;
  std::array<Image, 2> images_;
  std::array<PinholeCamera, 2> cameras_;
  std::array<bool, 5> heard_{};  // of torso, arm, head, left and right camera
  bool known_ = false;
  Body measured_ = Body::Zero();
  std::optional<Body> command_;
  std::optional<PoseChooser> chooser_;
  Phase phase_ = Phase::kMove;
  double begin_s_ = 0.0;
  double duration_s_ = 1.0;
  int still_ticks_ = 0;
  Body from_ = Body::Zero();
  Body to_ = Body::Zero();
  std::vector<PoseView> views_;
  int misses_ = 0;
  bool saved_ = false;
  std::string summary_ = "views kept";
  double announced_s_ = -1.0;
};

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto urdf = node.parameter<std::string>("urdf", (places->config / "robots" / "icub.urdf").string());
  if (!urdf) return urdf.error();
  const auto templates_path =
      node.parameter<std::string>("templates", (places->config / "objects" / "templates.yaml").string());
  if (!templates_path) return templates_path.error();
  Settings settings;
  settings.seed = node.options().seed;
  const auto side = node.parameter<std::string>(
      "side", "right", {.about = "the hand that is looked at", .choices = {"left", "right"}});
  if (!side) return side.error();
  settings.side = *side;
  const auto poses = node.parameter<int>("poses", settings.poses);
  if (!poses) return poses.error();
  if (*poses < 3)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameter poses is {}; expected 3 or more", *poses)};
  settings.poses = *poses;
  const auto file = node.parameter<std::string>("file", "calibration.yaml");
  if (!file) return file.error();
  settings.file = *file;
  const auto views_file = node.parameter<std::string>("views_file", "");
  if (!views_file) return views_file.error();
  settings.views_file = *views_file;
  const auto model = RobotModel::load(*urdf);
  if (!model) return model.error();
  const auto templates = vision::TemplateSet::load(*templates_path);
  if (!templates) return templates.error();

  Procedure procedure(node, settings, *model, *urdf, *templates);
  if (Status opened = procedure.open(); !opened) return opened;
  node.set_ready();
  const Status ended = node.run([&](Time now) { return procedure.step(now); });
  const Status kept = procedure.save();
  return ended ? kept : ended;
}

}  // namespace
}  // namespace nido::calibration

int main(int argc, char** argv) { return nido::node_main(argc, argv, "calibration", nido::calibration::run); }
