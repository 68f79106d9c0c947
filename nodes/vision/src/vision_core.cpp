#include "nido/vision/vision_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nido/vision/picture_filter.h"

namespace nido::vision {

Result<std::unique_ptr<VisionCore>> VisionCore::create(const RobotModel& model, const TemplateSet& templates,
                                                       const VisionSettings& settings) {
  if (!(settings.period_s > 0))
    return Error{ErrorCode::kInvalidArgument, "the period of vision must be above zero"};
  if (templates.colours.empty())
    return Error{ErrorCode::kInvalidArgument, "vision needs templates with at least one colour"};
  auto core = std::unique_ptr<VisionCore>(new VisionCore(model, templates, settings));
  auto gaze = GazeController::create(core->model_, core->cameras_[0], settings.gaze);
  if (!gaze) return gaze.error();
  core->gaze_ = std::move(gaze).value();
  core->head_first_ = core->model_.parts()[*core->model_.part_index("head")].first_axis;
  core->torso_first_ = core->model_.parts()[*core->model_.part_index("torso")].first_axis;
  core->camera_links_ = {*core->model_.camera_link("left"), *core->model_.camera_link("right")};
  return core;
}

VisionCore::VisionCore(const RobotModel& model, const TemplateSet& templates, const VisionSettings& settings)
    : model_(model),
      templates_(templates),
      settings_(settings),
      finders_{BlobFinder(ColourTable(templates.colours), settings.min_blob_px),
               BlobFinder(ColourTable(templates.colours), settings.min_blob_px)},
      tracker_(templates, settings.tracker),
      hand_finder_(templates, settings.hand) {}

EyePair VisionCore::eyes_at(Time stamp) const {
  Eigen::VectorXd axes = model_.zero_axes();
  const auto head = head_.at(stamp);
  const auto torso = torso_.at(stamp);
  for (std::size_t i = 0; i < head.size(); ++i) axes[head_first_ + static_cast<int>(i)] = head[i];
  for (std::size_t i = 0; i < torso.size(); ++i) axes[torso_first_ + static_cast<int>(i)] = torso[i];
  EyePair eyes;
  for (std::size_t e = 0; e < 2; ++e) eyes[e] = {cameras_[e], model_.X_RootLink(camera_links_[e], axes)};
  return eyes;
}

void VisionCore::look(Time stamp, VisionOutputs& out) {
  StereoBlobs input;
  input.stamp = stamp;
  input.eyes = eyes_at(stamp);
  for (std::size_t e = 0; e < 2; ++e) {
    // grain would tear patches of colour apart and make some out of nothing
    const double noise = noise_levels(images_[e]);
    if (noise > settings_.noisy_levels) smooth(images_[e]);
    if (noise > 2 * settings_.noisy_levels) smooth(images_[e]);
    input.images[e] = &images_[e];
    input.blobs[e] = &finders_[e].find(images_[e]);
  }
  input.eyes_fast = head_.speed_rad_s() > settings_.fast_head_rad_s;
  out.pictures_stamp = stamp;
  out.objects = tracker_.step(input);
  out.hands = hand_finder_.find(input);
  if (learner_ && !input.eyes_fast) learn(input, out);
  for (std::size_t h = 0; h < 2; ++h) {
    if (!out.hands[h].visible) continue;
    p_RootHand_m_[h] = out.hands[h].p_RootKnuckle_m;
    hand_seen_[h] = stamp;
  }
}

void VisionCore::learn(const StereoBlobs& pictures, VisionOutputs& out) {
  constexpr int kPatience = 3 * Learner::kViews;  // pairs of pictures
  const Status seen = learner_->view(pictures);
  ++tries_;
  if (learner_->views() < Learner::kViews && tries_ < kPatience) return;
  VisionOutputs::Taught taught{learning_, false, ""};
  auto learned = learner_->learned();
  if (learner_->views() < Learner::kViews) {
    taught.text = seen ? fmt::format("I did not see the {} long enough", learning_) : seen.error().message;
  } else if (!learned) {
    taught.text = learned.error().message;
  } else {
    taught.learned = true;
    const Eigen::Vector3d size_m = learned->object.body.extents_m();
    taught.text = fmt::format("I know the {} now: {} of {:.0f} x {:.0f} x {:.0f} mm, {}", learning_,
                              learned->object.shape, 1000 * size_m.x(), 1000 * size_m.y(), 1000 * size_m.z(),
                              learned->object.colour);
    if (learned->colour) templates_.colours.push_back(*learned->colour);
    // what was taught last is what it looks like; things of the file keep their looks
    templates_.objects.push_back(std::move(learned->object));
    for (auto& finder : finders_) finder = BlobFinder(ColourTable(templates_.colours), settings_.min_blob_px);
    tracker_ = ObjectTracker(templates_, settings_.tracker);
  }
  out.taught = std::move(taught);
  learner_.reset();
}

VisionOutputs VisionCore::step(Time now, VisionInputs inputs) {
  VisionOutputs out;
  const auto refuse = [&](const Status& status) {
    if (!status) out.warnings.push_back(status.error().message);
  };
  for (const EncoderSample& sample : inputs.head) refuse(head_.add(sample));
  for (const EncoderSample& sample : inputs.torso) refuse(torso_.add(sample));
  std::array<std::optional<CameraInfo>*, 2> infos = {&inputs.left_info, &inputs.right_info};
  std::array<std::optional<Image>*, 2> images = {&inputs.left, &inputs.right};
  for (std::size_t e = 0; e < 2; ++e) {
    if (const auto& info = *infos[e]) {
      const bool fine = info->width > 0 && info->height > 0 && info->fx_px > 0 && info->fy_px > 0 &&
                        std::isfinite(info->cx_px) && std::isfinite(info->cy_px) &&
                        std::isfinite(info->fx_px) && std::isfinite(info->fy_px);
      if (fine) {
        cameras_[e] = {info->fx_px, info->fy_px, info->cx_px, info->cy_px, info->width, info->height};
      } else {
        out.warnings.emplace_back(
            "a camera's description holds a size or focal length that is not above zero");
      }
    }
    if (auto& image = *images[e]) {
      if (image->width != cameras_[e].width_px || image->height != cameras_[e].height_px ||
          image->rgb.size() != static_cast<std::size_t>(image->width) * image->height * 3) {
        out.warnings.push_back("a picture of " + std::to_string(image->width) + " x " +
                               std::to_string(image->height) + " pixels came, expected " +
                               std::to_string(cameras_[e].width_px) + " x " +
                               std::to_string(cameras_[e].height_px));
      } else {
        images_[e] = std::move(*image);
        fresh_[e] = true;
      }
    }
  }
  if (inputs.called) {
    learner_.emplace(*inputs.called, templates_);
    learning_ = *inputs.called;
    tries_ = 0;
  }
  if (inputs.gaze) refuse(gaze_->set_goal(*inputs.gaze));
  if (head_.empty() || torso_.empty()) return out;

  // a pair is two pictures of one moment
  if (fresh_[0] && fresh_[1] && images_[0].stamp_ns == images_[1].stamp_ns) {
    fresh_ = {false, false};
    look(Time{images_[0].stamp_ns}, out);
  }

  std::optional<GazeTarget> target;
  const GazeGoal& goal = gaze_->goal();
  if (goal.mode == "object" || goal.mode == "search") {
    if (const auto memory = tracker_.remember(goal.target, now))
      target = GazeTarget{memory->p_Root_m, memory->age_s};
  } else if (goal.mode == "hand") {
    const std::size_t h = goal.target == "left" ? 0 : 1;
    if (p_RootHand_m_[h]) target = GazeTarget{*p_RootHand_m_[h], Time{now.ns - hand_seen_[h].ns}.seconds()};
  }
  GazeController::HeadJoints head{};
  std::copy_n(head_.latest().position_rad.begin(), 6, head.begin());
  std::array<double, 3> torso{};
  std::copy_n(torso_.latest().position_rad.begin(), 3, torso.begin());
  out.gaze = gaze_->step(now, settings_.period_s, head, torso, head_.speed_rad_s(), target);
  return out;
}

}  // namespace nido::vision
