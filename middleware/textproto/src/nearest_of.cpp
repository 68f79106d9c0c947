#include "nearest_of.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace nido {
namespace {

// letters to insert, drop or replace
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string_view nearest_of(std::string_view given, std::span<const std::string_view> words) {
  std::string_view best;
  std::size_t best_distance = 3;  // more than two letters wrong is another word
  for (const std::string_view word : words) {
    // a longer spelling of the same ("encoders" for encs) counts too
    const bool begins = given.size() >= 3 && word.starts_with(given.substr(0, 3));
    const std::size_t apart = begins ? 1 : distance(given, word);
    if (apart < best_distance && apart < given.size()) {
      best = word;
      best_distance = apart;
    }
  }
  return best;
}

}  // namespace nido
