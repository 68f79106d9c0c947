#pragma once

#include <array>
#include <vector>

namespace nido {

// 95 % interval of a proportion after `successes` of `n` trials (Wilson's score interval); [0, 1] when n is
// 0.
std::array<double, 2> wilson_interval(int successes, int n);

// Value below which a share `q` (0..1) of the samples lies, linear between neighbours. NaN without samples.
double quantile(std::vector<double> samples, double q);
double median(std::vector<double> samples);
// 95 % interval of the median by order statistics (distribution-free); NaN without samples.
std::array<double, 2> median_interval(std::vector<double> samples);

double mean(const std::vector<double>& samples);  // NaN without samples
// 95 % interval of the mean by Student's t; NaN with fewer than two samples.
std::array<double, 2> mean_interval(const std::vector<double>& samples);

}  // namespace nido
