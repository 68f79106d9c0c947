#include "robot_description.h"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <functional>
#include <sstream>

namespace nido::sim {
namespace {

Eigen::Isometry3d to_isometry(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
  pose.rotation.getQuaternion(x, y, z, w);
  X.linear() = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  X.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return X;
}

struct Reader {
  std::filesystem::path folder;
  RobotDescription robot;
  std::string trouble;

  bool read_shape(const urdf::Geometry& geometry, PlacedShape& out) {
    switch (geometry.type) {
      case urdf::Geometry::BOX: {
        const auto& box = static_cast<const urdf::Box&>(geometry);
        out.shape.kind = ShapeKind::kBox;
        out.shape.size = {box.dim.x, box.dim.y, box.dim.z};
        break;
      }
      case urdf::Geometry::SPHERE:
        out.shape.kind = ShapeKind::kSphere;
        out.shape.size = {static_cast<const urdf::Sphere&>(geometry).radius, 0, 0};
        break;
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
        out.shape.kind = ShapeKind::kCylinder;
        out.shape.size = {cylinder.radius, cylinder.length, 0};
        break;
      }
      case urdf::Geometry::MESH: {
        const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
        std::string file = mesh.filename;
        for (const char* prefix : {"package://nido/", "package://", "file://"}) {
          if (file.rfind(prefix, 0) == 0) {
            file.erase(0, std::string(prefix).size());
            break;
          }
        }
        out.shape.kind = ShapeKind::kMesh;
        out.shape.size = {mesh.scale.x, mesh.scale.y, mesh.scale.z};
        out.shape.mesh_path = (folder / file).string();
        auto loaded = load_mesh(out.shape.mesh_path, out.shape.size);
        if (!loaded) {
          trouble = loaded.error().message;
          return false;
        }
        out.mesh = *loaded;
        break;
      }
    }
    return true;
  }

  // URDF has no capsules: a cylinder whose name ends so has round caps on top of its length
  static void round_ends(const std::string& name, PlacedShape& placed) {
    if (placed.shape.kind == ShapeKind::kCylinder && name.ends_with("_capsule")) {
      placed.shape.kind = ShapeKind::kCapsule;
    }
  }

  // adds a URDF link and what hangs on it to moving link `index`; X_LinkUrdf: its frame in the moving link's
  bool add(const urdf::LinkConstSharedPtr& link, int index, const Eigen::Isometry3d& X_LinkUrdf) {
    robot.links[index].frames.push_back({link->name, X_LinkUrdf});
    if (link->inertial && link->inertial->mass > 0) {
      const auto& inertial = *link->inertial;
      const Eigen::Isometry3d X = X_LinkUrdf * to_isometry(inertial.origin);
      MassProperties own;
      own.mass_kg = inertial.mass;
      own.center_m = X.translation();
      own.inertia_kgm2 << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz,
          inertial.ixz, inertial.iyz, inertial.izz;
      own.inertia_kgm2 = (X.linear() * own.inertia_kgm2 * X.linear().transpose()).eval();
      robot.links[index].mass = combine({robot.links[index].mass, own});
    }
    for (const auto& collision : link->collision_array) {
      LinkShape shape{{}, link->name};
      shape.placed.X_OwnerShape = X_LinkUrdf * to_isometry(collision->origin);
      if (!collision->geometry || !read_shape(*collision->geometry, shape.placed)) return false;
      round_ends(collision->name, shape.placed);
      robot.links[index].collisions.push_back(shape);
    }
    for (const auto& visual : link->visual_array) {
      LinkShape shape{{}, link->name};
      shape.placed.X_OwnerShape = X_LinkUrdf * to_isometry(visual->origin);
      if (!visual->geometry || !read_shape(*visual->geometry, shape.placed)) return false;
      round_ends(visual->name, shape.placed);
      if (visual->material) {
        const auto& c = visual->material->color;
        shape.placed.shape.rgba = {c.r, c.g, c.b, c.a};
      }
      robot.links[index].visuals.push_back(shape);
    }
    for (const auto& joint : link->child_joints) {
      const urdf::LinkConstSharedPtr child = find_child(link, joint->child_link_name);
      const Eigen::Isometry3d X_LinkChild = X_LinkUrdf * to_isometry(joint->parent_to_joint_origin_transform);
      if (joint->type == urdf::Joint::FIXED) {
        if (!add(child, index, X_LinkChild)) return false;
        continue;
      }
      if (joint->type != urdf::Joint::REVOLUTE) {
        trouble =
            "joint \"" + joint->name +
            "\" is neither revolute nor fixed: a robot here has no other joints (one that turns for ever "
            "can be a revolute one with wide limits)";
        return false;
      }
      if (!joint->limits) {
        trouble = "joint " + joint->name + " has no limits";
        return false;
      }
      LinkDescription next;
      next.name = child->name;
      next.parent = index;
      next.joint_name = joint->name;
      next.X_ParentLink = X_LinkChild;
      next.axis_Link = Eigen::Vector3d(joint->axis.x, joint->axis.y, joint->axis.z).normalized();
      next.min_rad = joint->limits->lower;
      next.max_rad = joint->limits->upper;
      next.max_velocity_rad_s = joint->limits->velocity;
      next.max_torque_Nm = joint->limits->effort;
      robot.links.push_back(next);
      if (!add(child, static_cast<int>(robot.links.size()) - 1, Eigen::Isometry3d::Identity())) return false;
    }
    return true;
  }

  static urdf::LinkConstSharedPtr find_child(const urdf::LinkConstSharedPtr& link, const std::string& name) {
    for (const auto& child : link->child_links) {
      if (child->name == name) return child;
    }
    return nullptr;
  }
};

}  // namespace

Result<RobotDescription> read_robot(const std::filesystem::path& urdf_path) {
  std::ifstream file(urdf_path);
  if (!file) return Error{ErrorCode::kNotFound, "cannot read the robot's URDF " + urdf_path.string()};
  std::ostringstream text;
  text << file.rdbuf();
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model) return Error{ErrorCode::kInvalidArgument, urdf_path.string() + " is not a valid URDF"};

  Reader reader;
  reader.folder = urdf_path.parent_path();
  reader.robot.name = model->getName();
  LinkDescription root;
  root.name = model->getRoot()->name;
  reader.robot.links.push_back(root);
  if (!reader.add(model->getRoot(), 0, Eigen::Isometry3d::Identity())) {
    return Error{ErrorCode::kInvalidArgument, urdf_path.string() + ": " + reader.trouble};
  }
  for (std::size_t i = 1; i < reader.robot.links.size(); ++i) {
    const LinkDescription& link = reader.robot.links[i];
    if (link.mass.mass_kg <= 0) {
      return Error{ErrorCode::kInvalidArgument,
                   urdf_path.string() + ": link " + link.name + " moves but has no mass"};
    }
    if (link.min_rad >= link.max_rad || link.max_velocity_rad_s <= 0 || link.max_torque_Nm <= 0) {
      return Error{ErrorCode::kInvalidArgument, urdf_path.string() + ": joint " + link.joint_name +
                                                    " needs lower < upper, velocity > 0, effort > 0"};
    }
  }
  return reader.robot;
}

}  // namespace nido::sim
