#include "nido/vision/head_history.h"

#include <algorithm>
#include <cmath>

namespace nido::vision {

Status EncoderHistory::add(const EncoderSample& sample) {
  if (sample.position_rad.size() != joint_count_) {
    return Error{ErrorCode::kInvalidArgument, "the state of a board has " +
                                                  std::to_string(sample.position_rad.size()) +
                                                  " joints, expected " + std::to_string(joint_count_)};
  }
  if (!std::all_of(sample.position_rad.begin(), sample.position_rad.end(),
                   [](double v) { return std::isfinite(v); })) {
    return Error{ErrorCode::kInvalidArgument,
                 "the state of a board holds a position that is not a finite number"};
  }
  if (!samples_.empty()) {
    const std::int64_t ahead = sample.stamp.ns - samples_.back().stamp.ns;
    if (ahead == 0) return {};
    if (ahead < 0)
      return Error{ErrorCode::kInvalidArgument, "the state of a board is older than the one before"};
  }
  samples_.push_back(sample);
  while (samples_.back().stamp.ns - samples_.front().stamp.ns > 1'000'000'000) samples_.pop_front();
  return {};
}

std::vector<double> EncoderHistory::at(Time time) const {
  if (samples_.empty()) return {};
  auto after = std::lower_bound(samples_.begin(), samples_.end(), time,
                                [](const EncoderSample& s, Time t) { return s.stamp < t; });
  if (after == samples_.end()) return samples_.back().position_rad;
  if (after == samples_.begin() || after->stamp == time) return after->position_rad;
  const auto before = after - 1;
  const double share = static_cast<double>(time.ns - before->stamp.ns) /
                       static_cast<double>(after->stamp.ns - before->stamp.ns);
  std::vector<double> result(joint_count_);
  for (std::size_t i = 0; i < joint_count_; ++i) {
    result[i] = before->position_rad[i] + share * (after->position_rad[i] - before->position_rad[i]);
  }
  return result;
}

double EncoderHistory::speed_rad_s() const {
  if (samples_.size() < 2) return 0;
  const EncoderSample& a = samples_[samples_.size() - 2];
  const EncoderSample& b = samples_.back();
  const double dt = Time{b.stamp.ns - a.stamp.ns}.seconds();
  double fastest = 0;
  for (std::size_t i = 0; i < joint_count_; ++i) {
    fastest = std::max(fastest, std::abs(b.position_rad[i] - a.position_rad[i]) / dt);
  }
  return fastest;
}

}  // namespace nido::vision
