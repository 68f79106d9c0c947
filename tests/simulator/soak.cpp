// Random motion, with things made and deleted, for as long as one likes: does memory grow, is a number lost?
//   simulator_soak HOURS [SEED]
// HOURS are simulated. Exit 1 when resident memory grew by more than 1 MB an hour after the first hour (or
// the first quarter of a shorter run).
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "nido/simulator/simulation.h"

using namespace nido;
using namespace nido::sim;

namespace {

double resident_MB() {
  std::ifstream file("/proc/self/statm");
  long size = 0;
  long resident = 0;
  file >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

class Life {
 public:
  Life(Simulation& sim, std::uint64_t seed) : sim_(sim), random_(seed) {}

  // Two seconds of it.
  Status go_on() {
    for (std::size_t p = 0; p < sim_.parts().size(); ++p) {
      std::vector<double> targets;
      for (const JointInfo& joint : sim_.parts()[p].joints)
        targets.push_back(even(joint.min_rad, joint.max_rad));
      if (Status done = sim_.command_all(static_cast<int>(p), JointMode::kPosition, targets); !done)
        return done;
    }
    make_something();
    // the table stays, the oldest thing goes
    if (const auto objects = sim_.objects(); objects.size() > 12)
      (void)sim_.world("world del \"" + objects[1].name + "\"");
    if (random_() % 50 == 0) (void)sim_.world("world snapshot a");
    if (random_() % 100 == 0) (void)sim_.world("world restore a");
    if (random_() % 500 == 0) (void)sim_.world("world reset");
    return sim_.step(2);
  }

 private:
  double even(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  void make_something() {
    const auto text = [this](double low, double high) { return " " + std::to_string(even(low, high)); };
    const std::string place = text(-0.3, 0.3) + text(0.6, 1.2) + text(0.1, 0.6) + " 1 0 0";
    switch (random_() % 3) {
      case 0:
        (void)sim_.world("world mk box" + text(0.02, 0.08) + text(0.02, 0.08) + text(0.02, 0.08) + place);
        break;
      case 1:
        (void)sim_.world("world mk sph" + text(0.02, 0.05) + place);
        break;
      default:
        (void)sim_.world("world mk cyl" + text(0.02, 0.05) + text(0.05, 0.15) + place);
        break;
    }
  }

  Simulation& sim_;
  std::mt19937_64 random_;
};

}  // namespace

int main(int argc, char** argv) {
  const double hours = argc > 1 ? std::atof(argv[1]) : 0.1;
  SimulationOptions options;
  options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  options.world_path = std::string(NIDO_CONFIG_DIR) + "/worlds/table.yaml";
  options.self_collision = true;
  auto made = Simulation::create(options);
  if (!made) return std::printf("%s\n", made.error().message.c_str()), 1;
  Simulation& sim = **made;
  Life life(sim, argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  const double report_h = std::min(1.0, hours / 4);
  double first_MB = 0;
  double next_h = report_h;
  // a reset begins time anew
  for (double simulated_h = 0; simulated_h < hours; simulated_h += 2.0 / 3600) {
    if (const Status done = life.go_on(); !done) return std::printf("%s\n", done.error().message.c_str()), 1;
    if (simulated_h < next_h) continue;
    next_h += report_h;
    if (first_MB == 0) first_MB = resident_MB();
    std::printf("%.3f h simulated, %.2f MB resident, %zu things\n", simulated_h, resident_MB(),
                sim.objects().size());
    std::fflush(stdout);
  }
  const double grown_MB = resident_MB() - first_MB;
  const double after_h = hours - report_h;
  std::printf("grown by %.2f MB in the %.2f h after the first %.2f h\n", grown_MB, after_h, report_h);
  return grown_MB <= std::max(1.0, after_h) ? 0 : 1;
}
