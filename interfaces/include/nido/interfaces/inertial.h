#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "nido/interfaces/result.h"

namespace nido {

// What a six-axis force/torque sensor feels: what the limb beyond it exerts on the body, in the sensor's
// frame.
struct WrenchReading {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_Nm = Eigen::Vector3d::Zero();
};

// Thread-safe.
class IForceTorque {
 public:
  virtual ~IForceTorque() = default;
  [[nodiscard]] virtual Result<WrenchReading> read_wrench() const = 0;
};

// What an inertial sensor feels, in its own frame.
struct InertialReading {
  std::int64_t stamp_ns = 0;
  Eigen::Quaterniond q_WorldSensor = Eigen::Quaterniond::Identity();  // orientation, unit length
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();        // gravity included
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
};

// Thread-safe.
class IInertial {
 public:
  virtual ~IInertial() = default;
  [[nodiscard]] virtual Result<InertialReading> read_inertial() const = 0;
};

}  // namespace nido
