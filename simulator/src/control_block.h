#pragma once

#include <array>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/kinematics/robot_model.h"
#include "nido/simulator/joints.h"

namespace nido::sim {

// How one joint of a part moves one hinge: hinge angle += multiplier * joint + offset.
struct HingeShare {
  std::string hinge;
  double multiplier = 1;
  double offset_rad = 0;
};

struct AxisBlock {
  JointInfo info;
  double home_rad = 0;
  std::vector<HingeShare> hinges;
};

struct PartBlock {
  std::string name;
  std::vector<AxisBlock> axes;
};

struct HandBlock {
  std::string frame;                // palm frame; empty: the robot has no such hand
  std::array<std::string, 6> pads;  // URDF links: thumb, index, middle, ring, little, palm
};

// What the physics takes from the <nido> element of the URDF, by names.
struct ControlBlock {
  std::vector<PartBlock> parts;
  std::array<HandBlock, 2> hands;           // left, right
  std::array<std::string, 2> camera_links;  // left, right; empty: no such eye
  std::string inertial_link;
  std::vector<std::pair<std::string, std::string>> force_torque;  // limb, hinge below the sensor
};

[[nodiscard]] ControlBlock read_control_block(const RobotModel& model);

}  // namespace nido::sim
