#include "ode_library.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace {

// xorshift state of this thread's solver order
thread_local std::uint32_t solver_random_state = 1;  // NOLINT: one per thread, seeded before every step

[[noreturn]] void raise(int number, const char* format, va_list arguments) {
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  throw nido::sim::OdeError("physics engine: " + std::string(text.data()) + " (" + std::to_string(number) +
                            ")");
}

void ignore_message(int /*number*/, const char* /*format*/, va_list /*arguments*/) {}

}  // namespace

// QuickStep shuffles its rows with this function of ODE. Defining it here replaces the library's own, whose
// state is shared by all threads of a process and would make parallel simulations depend on each other's
// timing.
extern "C" int dRandInt(int n) {
  if (n <= 1) return 0;
  solver_random_state ^= solver_random_state << 13U;
  solver_random_state ^= solver_random_state >> 17U;
  solver_random_state ^= solver_random_state << 5U;
  return static_cast<int>((static_cast<std::uint64_t>(solver_random_state) * static_cast<std::uint64_t>(n)) >>
                          32U);
}

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

void seed_solver(std::uint32_t seed) {
  // spread near seeds apart; xorshift must not start at zero
  std::uint32_t mixed = seed * 2654435761U + 0x9E3779B9U;
  mixed ^= mixed >> 16U;
  mixed *= 0x85EBCA6BU;
  mixed ^= mixed >> 13U;
  solver_random_state = mixed == 0 ? 1U : mixed;
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
