#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "contact_solver.h"
#include "nido/interfaces/result.h"
#include "objects.h"

namespace nido::sim {

// How two things hang together.
enum class ObjectJointKind {
  kBall,   // a point of both stays together
  kHinge,  // and an axis
  kFixed,  // they do not move against each other
};

// A joint as people name it.
struct ObjectJointDescription {
  ObjectJointKind kind = ObjectJointKind::kBall;
  std::string a;
  std::string b;  // "world": a hangs on the world
  Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_World = Eigen::Vector3d::UnitZ();  // hinges only
};

// A joint between two things of the world, or one and the world. Held softly, as contacts are: a millimetre
// apart under loads of everyday things.
struct ObjectJoint {
  ObjectJointKind kind = ObjectJointKind::kBall;
  int a = -1;  // index of the object
  int b = -1;  // -1: the world
  // the joint's frame, z along the axis, seen from each object's own frame
  Eigen::Isometry3d X_AJoint = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d X_BJoint = Eigen::Isometry3d::Identity();
  std::array<double, 6> impulse{};  // of the step before
};

using ObjectList = std::vector<std::unique_ptr<ObjectBody>>;

// Makes a joint where the objects are now. Fails when a name is unknown, both are the same, none of them can
// move, or the axis has no length.
Result<ObjectJoint> make_joint(const ObjectJointDescription& description, const ObjectList& objects);
// The other way round, as it stands now.
[[nodiscard]] ObjectJointDescription describe(const ObjectJoint& joint, const ObjectList& objects);
[[nodiscard]] const char* to_string(ObjectJointKind kind);

// Ties for the solver; the same order as the joints. What moves wakes what hangs on it.
void make_ties(const std::vector<ObjectJoint>& joints, const ObjectList& objects,
               std::vector<ContactSolver::Tie>& ties);
// Keeps what the solver found for the next step.
void read_ties(const std::vector<ContactSolver::Tie>& ties, std::vector<ObjectJoint>& joints);
// After an object is gone: its joints go with it, the others count anew.
void forget_object(std::vector<ObjectJoint>& joints, int index);
// Things that hang together do not push each other away.
[[nodiscard]] bool are_joined(const std::vector<ObjectJoint>& joints, std::size_t a, std::size_t b);

}  // namespace nido::sim
