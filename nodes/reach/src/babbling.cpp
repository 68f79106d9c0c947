#include "nido/reach/babbling.h"

#include <algorithm>
#include <cmath>

namespace nido::reach {
namespace {

constexpr double kRamp_s = 0.2;  // to full speed and from it

}  // namespace

Babbling::Babbling(const ArmChain& chain, const BabblingOptions& options)
    : drawer_(chain, options.side, options.whole_body), options_(options), random_(options.seed) {}

void Babbling::start_move(double now_s) {
  for (int tries = 0; tries < 40; ++tries) {
    path_ = JointPath({*command_, drawer_.draw(random_).value_or(*command_)}, options_.speed_rad_s);
    if (std::ranges::all_of(path_.points(), [&](const Joints& q) { return drawer_.is_clear_of_body(q); }))
      break;
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
