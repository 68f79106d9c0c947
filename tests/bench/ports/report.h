#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nido::bench {

// What a benchmark prints: rows of `nido bench NAME --json` (docs/bench.md).
class Report {
 public:
  explicit Report(std::string bench) : bench_(std::move(bench)) {}
  void add(const std::string& who, const std::string& metric, double value, const std::string& unit,
           std::size_t n);
  // Median, 99 % quantile; nothing when there are no values.
  void add_quantiles(const std::string& who, const std::string& metric, std::vector<double> values,
                     const std::string& unit);
  // A contender that this machine or this build does not have, with the reason.
  void leave_out(const std::string& who, const std::string& why);
  void print(bool as_json) const;

 private:
  struct Row {
    std::string who;
    std::string metric;
    double value = 0;
    std::string unit;
    std::size_t n = 0;
  };
  struct Absent {
    std::string who;
    std::string why;
  };
  std::string bench_;
  std::vector<Row> rows_;
  std::vector<Absent> absent_;
};

// Nearest rank; `values` is not empty.
double quantile(std::vector<double> values, double q);

}  // namespace nido::bench
