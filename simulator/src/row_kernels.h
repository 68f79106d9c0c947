#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace nido::sim {

// The arithmetic in which contacts spend their time: rows of one group against the speeds that they act on.
// Two numbers at once, as every processor of this kind can, always added up in the same order. What is read
// two at once must have been written so. `width` is a multiple of kLanes; rows lie one behind the other.
inline constexpr std::size_t kLanes = 2;
inline constexpr std::size_t kMostRowsOfGroup = 6;

using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

// How many numbers a row of `count` takes.
[[nodiscard]] constexpr std::size_t padded(std::size_t count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

// products[r] = rows[r] . x
template <std::size_t kRows>
inline void multiply(const double* rows, std::size_t width, const double* x, double* products) {
  Lanes sums[kRows] = {};
  for (std::size_t k = 0; k < width; k += kLanes) {
    Lanes xs;
    std::memcpy(&xs, x + k, sizeof xs);
#pragma GCC unroll 6
    for (std::size_t r = 0; r < kRows; ++r) {
      Lanes values;
      std::memcpy(&values, rows + r * width + k, sizeof values);
      sums[r] += values * xs;
    }
  }
#pragma GCC unroll 6
  for (std::size_t r = 0; r < kRows; ++r) products[r] = sums[r][0] + sums[r][1];
}

// x += sum of weights[r] rows[r]
template <std::size_t kRows>
inline void add_rows(const double* rows, std::size_t width, const double* weights, double* x) {
  for (std::size_t k = 0; k < width; k += kLanes) {
    Lanes xs;
    std::memcpy(&xs, x + k, sizeof xs);
#pragma GCC unroll 6
    for (std::size_t r = 0; r < kRows; ++r) {
      Lanes values;
      std::memcpy(&values, rows + r * width + k, sizeof values);
      xs += weights[r] * values;
    }
    std::memcpy(x + k, &xs, sizeof xs);
  }
}

// Calls `work` with the number of rows as a constant.
template <typename Work>
inline void with_rows(std::size_t rows, Work&& work) {
  switch (rows) {
    case 1:
      return work.template operator()<1>();
    case 2:
      return work.template operator()<2>();
    case 3:
      return work.template operator()<3>();
    case 4:
      return work.template operator()<4>();
    case 5:
      return work.template operator()<5>();
    default:
      return work.template operator()<6>();
  }
}

}  // namespace nido::sim
