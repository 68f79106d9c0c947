// Tries grasp postures in the simulator, from true positions:
//   grasp_probe map SHAPE [FILE]        where on the table lifting and dropping into the basket works (about
//   a minute a row) grasp_probe tables N [TARGET]       on N random tables grasp_probe search SHAPE SECONDS
//   better postures, from the one in the file
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <random>

#include "grasp_trial.h"

namespace nido::sim {
namespace {

std::string config(const std::string& file) { return std::string(NIDO_CONFIG_DIR) + "/" + file; }

std::string object_of(const std::string& shape) { return shape == "box" ? "cube" : shape; }

SimulationOptions with_thing(const std::string& shape, const Eigen::Vector2d& p, double yaw_deg,
                             bool basket) {
  SimulationOptions options;
  options.urdf_path = config("robots/icub.urdf");
  options.world_yaml = "table: {}\nobjects:\n  - {object: " + object_of(shape) +
                       ", name: thing, position_m: [" + std::to_string(p.x()) + ", " + std::to_string(p.y()) +
                       "], yaw_deg: " + std::to_string(yaw_deg) + "}\n";
  if (basket) options.world_yaml += "  - {object: basket, name: basket, position_m: [-0.32, 0.25]}\n";
  return options;
}

int map(const ArmReach& reach, const GraspPosture& posture, const std::string& shape) {
  std::mt19937 random(3);
  std::printf(
      "x down, y across (m); + in the basket, o held but not dropped in, x not held, . out of reach\n      "
      " ");
  for (double y = -0.06; y < 0.145; y += 0.02) std::printf("%6.2f", y);
  std::printf("\n");
  for (double x = -0.22; x > -0.45; x -= 0.02) {
    std::printf("%6.2f ", x);
    for (double y = -0.06; y < 0.145; y += 0.02) {
      auto sim = Simulation::create(with_thing(shape, {x, y}, static_cast<double>(random() % 90), true));
      if (!sim) return std::puts(sim.error().message.c_str()), 1;
      GraspTrial trial{"thing", Eigen::Vector3d::Zero(), "basket", 0.3};
      for (int i = 0; i < 3; ++i)
        trial.error_Root_m[i] = (static_cast<double>(random() % 1001) / 500 - 1) * (i < 2 ? 0.006 : 0.003);
      const GraspResult r = try_grasp(**sim, reach, posture, trial);
      std::printf("     %c", !r.trouble.empty() ? '.' : r.in_basket ? '+' : r.hold.held() ? 'o' : 'x');
      std::fflush(stdout);
    }
    std::printf("\n");
  }
  return 0;
}

int tables(const ArmReach& reach, const std::map<std::string, GraspPosture>& postures, int count,
           const std::string& target) {
  int done = 0;
  for (int seed = 1; seed <= count; ++seed) {
    SimulationOptions options;
    options.urdf_path = config("robots/icub.urdf");
    options.world_path = config("worlds/random_table.yaml");
    options.seed = static_cast<std::uint64_t>(seed);
    options.target = target;
    auto sim = Simulation::create(options);
    if (!sim) return std::puts(sim.error().message.c_str()), 1;
    const ObjectState thing = *(*sim)->object(target);
    const Eigen::Vector3d p = thing.X_WorldObject.translation();
    const std::string shape = target.substr(target.rfind(' ') + 1);
    const GraspResult r =
        try_grasp(**sim, reach, postures.at(shape), {target, Eigen::Vector3d::Zero(), "basket", 0.5});
    done += r.in_basket ? 1 : 0;
    std::printf("table %d: %s at %.3f %.3f: %s%s lifted %.3f m\n", seed, target.c_str(), p.x(), p.y(),
                r.trouble.c_str(),
                r.in_basket     ? "in the basket"
                : r.hold.held() ? "held, not in the basket"
                                : "not held",
                r.lifted_m);
    std::fflush(stdout);
  }
  std::printf("%d of %d in the basket\n", done, count);
  return 0;
}

// held at places all over the table, with errors; 0..1 and a little for each partial success
double score(const ArmReach& reach, const GraspPosture& posture, const std::string& shape, double at_least) {
  struct Place {
    double x, y, yaw_deg, ex, ey, ez;
  };
  static constexpr std::array<Place, 6> kPlaces = {{{-.28, .10, 10, 0, 0, 0},
                                                    {-.36, .06, 50, .009, -.009, .004},
                                                    {-.31, .0, -25, -.009, .009, -.004},
                                                    {-.25, .12, 30, .009, .009, -.004},
                                                    {-.40, .10, 0, -.009, -.009, .004},
                                                    {-.33, .12, -40, 0, .01, .005}}};
  double sum = 0;
  double left = kPlaces.size();
  for (const Place& p : kPlaces) {
    auto sim = Simulation::create(with_thing(shape, {p.x, p.y}, p.yaw_deg, false));
    if (!sim) return 0;
    const GraspResult r = try_grasp(**sim, reach, posture, {"thing", {p.ex, p.ey, p.ez}, "", 0.5});
    const bool good = r.trouble.empty() && r.hold.held() && r.lifted_m > 0.07;
    sum += good ? 0.7 + 3 * std::min(r.lifted_m, 0.1) - std::min(0.2, 10 * r.slip_m) : 0;
    left -= 1;
    if (sum + left < at_least * kPlaces.size()) return 0;
  }
  return sum / kPlaces.size();
}

int search(const ArmReach& reach, GraspPosture best, const std::string& shape, double seconds) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto start = std::chrono::steady_clock::now();
  double top = score(reach, best, shape, 0);
  std::printf("start: %.3f\n", top);
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds) {
    GraspPosture next = best;
    const double degree = std::numbers::pi / 180;
    for (int i = 0; i < 3; ++i) {
      next.R_RootPalm =
          Eigen::AngleAxisd(normal(random) * 4 * degree, Eigen::Vector3d::Unit(i)) * next.R_RootPalm;
      next.p_PalmObject_m[i] += 0.004 * normal(random);
    }
    for (std::size_t i = 0; i < 9; ++i) {
      next.close_rad[i] = std::clamp(next.close_rad[i] + 6 * degree * normal(random), 0.2,
                                     i == 8 ? 4.5 : 1.5 + (i % 2 == 1 && i > 1 ? 1.5 : 0));
      next.preshape_rad[i] = i < 2
                                 ? next.close_rad[i]
                                 : std::clamp(next.preshape_rad[i] + 4 * degree * normal(random), 0.02, 1.5);
    }
    const double found = score(reach, next, shape, top);
    if (found <= top) continue;
    top = found;
    best = next;
    std::printf("%.3f\n  R_RootPalm:", top);
    for (int i = 0; i < 9; ++i) std::printf(" %.5f", best.R_RootPalm(i / 3, i % 3));
    std::printf("\n  p_PalmObject_m: [%.4f, %.4f, %.4f]\n  preshape_deg:", best.p_PalmObject_m.x(),
                best.p_PalmObject_m.y(), best.p_PalmObject_m.z());
    for (const double a : best.preshape_rad) std::printf(" %.1f", a / degree);
    std::printf("\n  close_deg:");
    for (const double a : best.close_rad) std::printf(" %.1f", a / degree);
    std::printf("\n");
    std::fflush(stdout);
  }
  return 0;
}

int run(int argc, char** argv) {
  const auto model = RobotModel::load(config("robots/icub.urdf"));
  if (!model) return std::puts(model.error().message.c_str()), 1;
  const ArmReach reach(*model);
  const auto postures = read_postures(config("robots/grasp_postures.yaml"));
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "tables" && argc > 2)
    return tables(reach, postures, std::atoi(argv[2]), argc > 3 ? argv[3] : "blue cube");
  const std::string shape = argc > 2 ? argv[2] : "";
  if (!postures.contains(shape))
    return std::puts("usage: grasp_probe map SHAPE | tables N [TARGET] | search SHAPE SECONDS"), 2;
  if (what == "map") return map(reach, postures.at(shape), shape);
  return search(reach, postures.at(shape), shape, argc > 3 ? std::atof(argv[3]) : 60);
}

}  // namespace
}  // namespace nido::sim

int main(int argc, char** argv) { return nido::sim::run(argc, argv); }
