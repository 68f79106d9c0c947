#include "nido/reach/babbling.h"

#include <algorithm>
#include <cmath>

namespace nido::reach {
namespace {

constexpr double kRamp_s = 0.2;  // to full speed and from it
const Eigen::Vector3d kEyes_Root_m(-0.06, 0.0, 0.34);

}  // namespace

Babbling::Babbling(ArmChain chain, BabblingOptions options)
    : chain_(std::move(chain)), options_(options), random_(options.seed) {}

bool Babbling::is_clear_of_body(const Joints& q) const {
  return std::ranges::all_of(chain_.body_points(q), [](const ArmChain::BodyPoint& point) {
    const Eigen::Vector3d& p = point.p_Root_m;
    const bool in_trunk = p.x() > -0.11 && p.x() < 0.12 && std::abs(p.y()) < 0.13 && p.z() < 0.24;
    const bool in_head = (p - Eigen::Vector3d(-0.03, 0.0, 0.32)).norm() < 0.13;
    return !in_trunk && !in_head;
  });
}

bool Babbling::is_useful(const Joints& q) const {
  const Eigen::Isometry3d X = chain_.X_RootPalm(q);
  const Eigen::Vector3d p = X.translation();
  const bool in_space =
      (p - options_.space_min_Root_m).minCoeff() >= 0.0 && (options_.space_max_Root_m - p).minCoeff() >= 0.0;
  const Eigen::Vector3d back_of_hand = -X.linear().col(2);
  return in_space && back_of_hand.dot((kEyes_Root_m - p).normalized()) > 0.35 && is_clear_of_body(q);
}

Joints Babbling::draw_posture() {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Joints q;
  for (int tries = 0; tries < 200000; ++tries) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const bool moves = (joint >= kTorsoJoints && joint < kTorsoJoints + 5) || options_.whole_body;
      double low = chain_.min()(joint);
      double high = chain_.max()(joint);
      if (joint < kTorsoJoints) {  // the trunk sways a little
        low = std::max(low, joint == 2 ? -0.1 : -0.35);
        high = std::min(high, joint == 1 ? 0.35 : 0.5);
        if (joint == 1) low = -0.15, high = 0.15;
      }
      const double drawn = low + share(random_) * (high - low);
      q(joint) = moves ? drawn : std::clamp(0.0, low, high);
    }
    if (is_useful(q)) return q;
  }
  return command_.value_or(Joints::Zero());
}

void Babbling::start_move(double now_s) {
  for (int tries = 0; tries < 40; ++tries) {
    path_ = JointPath({*command_, draw_posture()}, options_.speed_rad_s);
    if (std::ranges::all_of(path_.points(), [&](const Joints& q) { return is_clear_of_body(q); })) break;
  }
  move_begin_s_ = now_s;
}

double Babbling::move_duration_s() const { return path_.full_speed_s() + kRamp_s; }

// Rest to rest at an even speed but for the ramps: pictures of a slow hand would show the same posture again.
Joints Babbling::on_way(double t_s) const {
  const double total_s = path_.full_speed_s();
  const double ramp_s = std::min(kRamp_s, total_s);  // a short way never gets to full speed
  const double end_s = total_s + ramp_s;
  const double t = std::clamp(t_s, 0.0, end_s);
  double way_s = t - ramp_s / 2.0;
  if (t < ramp_s) way_s = t * t / (2.0 * ramp_s);
  if (t > end_s - ramp_s) way_s = total_s - (end_s - t) * (end_s - t) / (2.0 * ramp_s);
  return path_.along(total_s > 0.0 ? way_s / total_s : 1.0);
}

std::optional<Joints> Babbling::step(double now_s, const std::optional<Joints>& measured_rad,
                                     const std::optional<HandSighting>& hand) {
  if (measured_rad && measured_rad->allFinite()) {
    history_.emplace_back(now_s, *measured_rad);
    while (history_.front().first < now_s - 1.0) history_.pop_front();
  }
  if (history_.empty() || complete()) return std::nullopt;
  if (hand && hand->p_Root_m.allFinite()) {
    if (const auto then = posture_at(history_, hand->time_s)) {
      const bool is_new =
          samples_.empty() || (samples_.back().q - *then).cwiseAbs().maxCoeff() > options_.spacing_rad;
      if (is_new) samples_.push_back({*then, hand->p_Root_m});
    }
  }
  if (!command_) {
    command_ = history_.back().second;
    start_move(now_s);
  }
  if (now_s - move_begin_s_ > move_duration_s()) start_move(now_s);
  command_ = on_way(now_s - move_begin_s_);
  return command_;
}

Status save_samples(const std::filesystem::path& path, const std::vector<BabblingSample>& samples,
                    const std::string& command) {
  if (samples.empty()) return Error{ErrorCode::kFailed, "babbling gave no sighting of the hand"};
  learning::WeightsFile file;
  file.command = command;
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(samples.size()), kJoints + 3);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) << samples[i].q.transpose(), samples[i].p_Root_m.transpose();
  }
  file.matrices["samples"] = rows;
  return file.save(path.string());
}

Result<std::vector<BabblingSample>> load_samples(const std::filesystem::path& path) {
  auto file = learning::WeightsFile::load(path.string());
  if (!file) return file.error();
  auto rows = file->matrix("samples", -1, kJoints + 3);
  if (!rows) return Error{rows.error().code, path.string() + ": " + rows.error().message};
  std::vector<BabblingSample> samples(static_cast<std::size_t>(rows->rows()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto row = rows->row(static_cast<Eigen::Index>(i));
    samples[i] = {row.head<kJoints>().transpose(), row.tail<3>().transpose()};
  }
  return samples;
}

}  // namespace nido::reach
