// How often the shipped network holds a thing and drops it into the basket, all over the table, with errors
// as eyes have them:
//   grasp_map KIND N [SEED [WEIGHTS]]
// KIND: cube, ball, bear, cylinder; box, round, tin: of drawn sizes, 2.5 to 6 cm.
// NO_DROP=1 in the environment: only held.
#include <fmt/format.h>

#include <cstdlib>
#include <random>

#include "grasp_lab.h"
#include "nido/grasp/policies.h"

namespace nido::grasp {
namespace {

int run(const std::string& kind, int count, std::uint64_t seed, const std::string& weights) {
  const auto network = load_grasp_network(weights);
  if (!network) return fmt::print("{}\n", network.error().message), 1;
  std::mt19937_64 random(seed);
  const auto draw = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  int held = 0;
  int dropped = 0;
  int believed_wrongly = 0;
  for (int i = 0; i < count; ++i) {
    LabThing thing;
    const double size_m = draw(0.025, 0.06);
    thing.name = kind == "bear" ? "teddy bear" : "blue " + kind;
    if (kind == "box") {
      thing.line = fmt::format("mk box {0:.4f} {0:.4f} {0:.4f}", size_m);
      thing.name = "blue cube";
    } else if (kind == "round") {
      thing.line = fmt::format("mk sph {:.4f}", size_m / 2);
      thing.name = "blue ball";
    } else if (kind == "tin") {
      thing.line = fmt::format("mk cyl {:.4f} {:.4f}", size_m / 2, draw(0.04, 0.09));
      thing.name = "blue cylinder";
    } else {
      thing.line = "object: " + kind;
    }
    thing.place_m = {draw(-0.38, -0.26), draw(0.0, 0.12)};
    thing.yaw_deg = draw(-180, 180);
    thing.error_Root_m = {draw(-0.006, 0.006), draw(-0.006, 0.006), draw(-0.004, 0.004)};
    GraspLab lab(thing, learned_policy(*network));
    LabResult result = lab.take(3.0);
    const std::string trouble = result.trouble;
    const Eigen::Vector3d p_Palm_m = lab.p_Palm_m();
    if (result.held && std::getenv("NO_DROP") == nullptr) lab.drop(result);
    held += result.held ? 1 : 0;
    dropped += result.in_basket ? 1 : 0;
    believed_wrongly += result.held != result.said_so ? 1 : 0;
    const Eigen::Vector3d end_m = lab.p_Root_m();
    fmt::print(
        "{:3} {} at {:.3f} {:.3f} yaw {:4.0f}: {}{}, slip {:.1f} mm, in palm {:.0f} {:.0f} {:.0f} mm, ends "
        "at "
        "{:.3f} {:.3f} {:.3f} {}{}\n",
        i, thing.line, thing.place_m.x(), thing.place_m.y(), thing.yaw_deg,
        result.in_basket ? "in the basket"
        : result.held    ? "HELD, not in the basket"
                         : "NOT HELD",
        result.held == result.said_so ? "" : " (believed otherwise)", 1000 * result.slip_m,
        1000 * p_Palm_m.x(), 1000 * p_Palm_m.y(), 1000 * p_Palm_m.z(), end_m.x(), end_m.y(), end_m.z(),
        trouble, result.trouble == trouble ? "" : " | " + result.trouble);
    std::fflush(stdout);
  }
  fmt::print("{}: held {} of {}, in the basket {}, wrong beliefs {}\n", kind, held, count, dropped,
             believed_wrongly);
  return 0;
}

}  // namespace
}  // namespace nido::grasp

int main(int argc, char** argv) {
  if (argc < 3) return fmt::print("usage: grasp_map KIND N [SEED]\n"), 2;
  return nido::grasp::run(argv[1], std::atoi(argv[2]), argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1,
                          argc > 4 ? argv[4] : std::string(NIDO_CONFIG_DIR) + "/weights/grasp.txt");
}
