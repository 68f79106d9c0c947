#include "skin.h"

#include <cmath>

namespace nido::sim {
namespace {

// Rubber of a few millimetres lies over the taxels: those around a contact feel it, the nearer the more. What
// lies farther than the reach from every taxel is beside the skin, or in a gap of it.
constexpr double kSpread_m = 0.005;
constexpr double kReach_m = 0.016;

}  // namespace

Skin::Skin(std::vector<SkinPatch> patches) : patches_(std::move(patches)), sum_N_(patches_.size()) {
  clear();
}

void Skin::clear() {
  state_.touch.assign(patches_.size(), {});
  state_.fault.assign(patches_.size(), SkinFault::kNone);
}

int Skin::patch_on(std::string_view urdf_link) const {
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (patches_[i].link == urdf_link) return static_cast<int>(i);
  }
  return -1;
}

void Skin::begin_period() {
  for (std::vector<double>& sum : sum_N_) sum.clear();
}

void Skin::press(std::size_t patch, const Eigen::Vector3d& p_Link_m, double force_N) {
  if (!(force_N > 0)) return;
  const std::vector<Taxel>& taxels = patches_[patch].taxels;
  weights_.assign(taxels.size(), 0);
  double all = 0;
  for (std::size_t i = 0; i < taxels.size(); ++i) {
    const double square_m2 = (taxels[i].p_Link_m - p_Link_m).squaredNorm();
    if (square_m2 > kReach_m * kReach_m) continue;
    weights_[i] = std::exp(-square_m2 / (2 * kSpread_m * kSpread_m));
    all += weights_[i];
  }
  if (all <= 0) return;
  std::vector<double>& sum = sum_N_[patch];
  sum.resize(taxels.size());
  for (std::size_t i = 0; i < taxels.size(); ++i) sum[i] += force_N * weights_[i] / all;
}

void Skin::end_period(int steps) {
  for (std::size_t patch = 0; patch < patches_.size(); ++patch) {
    if (state_.fault[patch] == SkinFault::kStuck) continue;
    std::vector<TaxelForce>& touch = state_.touch[patch];
    touch.clear();
    if (state_.fault[patch] == SkinFault::kOff) continue;
    for (std::size_t i = 0; i < sum_N_[patch].size(); ++i) {
      if (sum_N_[patch][i] > 0) touch.push_back({patches_[patch].taxels[i].value, sum_N_[patch][i] / steps});
    }
  }
}

}  // namespace nido::sim
