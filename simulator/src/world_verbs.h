#pragma once

#include <string>

#include "simulation_impl.h"
#include "world_text.h"

namespace nido::sim {

// What the verbs of the world port share.

// Reads `KIND N` or a name, quoted or as several words; index of the object.
std::size_t read_object(const Simulation::Impl& sim, Arguments& arguments);
// The objects changed: nothing of the last contacts may be used again.
void objects_changed(Simulation::Impl& sim);
// x y z qx qy qz qw
[[nodiscard]] std::string pose_text(const Eigen::Isometry3d& X);

// Verbs of properties and motion, in world_motion.cpp. Each takes the words after its name and gives the
// reply.
std::string world_mass(Simulation::Impl& sim, Arguments& arguments);
std::string world_density(Simulation::Impl& sim, Arguments& arguments);
std::string world_friction(Simulation::Impl& sim, Arguments& arguments);
std::string world_restitution(Simulation::Impl& sim, Arguments& arguments);
std::string world_speed(Simulation::Impl& sim, Arguments& arguments);
std::string world_force(Simulation::Impl& sim, Arguments& arguments);
std::string world_torque(Simulation::Impl& sim, Arguments& arguments);
std::string world_link(Simulation::Impl& sim, Arguments& arguments);
std::string world_snapshot(Simulation::Impl& sim, Arguments& arguments);
std::string world_restore(Simulation::Impl& sim, Arguments& arguments);
std::string world_reset(Simulation::Impl& sim, Arguments& arguments);

}  // namespace nido::sim
