#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// What is really there. Only the judge may ask: no node that perceives or acts sees any of it.
struct ObjectTruth {
  Eigen::Isometry3d X_RootObject = Eigen::Isometry3d::Identity();  // centre
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();                // edges of its box in its own frame
};

class GroundTruth {
 public:
  virtual ~GroundTruth() = default;
  virtual Result<ObjectTruth> object(const std::string& name) = 0;
  // A hand touches it, and nothing of the world does.
  virtual Result<bool> held(const std::string& name) = 0;
  virtual Result<bool> inside(const std::string& object, const std::string& basket) = 0;
  // Palm frames of the hands that may act (x towards the fingers, z out of the palm), one or both; always in
  // the same order.
  virtual Result<std::vector<Eigen::Isometry3d>> X_RootPalms() = 0;
};

// Distance of a point from the surface of a box (0 inside). Shape: root frame.
double distance_to_box(const Eigen::Vector3d& p_Root_m, const ObjectTruth& box);

}  // namespace nido
