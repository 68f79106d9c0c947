#include "ode_library.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace {

[[noreturn]] void raise(int number, const char* format, va_list arguments) {
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  throw nido::sim::OdeError("physics engine: " + std::string(text.data()) + " (" + std::to_string(number) +
                            ")");
}

void ignore_message(int /*number*/, const char* /*format*/, va_list /*arguments*/) {}

}  // namespace

namespace nido::sim {

void prepare_ode() {
  static std::once_flag once;
  std::call_once(once, [] {
    dInitODE2(0);
    dSetErrorHandler(raise);
    dSetDebugHandler(raise);
    dSetMessageHandler(ignore_message);
  });
  thread_local bool prepared = false;
  if (!prepared) {
    dAllocateODEDataForThread(dAllocateMaskAll);
    prepared = true;
  }
}

Eigen::Quaterniond body_orientation(dBodyID body) {
  const dReal* q = dBodyGetQuaternion(body);
  return {q[0], q[1], q[2], q[3]};
}

Eigen::Isometry3d body_pose(dBodyID body) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const dReal* R = dBodyGetRotation(body);
  X.linear() << R[0], R[1], R[2], R[4], R[5], R[6], R[8], R[9], R[10];
  X.translation() = to_eigen(dBodyGetPosition(body));
  return X;
}

void to_ode(const Eigen::Quaterniond& q, dQuaternion out) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

void set_body_pose(dBodyID body, const Eigen::Isometry3d& X_WorldBody) {
  const Eigen::Vector3d p = X_WorldBody.translation();
  dQuaternion q;
  to_ode(Eigen::Quaterniond(X_WorldBody.linear()).normalized(), q);
  dBodySetPosition(body, p.x(), p.y(), p.z());
  dBodySetQuaternion(body, q);
  dBodySetLinearVel(body, 0, 0, 0);
  dBodySetAngularVel(body, 0, 0, 0);
  dBodySetForce(body, 0, 0, 0);
  dBodySetTorque(body, 0, 0, 0);
}

}  // namespace nido::sim
