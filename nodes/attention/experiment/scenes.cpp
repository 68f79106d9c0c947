#include "scenes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace nido::attention {
namespace {

constexpr double kTable_Root_m = -0.0826;  // top of the table of config/worlds/attention.yaml
constexpr double kStill_s = 1.0;           // before the target begins to move
constexpr double kRamp_s = 0.8;            // until it moves in full
constexpr std::size_t kTargets = 6;        // of things() that may be attended to
constexpr int kOthers = 4;

double sway_at(const Scene::Sway& sway, double time_s) {
  double sum = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    sum += sway.amplitude[i] *
           (std::sin(sway.frequency_rad_s[i] * time_s + sway.phase_rad[i]) - std::sin(sway.phase_rad[i]));
  }
  return sum;
}

}  // namespace

double Thing::half_height_m() const {
  if (shape == Shape::kBall) return size_m.x();
  return shape == Shape::kCylinder ? size_m.y() / 2 : size_m.z() / 2;
}

const std::vector<Thing>& things() {
  using enum Thing::Shape;
  static const std::vector<Thing> list = {
      {"red cube", kBox, {0.05, 0.05, 0.05}},
      {"green ball", kBall, {0.03, 0, 0}},
      {"yellow tin", kCylinder, {0.024, 0.06, 0}},
      {"woven parcel", kBox, {0.06, 0.05, 0.07}},
      {"checked drum", kCylinder, {0.03, 0.07, 0}},
      {"wooden block", kBox, {0.07, 0.05, 0.06}},
      {"second red cube", kBox, {0.05, 0.05, 0.05}},
      {"second green ball", kBall, {0.03, 0, 0}},
      {"second yellow tin", kCylinder, {0.024, 0.06, 0}},
      {"second parcel", kBox, {0.06, 0.05, 0.07}},
  };
  return list;
}

Scene make_scene(std::uint64_t seed, int number) {
  std::seed_seq words{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(number)};
  std::mt19937_64 random(words);
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  Scene scene;
  scene.number = number;
  scene.clutter = number % 2 == 1;
  scene.moving = number / 2 % 2 == 1;
  scene.target.thing = static_cast<int>(random() % kTargets);
  const Thing& target = things()[static_cast<std::size_t>(scene.target.thing)];
  const Eigen::Vector2d middle(uniform(-0.38, -0.31), uniform(-0.09, 0.09));
  const double above_m = scene.moving ? uniform(0.10, 0.14) : 0.0;
  scene.target.X_RootThing.translation() << middle, kTable_Root_m + target.half_height_m() + above_m;
  scene.target.X_RootThing.linear() =
      Eigen::AngleAxisd(uniform(-M_PI, M_PI), Eigen::Vector3d::UnitZ()).toRotationMatrix();

  if (scene.clutter) {
    std::vector<int> rest(things().size());
    std::iota(rest.begin(), rest.end(), 0);
    std::erase(rest, scene.target.thing);
    std::shuffle(rest.begin(), rest.end(), random);
    for (int i = 0; i < kOthers; ++i) {
      const int index = rest[static_cast<std::size_t>(i)];
      // beside or behind the target, so that it stays in view, and not into one another
      for (int attempt = 0; attempt < 200; ++attempt) {
        const Eigen::Vector2d p(uniform(-0.46, -0.30), uniform(-0.20, 0.20));
        const bool before_target =
            !scene.moving && p.x() > middle.x() + 0.02 && std::abs(p.y() - middle.y()) < 0.09;
        bool free = !before_target && (scene.moving || (p - middle).norm() > 0.085);
        for (const Placed& other : scene.others)
          free = free && (p - other.X_RootThing.translation().head<2>()).norm() > 0.085;
        if (!free) continue;
        Placed placed;
        placed.thing = index;
        placed.X_RootThing.translation() << p,
            kTable_Root_m + things()[static_cast<std::size_t>(index)].half_height_m();
        placed.X_RootThing.linear() =
            Eigen::AngleAxisd(uniform(-M_PI, M_PI), Eigen::Vector3d::UnitZ()).toRotationMatrix();
        scene.others.push_back(placed);
        break;
      }
    }
  }
  std::normal_distribution<double> off(0, 0.01);
  scene.p_RootHint_m =
      scene.target.X_RootThing.translation() + Eigen::Vector3d(off(random), off(random), off(random));
  if (scene.moving) {
    const Eigen::Vector3d reach_m(0.035, 0.05, 0.02);  // towards the robot, aside, up
    for (std::size_t i = 0; i < 3; ++i) {
      Scene::Sway& sway = scene.sway[i];
      for (std::size_t k = 0; k < 2; ++k) {
        sway.amplitude[k] = reach_m[static_cast<Eigen::Index>(i)] * uniform(0.5, 1.0) * (k == 0 ? 1.0 : 0.4);
        sway.frequency_rad_s[k] = uniform(1.0, 2.0) * (k == 0 ? 1.0 : 1.8);
        sway.phase_rad[k] = uniform(-0.6, 0.6) + (random() % 2 == 0 ? 0 : M_PI);
      }
    }
    scene.turn.amplitude = {uniform(0.4, 0.9), uniform(0.1, 0.3)};
    scene.turn.frequency_rad_s = {uniform(0.8, 1.5), uniform(1.5, 2.5)};
    scene.turn.phase_rad = {uniform(-M_PI, M_PI), uniform(-M_PI, M_PI)};
  }
  return scene;
}

Eigen::Isometry3d target_at(const Scene& scene, double time_s) {
  Eigen::Isometry3d X = scene.target.X_RootThing;
  if (!scene.moving || time_s <= kStill_s) return X;
  // time itself starts smoothly
  const double t = time_s - kStill_s;
  const double path_s = t < kRamp_s ? t * t / (2 * kRamp_s) : t - kRamp_s / 2;
  for (std::size_t i = 0; i < 3; ++i)
    X.translation()[static_cast<Eigen::Index>(i)] += sway_at(scene.sway[i], path_s);
  X.linear() = Eigen::AngleAxisd(sway_at(scene.turn, path_s), Eigen::Vector3d::UnitZ()).toRotationMatrix() *
               X.linear();
  return X;
}

}  // namespace nido::attention
