// Random motion, with things made and deleted, for as long as one likes: does memory grow, is a number lost?
//   simulator_soak HOURS [SEED]
// HOURS are simulated. Exit 1 when resident memory grew by more than 1 MB an hour after the first hour (or
// the first quarter of a shorter run). SIGTERM and SIGINT end it early, with what has been seen so far.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "nido/simulator/simulation.h"

using namespace nido;
using namespace nido::sim;

namespace {

volatile std::sig_atomic_t told_to_end = 0;

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
  auto made = Simulation::create(options);
  if (!made) return std::printf("%s\n", made.error().message.c_str()), 1;
  Simulation& sim = **made;
  Life life(sim, argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  std::signal(SIGTERM, [](int) { told_to_end = 1; });
  std::signal(SIGINT, [](int) { told_to_end = 1; });
  const double warm_h = std::min(1.0, hours / 4);  // until everything has been made once
  const double report_h = warm_h / 5;
  double warm_MB = 0;
  double next_h = report_h;
  double lived_h = 0;  // a reset begins the simulation's own time anew
  while (lived_h < hours && told_to_end == 0) {
    if (const Status done = life.go_on(); !done) return std::printf("%s\n", done.error().message.c_str()), 1;
    lived_h += 2.0 / 3600;
    if (lived_h < next_h) continue;
    next_h += report_h;
    if (warm_MB == 0 && lived_h >= warm_h) warm_MB = resident_MB();
    std::printf("%.3f h simulated, %.2f MB resident, %zu things\n", lived_h, resident_MB(),
                sim.objects().size());
    std::fflush(stdout);
  }
  if (warm_MB == 0) return std::printf("ended before the first %.2f h were over\n", warm_h), 1;
  const double grown_MB = resident_MB() - warm_MB;
  const double after_h = lived_h - warm_h;
  std::printf("grown by %.2f MB in the %.2f h after the first %.2f h\n", grown_MB, after_h, warm_h);
  return grown_MB <= std::max(1.0, after_h) ? 0 : 1;
}
