#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "contacts.h"
#include "drives.h"
#include "limb_forces.h"
#include "nido/interfaces/result.h"
#include "nido/simulator/faults.h"
#include "nido/simulator/film.h"
#include "nido/simulator/simulation.h"
#include "object_joints.h"
#include "objects.h"
#include "robot_body.h"

namespace nido::sim {

// Everything that changes while a simulation runs. Two simulations of the same robot, world and state have
// the same future, bit for bit.
struct SimulationState {
  std::int64_t period = 0;
  std::uint64_t moment = 0;  // see Simulation::moment()
  RobotBody::State robot;
  std::vector<ObjectBody::Motion> objects;
  Drives::State drives;
  Contacts::State contacts;
  // of the inertial sensor, now and a period before
  std::array<Eigen::Vector3d, 2> head_velocity = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  LimbForces::State limb_forces;
  std::array<CameraFault, 2> camera_fault{};  // left, right
  std::vector<Film> films;                    // of the cameras that ever were broken
  Lighting light;
  std::vector<ObjectJoint> joints;
};

struct SavedState::Data {
  const void* owner = nullptr;
  std::uint64_t object_set = 0;
  SimulationState state;
};

// Everything that a simulation can come back to, objects that were deleted since included.
struct WorldSnapshot {
  std::uint64_t object_set = 0;
  std::vector<ObjectDescription> objects;
  SimulationState state;
};

// What a state must be like to fit a simulation.
struct StateShape {
  std::vector<std::string> hinges;       // names of the robot's hinges, in its order
  std::size_t joints = 0;                // of all parts
  std::size_t sensors = 0;               // of force and torque
  std::vector<std::size_t> shape_links;  // of each of the robot's shapes that touch
  std::vector<std::size_t> skin_values;  // of each patch
};

// A snapshot as JSON; numbers come back bit for bit. Meshes are named, not copied.
[[nodiscard]] std::string snapshot_text(const WorldSnapshot& snapshot, const StateShape& shape);
// A number for the snapshot: states have the same future, whatever the time, if theirs is the same.
[[nodiscard]] std::uint64_t hash_of(const WorldSnapshot& snapshot);
// Refuses, in words that begin with the source, what is no snapshot or one of another robot, and numbers that
// no snapshot has.
[[nodiscard]] Result<WorldSnapshot> read_snapshot(const std::string& text, const StateShape& shape,
                                                  const std::string& source);

}  // namespace nido::sim
