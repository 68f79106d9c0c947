#include "report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace nido::bench {

double quantile(std::vector<double> values, double q) {
  const auto rank = static_cast<std::size_t>(q * static_cast<double>(values.size()));
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::min(values.size() - 1, rank));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

void Report::add(const std::string& who, const std::string& metric, double value, const std::string& unit,
                 std::size_t n) {
  rows_.push_back({who, metric, value, unit, n});
}

void Report::add_quantiles(const std::string& who, const std::string& metric, std::vector<double> values,
                           const std::string& unit) {
  if (values.empty()) {
    return;
  }
  add(who, metric + "_p50", quantile(values, 0.5), unit, values.size());
  add(who, metric + "_p99", quantile(values, 0.99), unit, values.size());
}

void Report::leave_out(const std::string& who, const std::string& why) { absent_.push_back({who, why}); }

void Report::print(bool as_json) const {
  if (as_json) {
    nlohmann::ordered_json out = {{"bench", bench_}, {"rows", nlohmann::ordered_json::array()}};
    for (const Row& row : rows_) {
      out["rows"].push_back({{"who", row.who},
                             {"metric", row.metric},
                             {"value", std::round(row.value * 1e4) / 1e4},
                             {"unit", row.unit},
                             {"n", row.n}});
    }
    for (const Absent& absent : absent_) {
      out["absent"].push_back({{"who", absent.who}, {"why", absent.why}});
    }
    fmt::print("{}\n", out.dump());
    return;
  }
  std::size_t who_width = 0;
  std::size_t metric_width = 0;
  for (const Row& row : rows_) {
    who_width = std::max(who_width, row.who.size());
    metric_width = std::max(metric_width, row.metric.size());
  }
  for (const Row& row : rows_) {
    fmt::print("{:<{}}  {:<{}}  {:>10.2f} {:<6} n={}\n", row.who, who_width, row.metric, metric_width,
               row.value, row.unit, row.n);
  }
  for (const Absent& absent : absent_) {
    fmt::print("{}: left out, {}\n", absent.who, absent.why);
  }
}

}  // namespace nido::bench
