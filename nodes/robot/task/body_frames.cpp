#include "task/body_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

namespace nido {
namespace {

constexpr std::size_t kMostPut = 300;  // their list is one line of text
constexpr std::size_t kLongestName = 64;

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-./").find(c) != std::string_view::npos;
  });
}

bool is_pose(const Eigen::Isometry3d& X) {
  return X.matrix().allFinite() && X.linear().isUnitary(1e-6) && X.linear().determinant() > 0;
}

}  // namespace

Result<std::unique_ptr<BodyFrames>> BodyFrames::create(RobotModel model,
                                                       std::vector<const IControlBoard*> boards,
                                                       const IClock& clock) {
  auto frames = std::unique_ptr<BodyFrames>(new BodyFrames(std::move(model), std::move(boards), clock));
  for (const IControlBoard* board : frames->boards_) {
    std::vector<int>& places = frames->axes_.emplace_back();
    for (int joint = 0; joint < board->axes(); ++joint) {
      const Result<std::string> name = board->axis_name(joint);
      if (!name) return name.error();
      const Result<int> axis = frames->model_.axis_index(*name);
      if (!axis) return axis.error();
      places.push_back(*axis);
    }
  }
  return frames;
}

Result<BodyFrames::Body> BodyFrames::read() const {
  Eigen::VectorXd axes_rad = model_.zero_axes();
  Body body;
  body.stamp_ns = boards_.empty() ? clock_.now_ns() : std::numeric_limits<std::int64_t>::max();
  for (std::size_t b = 0; b < boards_.size(); ++b) {
    const Result<JointReading> reading = boards_[b]->read_joints();
    if (!reading) return reading.error();
    body.stamp_ns = std::min(body.stamp_ns, reading->stamp_ns);
    for (std::size_t j = 0; j < axes_[b].size(); ++j) axes_rad[axes_[b][j]] = reading->position_rad[j];
  }
  body.X_RootLinks = model_.X_RootLinks(model_.hinge_angles(axes_rad));
  return body;
}

Result<std::vector<Frame>> BodyFrames::frames() const {
  std::vector<Frame> all;
  for (const BodyLink& link : model_.links()) {
    all.push_back(
        {link.name, link.parent < 0 ? "" : model_.links()[static_cast<std::size_t>(link.parent)].name});
  }
  const std::lock_guard lock(mutex_);
  // parents first: those that are further up
  std::vector<std::pair<std::size_t, Frame>> put;
  for (const auto& [name, place] : put_) {
    std::size_t height = 0;
    for (auto above = put_.find(place.parent); above != put_.end(); above = put_.find(above->second.parent)) {
      ++height;
    }
    put.emplace_back(height, Frame{name, place.parent, true});
  }
  std::stable_sort(put.begin(), put.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [height, frame] : put) all.push_back(std::move(frame));
  return all;
}

std::pair<std::string, Eigen::Isometry3d> BodyFrames::climb(const std::string& name) const {
  std::pair<std::string, Eigen::Isometry3d> end{name, Eigen::Isometry3d::Identity()};
  for (auto place = put_.find(name); place != put_.end(); place = put_.find(end.first)) {
    end.second = place->second.X_ParentFrame * end.second;
    end.first = place->second.parent;
  }
  return end;
}

bool BodyFrames::is_known(const std::string& name) const {
  return model_.link_index(name) || put_.count(name) > 0 ||
         std::any_of(put_.begin(), put_.end(), [&](const auto& put) { return put.second.parent == name; });
}

Result<FrameTransform> BodyFrames::transform(const std::string& base, const std::string& frame) const {
  std::pair<std::string, Eigen::Isometry3d> from;
  std::pair<std::string, Eigen::Isometry3d> to;
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : {base, frame}) {
      if (is_known(name)) continue;
      return Error{
          ErrorCode::kNotFound,
          fmt::format("there is no frame '{}': frames are the links of the body, and those that were put",
                      name)};
    }
    from = climb(base);
    to = climb(frame);
  }
  if (from.first == to.first) return FrameTransform{from.second.inverse() * to.second, clock_.now_ns()};
  const Result<int> from_link = model_.link_index(from.first);
  const Result<int> to_link = model_.link_index(to.first);
  if (!from_link || !to_link) {
    return Error{ErrorCode::kFailed,
                 fmt::format("nothing connects '{}' and '{}': it is not known where '{}' is", base, frame,
                             from_link ? to.first : from.first)};
  }
  const Result<Body> body = read();
  if (!body) return body.error();
  const double age_s = static_cast<double>(clock_.now_ns() - body->stamp_ns) * 1e-9;
  if (age_s > kFramesTooOld_s) {
    return Error{ErrorCode::kFailed,
                 fmt::format("the encoders are {:.1f} s old: where '{}' is now is not known", age_s, frame)};
  }
  const Eigen::Isometry3d& X_RootFrom = body->X_RootLinks[static_cast<std::size_t>(*from_link)];
  const Eigen::Isometry3d& X_RootTo = body->X_RootLinks[static_cast<std::size_t>(*to_link)];
  return FrameTransform{(X_RootFrom * from.second).inverse() * X_RootTo * to.second, body->stamp_ns};
}

Status BodyFrames::put(const std::string& parent, const std::string& name,
                       const Eigen::Isometry3d& X_ParentFrame) {
  const auto refuse = [](std::string reason) -> Status {
    return Error{ErrorCode::kInvalidArgument, std::move(reason)};
  };
  if (!is_name(name) || !is_name(parent)) {
    return refuse("a frame's name is 1 to 64 letters, digits or _ - . / characters");
  }
  if (!is_pose(X_ParentFrame)) return refuse("the pose of a frame has finite numbers and a turn");
  if (model_.link_index(name))
    return refuse(fmt::format("'{}' is a link of the body: its joints move it", name));
  const std::lock_guard lock(mutex_);
  if (put_.size() >= kMostPut && put_.count(name) == 0) {
    return refuse(fmt::format("{} frames have been put already: remove some", kMostPut));
  }
  for (std::string above = parent;;) {
    if (above == name) return refuse(fmt::format("'{}' moves with '{}' already", parent, name));
    const auto place = put_.find(above);
    if (place == put_.end()) break;
    above = place->second.parent;
  }
  put_[name] = {parent, X_ParentFrame};
  return {};
}

Status BodyFrames::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (put_.erase(name) > 0) return {};
  return Error{ErrorCode::kNotFound, fmt::format("there is no frame '{}' that was put", name)};
}

Result<std::vector<BodyFrames::Edge>> BodyFrames::edges() const {
  const Result<Body> body = read();
  if (!body) return body.error();
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < body->X_RootLinks.size(); ++i) {
    const BodyLink& link = model_.links()[i];
    if (link.parent < 0) continue;  // the root has no parent
    const auto parent = static_cast<std::size_t>(link.parent);
    edges.push_back(
        {model_.links()[parent].name, link.name, body->X_RootLinks[parent].inverse() * body->X_RootLinks[i]});
  }
  const std::lock_guard lock(mutex_);
  for (const auto& [name, place] : put_) edges.push_back({place.parent, name, place.X_ParentFrame});
  return edges;
}

}  // namespace nido
