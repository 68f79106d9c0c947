#include "nido/report/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nido {

namespace {

constexpr double kZ = 1.959963984540054;  // 97.5 % point of the normal distribution
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// 97.5 % point of Student's t; series in 1/df about the normal one (Cornish and Fisher), exact values where
// it is coarse
double student_t(long degrees) {
  constexpr std::array<double, 5> kSmall = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706};
  if (degrees <= static_cast<long>(kSmall.size())) return kSmall[static_cast<std::size_t>(degrees - 1)];
  const double v = static_cast<double>(degrees);
  const double z3 = kZ * kZ * kZ;
  const double z5 = z3 * kZ * kZ;
  return kZ + (z3 + kZ) / (4 * v) + (5 * z5 + 16 * z3 + 3 * kZ) / (96 * v * v);
}

}  // namespace

std::array<double, 2> wilson_interval(int successes, int n) {
  if (n <= 0) return {0.0, 1.0};
  const double count = n;
  const double p = successes / count;
  const double z2 = kZ * kZ;
  const double centre = (p + z2 / (2 * count)) / (1 + z2 / count);
  const double half = kZ / (1 + z2 / count) * std::sqrt(p * (1 - p) / count + z2 / (4 * count * count));
  return {std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

double quantile(std::vector<double> samples, double q) {
  if (samples.empty()) return kNan;
  std::sort(samples.begin(), samples.end());
  const double place = std::clamp(q, 0.0, 1.0) * static_cast<double>(samples.size() - 1);
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, samples.size() - 1);
  return samples[low] + (place - static_cast<double>(low)) * (samples[high] - samples[low]);
}

double median(std::vector<double> samples) { return quantile(std::move(samples), 0.5); }

std::array<double, 2> median_interval(std::vector<double> samples) {
  if (samples.empty()) return {kNan, kNan};
  std::sort(samples.begin(), samples.end());
  const double n = static_cast<double>(samples.size());
  const auto low = static_cast<long>(std::floor(n / 2 - kZ * std::sqrt(n) / 2));
  const auto high = static_cast<long>(std::ceil(n / 2 + kZ * std::sqrt(n) / 2)) - 1;
  const auto last = static_cast<long>(samples.size()) - 1;
  return {samples[static_cast<std::size_t>(std::clamp(low, 0L, last))],
          samples[static_cast<std::size_t>(std::clamp(high, 0L, last))]};
}

double mean(const std::vector<double>& samples) {
  if (samples.empty()) return kNan;
  double sum = 0.0;
  for (const double sample : samples) sum += sample;
  return sum / static_cast<double>(samples.size());
}

std::array<double, 2> mean_interval(const std::vector<double>& samples) {
  if (samples.size() < 2) return {kNan, kNan};
  const double centre = mean(samples);
  double squares = 0.0;
  for (const double sample : samples) squares += (sample - centre) * (sample - centre);
  const double n = static_cast<double>(samples.size());
  const double half = student_t(static_cast<long>(samples.size()) - 1) * std::sqrt(squares / (n - 1) / n);
  return {centre - half, centre + half};
}

}  // namespace nido
