#pragma once

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace nido::sim {

// What ODE complained about; thrown from inside its calls instead of its own way, which is to end the
// process.
class OdeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Makes ODE usable in this thread: initialises the library once in the process, its collision data once in
// each thread, and turns its errors into OdeError. Cheap when done already.
void prepare_ode();

[[nodiscard]] inline Eigen::Vector3d to_eigen(const dReal* v) { return {v[0], v[1], v[2]}; }
[[nodiscard]] Eigen::Isometry3d body_pose(dBodyID body);

// Sets pose and zero velocity.
void set_body_pose(dBodyID body, const Eigen::Isometry3d& X_WorldBody);
[[nodiscard]] Eigen::Quaterniond body_orientation(dBodyID body);
void to_ode(const Eigen::Quaterniond& q, dQuaternion out);

}  // namespace nido::sim
