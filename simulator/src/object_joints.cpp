#include "object_joints.h"

#include <algorithm>

namespace nido::sim {
namespace {

int find(const ObjectList& objects, const std::string& name) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i]->description().name == name) return static_cast<int>(i);
  }
  return -1;
}

Eigen::Isometry3d pose(const ObjectList& objects, int index) {
  return index < 0 ? Eigen::Isometry3d::Identity()
                   : objects[static_cast<std::size_t>(index)]->X_WorldObject();
}

bool moves(const ObjectList& objects, int index) {
  return index >= 0 && objects[static_cast<std::size_t>(index)]->body() != nullptr;
}

void wake_each_other(ObjectBody& a, ObjectBody& b) {
  if (a.body() == nullptr || b.body() == nullptr) return;
  const bool awake_a = dBodyIsEnabled(a.body()) != 0;
  const bool awake_b = dBodyIsEnabled(b.body()) != 0;
  // what hardly moves lets its neighbour sleep
  if (awake_a && !awake_b && !a.hardly_moves()) b.wake();
  if (awake_b && !awake_a && !b.hardly_moves()) a.wake();
}

}  // namespace

const char* to_string(ObjectJointKind kind) {
  switch (kind) {
    case ObjectJointKind::kBall:
      return "ball";
    case ObjectJointKind::kHinge:
      return "hinge";
    case ObjectJointKind::kFixed:
      return "fixed";
  }
  return "ball";
}

Result<ObjectJoint> make_joint(const ObjectJointDescription& description, const ObjectList& objects) {
  const auto refuse = [](const std::string& why) { return Error{ErrorCode::kInvalidArgument, why}; };
  ObjectJoint joint;
  joint.kind = description.kind;
  joint.a = find(objects, description.a);
  joint.b = description.b == "world" ? -1 : find(objects, description.b);
  if (joint.a < 0) return refuse("there is no object \"" + description.a + "\"");
  if (joint.b < 0 && description.b != "world") return refuse("there is no object \"" + description.b + "\"");
  if (joint.a == joint.b) return refuse("an object cannot hang on itself");
  if (!moves(objects, joint.a) && !moves(objects, joint.b))
    return refuse("one of the two must be a thing that can move");
  if (!(description.axis_World.norm() > 1e-6)) return refuse("the axis has no length");
  Eigen::Isometry3d X_WorldJoint = Eigen::Isometry3d::Identity();
  X_WorldJoint.translation() = description.p_World_m;
  X_WorldJoint.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), description.axis_World).toRotationMatrix();
  joint.X_AJoint = pose(objects, joint.a).inverse() * X_WorldJoint;
  joint.X_BJoint = pose(objects, joint.b).inverse() * X_WorldJoint;
  return joint;
}

ObjectJointDescription describe(const ObjectJoint& joint, const ObjectList& objects) {
  const Eigen::Isometry3d X_WorldJoint = pose(objects, joint.a) * joint.X_AJoint;
  return {joint.kind, objects[static_cast<std::size_t>(joint.a)]->description().name,
          joint.b < 0 ? "world" : objects[static_cast<std::size_t>(joint.b)]->description().name,
          X_WorldJoint.translation(), X_WorldJoint.linear().col(2)};
}

void make_ties(const std::vector<ObjectJoint>& joints, const ObjectList& objects,
               std::vector<ContactSolver::Tie>& ties) {
  ties.clear();
  for (const ObjectJoint& joint : joints) {
    ObjectBody& a = *objects[static_cast<std::size_t>(joint.a)];
    if (joint.b >= 0) wake_each_other(a, *objects[static_cast<std::size_t>(joint.b)]);
    const Eigen::Isometry3d X_a = a.X_WorldObject() * joint.X_AJoint;
    const Eigen::Isometry3d X_b = pose(objects, joint.b) * joint.X_BJoint;
    ContactSolver::Tie made;
    made.object_a = joint.a;
    made.object_b = joint.b;
    made.p_World_m = (X_a.translation() + X_b.translation()) / 2;
    made.gap_m = X_b.translation() - X_a.translation();
    made.impulse = joint.impulse;
    if (joint.kind == ObjectJointKind::kHinge) {
      // turning a by this brings its axis onto b's
      const Eigen::Vector3d axis = X_a.linear().col(2);
      const Eigen::Vector3d error = axis.cross(X_b.linear().col(2));
      made.turns = 2;
      for (int k = 0; k < 2; ++k) {
        made.turn_axis_World[static_cast<std::size_t>(k)] = X_a.linear().col(k);
        made.turn_gap_rad[static_cast<std::size_t>(k)] = error.dot(X_a.linear().col(k));
      }
    } else if (joint.kind == ObjectJointKind::kFixed) {
      const Eigen::AngleAxisd error(Eigen::Matrix3d(X_b.linear() * X_a.linear().transpose()));
      made.turns = 3;
      for (int k = 0; k < 3; ++k) {
        made.turn_axis_World[static_cast<std::size_t>(k)] = Eigen::Vector3d::Unit(k);
        made.turn_gap_rad[static_cast<std::size_t>(k)] = error.angle() * error.axis()[k];
      }
    }
    ties.push_back(made);
  }
}

void read_ties(const std::vector<ContactSolver::Tie>& ties, std::vector<ObjectJoint>& joints) {
  for (std::size_t i = 0; i < joints.size(); ++i) joints[i].impulse = ties[i].impulse;
}

void forget_object(std::vector<ObjectJoint>& joints, int index) {
  std::erase_if(joints, [index](const ObjectJoint& j) { return j.a == index || j.b == index; });
  for (ObjectJoint& joint : joints) {
    if (joint.a > index) --joint.a;
    if (joint.b > index) --joint.b;
  }
}

bool are_joined(const std::vector<ObjectJoint>& joints, std::size_t a, std::size_t b) {
  return std::any_of(joints.begin(), joints.end(), [a, b](const ObjectJoint& joint) {
    const auto first = static_cast<std::size_t>(joint.a);
    const auto second = static_cast<std::size_t>(joint.b);
    return joint.b >= 0 && ((first == a && second == b) || (first == b && second == a));
  });
}

}  // namespace nido::sim
