#include "random_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "world_file.h"

namespace nido::sim {
namespace {

// Where things may stand on the table.
struct Region {
  double min_x_m = 0;
  double max_x_m = 0;
  double min_y_m = 0;
  double max_y_m = 0;
};

// an even number in [0, 1), the same with every standard library
double even(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1.0p-53; }

std::size_t pick(std::mt19937_64& random, std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(even(random) * static_cast<double>(count)));
}

std::vector<Region> read_regions(YamlReader& map, const char* key) {
  std::vector<Region> regions;
  for (std::size_t i = 0; i < map.count(key); ++i) {
    YamlReader item = map.item(key, i);
    item.allow({"x_m", "y_m"});
    const std::vector<double> x = item.numbers("x_m", {0, 0}, 2, 2, -5, 5);
    const std::vector<double> y = item.numbers("y_m", {0, 0}, 2, 2, -5, 5);
    if (!item.has("x_m") || !item.has("y_m") || x[0] > x[1] || y[0] > y[1]) {
      item.complain(nullptr, "needs x_m: [lowest, highest] and y_m: [lowest, highest]");
    }
    map.adopt(item);
    regions.push_back({x[0], x[1], y[0], y[1]});
  }
  if (regions.empty()) map.complain(key, "must list at least one region {x_m: [a, b], y_m: [c, d]}");
  return regions;
}

// What an object needs of the table, drawn up once: many places are tried.
struct Outline {
  explicit Outline(const ObjectDescription& object, bool basket) : is_basket(basket) {
    const Eigen::AlignedBox3d box = bounds(object);
    radius_m = std::hypot(std::max(std::abs(box.min().x()), std::abs(box.max().x())),
                          std::max(std::abs(box.min().y()), std::abs(box.max().y())));
    half_m = (box.sizes() / 2).head<2>();
  }
  bool is_basket;
  double radius_m;         // of the circle that holds it at any yaw
  Eigen::Vector2d half_m;  // of its rectangle when it is not turned
};

// free space between two things: circles, but for a basket, which is not turned and so is its rectangle
double space_between(const Outline& a, const Eigen::Vector2d& p_a, const Outline& b,
                     const Eigen::Vector2d& p_b) {
  if (a.is_basket == b.is_basket) return (p_a - p_b).norm() - a.radius_m - b.radius_m;
  if (b.is_basket) return space_between(b, p_b, a, p_a);
  const Eigen::Vector2d beyond = ((p_b - p_a).cwiseAbs() - a.half_m).cwiseMax(0);
  return beyond.norm() - b.radius_m;
}

}  // namespace

Status place_at_random(YamlReader map, const SimulationOptions& options, double table_height_m,
                       const std::function<Result<ObjectDescription>(const std::string&)>& named,
                       std::vector<ObjectDescription>& objects) {
  map.allow({"candidates", "distractors", "gap_m", "target_gap_m", "target_regions", "distractor_regions",
             "basket", "basket_regions", "yaw_deg"});
  std::vector<std::string> candidates = map.names("candidates");
  const std::vector<double> count = map.numbers("distractors", {3, 3}, 2, 2, 0, 50);
  const double gap_m = map.number("gap_m", 0.02, 0, 1);
  const double target_gap_m = map.number("target_gap_m", gap_m, 0, 1);
  const double yaw_deg = map.number("yaw_deg", 180, 0, 180);
  const std::vector<Region> target_regions = read_regions(map, "target_regions");
  const std::vector<Region> distractor_regions = read_regions(map, "distractor_regions");
  const std::string basket = map.text("basket", "");
  const std::vector<Region> basket_regions =
      basket.empty() ? std::vector<Region>{} : read_regions(map, "basket_regions");
  if (candidates.empty()) map.complain("candidates", "must list at least one object");
  if (count[0] > count[1]) map.complain("distractors", "must be [fewest, most]");
  if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};

  std::mt19937_64 random(options.seed * 0x9E3779B97F4A7C15ULL + 0x632BE59BD9B4E019ULL);
  std::string target = options.target;
  if (target.empty()) target = candidates[pick(random, candidates.size())];
  std::erase(candidates, target);

  // target and basket first: they have the least room; then distractors in a drawn order
  std::vector<std::pair<std::string, const std::vector<Region>*>> wanted;
  if (!basket.empty()) wanted.emplace_back(basket, &basket_regions);
  wanted.emplace_back(target, &target_regions);
  const auto distractors =
      static_cast<std::size_t>(count[0]) +
      pick(random, static_cast<std::size_t>(count[1]) - static_cast<std::size_t>(count[0]) + 1);
  for (std::size_t i = 0; i < distractors && !candidates.empty(); ++i) {
    const std::size_t chosen = pick(random, candidates.size());
    wanted.emplace_back(candidates[chosen], &distractor_regions);
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(chosen));
  }

  std::vector<ObjectDescription> types;
  std::vector<Outline> outlines;
  for (const auto& [name, regions] : wanted) {
    auto object = named(name);
    if (!object) {
      map.complain(nullptr, "cannot be drawn: " + object.error().message);
      return Error{object.error().code, map.trouble()};
    }
    types.push_back(std::move(*object));
    outlines.emplace_back(types.back(), !basket.empty() && types.back().name == basket);
  }

  constexpr int kTables = 400;
  constexpr int kTriesForObject = 60;
  for (int attempt = 0; attempt < kTables; ++attempt) {
    std::vector<Eigen::Vector2d> places;
    for (std::size_t i = 0; i < types.size(); ++i) {
      bool placed = false;
      for (int t = 0; t < kTriesForObject && !placed; ++t) {
        const std::vector<Region>& regions = *wanted[i].second;
        const Region& r = regions[pick(random, regions.size())];
        const Eigen::Vector2d p(r.min_x_m + even(random) * (r.max_x_m - r.min_x_m),
                                r.min_y_m + even(random) * (r.max_y_m - r.min_y_m));
        bool free = true;
        for (std::size_t k = 0; k < places.size(); ++k) {
          const bool beside_target = types[i].name == target || types[k].name == target;
          free = free && space_between(outlines[i], p, outlines[k], places[k]) >=
                             (beside_target ? target_gap_m : gap_m);
        }
        if (!free) continue;
        places.push_back(p);
        placed = true;
      }
      if (!placed) break;
    }
    if (places.size() < types.size()) continue;
    for (std::size_t i = 0; i < types.size(); ++i) {
      const bool turned = types[i].name != basket;
      const double yaw = turned ? (2 * even(random) - 1) * yaw_deg * std::numbers::pi / 180 : 0;
      ObjectDescription object = types[i];
      object.X_WorldObject.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      object.X_WorldObject.translation() =
          Eigen::Vector3d(places[i].x(), places[i].y(),
                          table_height_m + standing_height(object, object.X_WorldObject.linear()));
      objects.push_back(std::move(object));
    }
    return {};
  }
  map.complain(nullptr, "leaves no room for " + std::to_string(types.size()) +
                            " objects; widen the regions or lower gap_m");
  return Error{ErrorCode::kInvalidArgument, map.trouble()};
}

}  // namespace nido::sim
