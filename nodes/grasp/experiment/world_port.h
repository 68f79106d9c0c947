#pragma once

#include <Eigen/Core>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"

namespace nido::grasp {

// What experimenters ask of /icubSim/world. Blocking.

// Answer of the world port; kFailed with the world's own words.
Result<std::string> ask_world(Node& node, const std::string& line);

// Root frame to the world port's frame (x left, y up, z forward, origin on the floor under the robot).
Eigen::Vector3d world_of_root(const Eigen::Vector3d& p_Root_m);

// Box around a thing.
struct Box {
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // middle
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    // edges, in its own frame
  double frame_Root_m = 0;                             // height of its frame's origin
};
Result<Box> box_of(Node& node, const std::string& object);

// Does the table, the floor or another thing touch it?
Result<bool> touches_other(Node& node, const std::string& object);

// Puts a thing upright and at rest: its frame's origin over p at this height, root frame.
Status place(Node& node, const std::string& object, const Eigen::Vector2d& p_Root_m, double frame_Root_m,
             double yaw_rad);

}  // namespace nido::grasp
