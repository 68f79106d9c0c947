#include "nido/attention/attention_core.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace nido::attention {

Result<std::unique_ptr<AttentionCore>> AttentionCore::create(const RobotModel& model,
                                                             const AttentionSettings& settings) {
  if (!(settings.period_s > 0))
    return Error{ErrorCode::kInvalidArgument, "the period of attention must be above zero"};
  auto core = std::unique_ptr<AttentionCore>(new AttentionCore(model, settings));
  auto gaze = vision::GazeController::create(core->model_, core->cameras_[0], settings.gaze);
  if (!gaze) return gaze.error();
  core->gaze_ = std::move(gaze).value();
  core->head_first_ = core->model_.parts()[*core->model_.part_index("head")].first_axis;
  core->torso_first_ = core->model_.parts()[*core->model_.part_index("torso")].first_axis;
  core->camera_links_ = {*core->model_.camera_link("left"), *core->model_.camera_link("right")};
  return core;
}

AttentionCore::AttentionCore(const RobotModel& model, const AttentionSettings& settings)
    : model_(model), settings_(settings), tracker_(settings.surface) {}

vision::EyePair AttentionCore::eyes_at(Time stamp) const {
  Eigen::VectorXd axes = model_.zero_axes();
  const auto head = head_.at(stamp);
  const auto torso = torso_.at(stamp);
  for (std::size_t i = 0; i < head.size(); ++i) axes[head_first_ + static_cast<int>(i)] = head[i];
  for (std::size_t i = 0; i < torso.size(); ++i) axes[torso_first_ + static_cast<int>(i)] = torso[i];
  vision::EyePair eyes;
  for (std::size_t e = 0; e < 2; ++e) eyes[e] = {cameras_[e], model_.X_RootLink(camera_links_[e], axes)};
  return eyes;
}

void AttentionCore::take_picture(std::size_t eye, std::optional<Image>& image, AttentionOutputs& out) {
  if (!image) return;
  const PinholeCamera& camera = cameras_[eye];
  if (image->width != camera.width_px || image->height != camera.height_px ||
      image->rgb.size() !=
          static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height) * 3) {
    out.warnings.push_back("a picture of " + std::to_string(image->width) + " x " +
                           std::to_string(image->height) + " pixels came, expected " +
                           std::to_string(camera.width_px) + " x " + std::to_string(camera.height_px) +
                           " in rgb8");
    return;
  }
  images_[eye] = std::move(*image);
  fresh_[eye] = true;
}

void AttentionCore::look(Time stamp, AttentionOutputs& out) {
  const auto begin = std::chrono::steady_clock::now();
  std::array<cv::Mat, 2> pictures;
  for (std::size_t e = 0; e < 2; ++e) {
    pictures[e] = cv::Mat(images_[e].height, images_[e].width, CV_8UC3, images_[e].rgb.data());
  }
  out.pictures_stamp = stamp;
  out.surface = tracker_.step(stamp, pictures[0], pictures[1], eyes_at(stamp));
  out.work_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (out.surface) surface_ = out.surface;
}

AttentionOutputs AttentionCore::step(Time now, AttentionInputs inputs) {
  AttentionOutputs out;
  const auto refuse = [&](const Status& status) {
    if (!status) out.warnings.push_back(status.error().message);
  };
  for (const vision::EncoderSample& sample : inputs.head) refuse(head_.add(sample));
  for (const vision::EncoderSample& sample : inputs.torso) refuse(torso_.add(sample));
  const std::array<const std::optional<CameraInfo>*, 2> infos = {&inputs.left_info, &inputs.right_info};
  for (std::size_t e = 0; e < 2; ++e) {
    const auto& info = *infos[e];
    if (!info) continue;
    if (info->width >= 64 && info->height >= 64 && info->fx_px > 0 && info->fy_px > 0 &&
        std::isfinite(info->fx_px + info->fy_px + info->cx_px + info->cy_px)) {
      cameras_[e] = {info->fx_px, info->fy_px, info->cx_px, info->cy_px, info->width, info->height};
    } else {
      out.warnings.emplace_back(
          "a camera's description is of less than 64 x 64 pixels or has no focal length above zero");
    }
  }
  take_picture(0, inputs.left, out);
  take_picture(1, inputs.right, out);
  if (inputs.p_RootFixate_m) {
    const Status set = gaze_->set_goal({"point", "", *inputs.p_RootFixate_m});
    refuse(set);
    if (set) {
      attending_ = true;
      arrived_ = false;
      first_look_since_.reset();
      surface_.reset();
      tracker_.start();
    }
  }
  if (head_.empty() || torso_.empty()) return out;
  if (attending_ && !first_look_since_) first_look_since_ = now;

  // a pair is two pictures of one moment
  if (fresh_[0] && fresh_[1] && images_[0].stamp_ns == images_[1].stamp_ns) {
    fresh_ = {false, false};
    const Time stamp{images_[0].stamp_ns};
    if (arrived_) {
      look(stamp, out);
    } else {
      out.pictures_stamp = stamp;
    }
  }
  if (surface_) {
    const double ahead_s =
        std::clamp(Time{now.ns - surface_->stamp.ns}.seconds() + settings_.lead_s, 0.0, 0.15);
    refuse(gaze_->set_goal({"point", "", surface_->p_Root_m + ahead_s * surface_->v_Root_m_s}));
  }
  vision::GazeController::HeadJoints head{};
  std::copy_n(head_.latest().position_rad.begin(), 6, head.begin());
  std::array<double, 3> torso{};
  std::copy_n(torso_.latest().position_rad.begin(), 3, torso.begin());
  const auto gaze = gaze_->step(now, settings_.period_s, head, torso, head_.speed_rad_s(), std::nullopt);
  out.command_rad = gaze.command_rad;
  if (attending_ && !arrived_) {
    arrived_ = gaze.status.fixated || Time{now.ns - first_look_since_->ns}.seconds() > settings_.settle_s;
  }
  return out;
}

}  // namespace nido::attention
