// Commands as bad as they come, at 1 kHz, for as long as one likes; no joint may leave its limits, and no
// hinge that joints turn together (an eye's is turned by version and vergence) its own.
//   simulator_adversary [COMMANDS [SEED]]
// Prints the worst of every kind; exit 1 when it is too much: half a degree beyond a limit, a hundredth of a
// speed or torque.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "nido/kinematics/robot_model.h"
#include "nido/simulator/simulation.h"

using namespace nido;
using namespace nido::sim;

namespace {

constexpr int kCommandsAPeriod = 10;
constexpr std::array<JointMode, 6> kModes = {JointMode::kIdle,     JointMode::kPosition, JointMode::kDirect,
                                             JointMode::kVelocity, JointMode::kTorque,   JointMode::kPwm};

struct Worst {
  double value = 0;
  std::string who;
  void see(double found, const std::string& name) {
    if (found <= value) return;
    value = found;
    who = name;
  }
  void see(double found, const JointInfo& info, JointMode mode) {
    see(found, info.name + " in " + to_string(mode));
  }
};

double draw(std::mt19937_64& random) {
  const double u = std::uniform_real_distribution<double>(-1, 1)(random);
  switch (random() % 12) {
    case 0:
      return std::numeric_limits<double>::quiet_NaN();
    case 1:
      return std::numeric_limits<double>::infinity();
    case 2:
      return -std::numeric_limits<double>::infinity();
    case 3:
      return 1e308 * u;
    case 4:
      return std::numeric_limits<double>::denorm_min();
    case 5:
      return 1e6 * u;
    case 6:
      return 200 * u;
    default:
      return 4 * u;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long commands = argc > 1 ? std::atol(argv[1]) : 100000;
  std::mt19937_64 random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  SimulationOptions options;
  options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  options.world_path = std::string(NIDO_CONFIG_DIR) + "/worlds/table.yaml";
  auto made = Simulation::create(options);
  if (!made) return std::printf("%s\n", made.error().message.c_str()), 1;
  Simulation& sim = **made;
  const auto model = RobotModel::load(options.urdf_path);
  if (!model) return std::printf("%s\n", model.error().message.c_str()), 1;
  Worst beyond_deg;
  Worst speed;
  Worst torque;
  Worst hinge_beyond_deg;
  Worst hinge_speed;
  Eigen::VectorXd axes_rad = model->home_axes();
  const Eigen::VectorXd hinges_at_0 = model->hinge_angles(0 * axes_rad);
  Eigen::VectorXd axes_rad_s = axes_rad;
  long refused = 0;
  for (long n = 0; n < commands;) {
    for (int i = 0; i < kCommandsAPeriod; ++i, ++n) {
      // parts and joints that there are, mostly
      const int part = static_cast<int>(random() % 7) - (random() % 50 == 0 ? 1 : 0);
      const std::size_t length = random() % 20 == 0 ? random() % 20 : 1 + random() % 3;
      std::vector<int> joints;
      std::vector<double> values;
      for (std::size_t k = 0; k < length; ++k) {
        joints.push_back(static_cast<int>(random() % (random() % 10 == 0 ? 20 : 6)) -
                         (random() % 50 == 0 ? 1 : 0));
        values.push_back(draw(random));
      }
      if (random() % 50 == 0) values.push_back(0);
      Status done;
      switch (random() % 12) {
        case 0:
          done =
              sim.set_reference_speed(part, joints.empty() ? 99 : joints[0], values.empty() ? 1 : values[0]);
          break;
        case 1:
          done = sim.stop(part, joints.empty() ? 99 : joints[0]);
          break;
        case 2:
          done = sim.command_all(part, kModes[random() % kModes.size()], values);
          break;
        default:
          done = sim.command(part, kModes[random() % kModes.size()], joints, values);
          break;
      }
      refused += done ? 0 : 1;
    }
    if (const Status stepped = sim.step(); !stepped)
      return std::printf("%s\n", stepped.error().message.c_str()), 1;
    Eigen::Index axis = 0;
    for (std::size_t p = 0; p < sim.parts().size(); ++p) {
      const auto states = sim.joints(static_cast<int>(p));
      for (std::size_t j = 0; j < states.size(); ++j) {
        const JointInfo& info = sim.parts()[p].joints[j];
        const JointState& s = states[j];
        const double out = std::max(info.min_rad - s.position_rad, s.position_rad - info.max_rad);
        beyond_deg.see(out * 180 / std::numbers::pi, info, s.mode);
        speed.see(std::abs(s.velocity_rad_s) / info.max_velocity_rad_s, info, s.mode);
        torque.see(std::abs(s.torque_Nm) / info.max_torque_Nm, info, s.mode);
        axes_rad[axis] = s.position_rad;
        axes_rad_s[axis++] = s.velocity_rad_s;
      }
    }
    const Eigen::VectorXd hinges_rad = model->hinge_angles(axes_rad);
    const Eigen::VectorXd hinges_rad_s = model->hinge_angles(axes_rad_s) - hinges_at_0;
    for (std::size_t h = 0; h < model->hinges().size(); ++h) {
      const Hinge& hinge = model->hinges()[h];
      const double rad = hinges_rad[static_cast<Eigen::Index>(h)];
      const double out = std::max(hinge.lower_rad - rad, rad - hinge.upper_rad);
      hinge_beyond_deg.see(out * 180 / std::numbers::pi, hinge.name);
      hinge_speed.see(std::abs(hinges_rad_s[static_cast<Eigen::Index>(h)]) / hinge.velocity_rad_s,
                      hinge.name);
    }
  }
  std::printf("%ld commands, %ld refused, %.0f s simulated\n", commands, refused, sim.time_s());
  std::printf("beyond a limit of position: %.3f degrees (%s)\n", beyond_deg.value, beyond_deg.who.c_str());
  std::printf("speed by its limit: %.4f (%s)\n", speed.value, speed.who.c_str());
  std::printf("torque by its limit: %.4f (%s)\n", torque.value, torque.who.c_str());
  std::printf("a hinge beyond its limit: %.3f degrees (%s)\n", hinge_beyond_deg.value,
              hinge_beyond_deg.who.c_str());
  std::printf("a hinge's speed by its limit: %.4f (%s)\n", hinge_speed.value, hinge_speed.who.c_str());
  const bool stays = beyond_deg.value <= 0.5 && hinge_beyond_deg.value <= 0.5;
  const bool is_slow = speed.value <= 1.01 && hinge_speed.value <= 1.01;
  return stays && is_slow && torque.value <= 1.01 ? 0 : 1;
}
