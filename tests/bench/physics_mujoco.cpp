#include <mujoco/mujoco.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "physics_scene.h"
#include "robot_description.h"

namespace nido::bench {
namespace {

std::string text(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out.precision(12);
  out << v.x() << ' ' << v.y() << ' ' << v.z();
  return out.str();
}

std::string pose(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  std::ostringstream out;
  out.precision(12);
  out << "pos=\"" << text(X.translation()) << "\" quat=\"" << q.w() << ' ' << q.x() << ' ' << q.y() << ' '
      << q.z() << '"';
  return out.str();
}

// MuJoCo's own description of the robot that our URDF describes: the same masses, shapes and limits.
class MjcfWriter {
 public:
  explicit MjcfWriter(const sim::RobotDescription& robot) : robot_(robot) {}

  std::string write(const PhysicsScene& scene) {
    out_.precision(12);
    out_ << "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.001\"/>"
            "<size njmax=\"2000\" nconmax=\"500\"/><worldbody>\n";
    body(0);
    thing(scene.table(), false);
    for (const Thing& t : scene.things()) thing(t, true);
    out_ << "</worldbody>\n<actuator>\n";
    for (std::size_t i = 1; i < robot_.links.size(); ++i) {
      const double torque = robot_.links[i].max_torque_Nm;
      out_ << "<position joint=\"j" << i << "\" kp=\"" << 20 * torque
           << "\" forcelimited=\"true\" forcerange=\"" << -torque << ' ' << torque << "\"/>\n";
    }
    out_ << "</actuator></mujoco>\n";
    return out_.str();
  }

 private:
  void shapes(const sim::LinkDescription& link) {
    for (const sim::LinkShape& shape : link.collisions) {
      const Eigen::Vector3d& s = shape.placed.shape.size;
      out_ << "<geom contype=\"1\" conaffinity=\"2\" mass=\"0\" " << pose(shape.placed.X_OwnerShape);
      switch (shape.placed.shape.kind) {
        case sim::ShapeKind::kBox:
          out_ << " type=\"box\" size=\"" << text(s / 2) << "\"/>\n";
          break;
        case sim::ShapeKind::kSphere:
          out_ << " type=\"sphere\" size=\"" << s.x() << "\"/>\n";
          break;
        case sim::ShapeKind::kCapsule:
          out_ << " type=\"capsule\" size=\"" << s.x() << ' ' << std::max(s.y() / 2, 1e-6) << "\"/>\n";
          break;
        default:
          out_ << " type=\"cylinder\" size=\"" << s.x() << ' ' << s.y() / 2 << "\"/>\n";
          break;
      }
    }
  }

  void body(std::size_t index) {
    const sim::LinkDescription& link = robot_.links[index];
    if (index == 0) {
      shapes(link);
    } else {
      const double mass_kg = std::max(link.mass.mass_kg, 0.02);
      const Eigen::Matrix3d I =
          link.mass.inertia_kgm2 * (mass_kg / link.mass.mass_kg) + 2e-5 * Eigen::Matrix3d::Identity();
      out_ << "<body name=\"b" << index << "\" " << pose(link.X_ParentLink) << "><inertial pos=\""
           << text(link.mass.center_m) << "\" mass=\"" << mass_kg << "\" fullinertia=\"" << I(0, 0) << ' '
           << I(1, 1) << ' ' << I(2, 2) << ' ' << I(0, 1) << ' ' << I(0, 2) << ' ' << I(1, 2)
           << "\"/><joint name=\"j" << index << "\" type=\"hinge\" axis=\"" << text(link.axis_Link)
           << "\" limited=\"true\" range=\"" << link.min_rad - 0.008 << ' ' << link.max_rad + 0.008
           << "\" damping=\"" << 0.5 * link.max_torque_Nm << "\"/>\n";
      shapes(link);
    }
    for (std::size_t i = 1; i < robot_.links.size(); ++i) {
      if (robot_.links[i].parent == static_cast<int>(index)) body(i);
    }
    if (index != 0) out_ << "</body>\n";
  }

  void thing(const Thing& t, bool moves) {
    out_ << "<body pos=\"" << text(t.p_Root_m) << "\">" << (moves ? "<freejoint/>" : "")
         << "<geom contype=\"2\" conaffinity=\"3\" type=\""
         << (t.ball ? "sphere\" size=\"" + std::to_string(t.size_m.x())
                    : "box\" size=\"" + text(t.size_m / 2))
         << "\"" << (moves ? " mass=\"" + std::to_string(t.mass_kg) + "\"" : std::string()) << "/></body>\n";
  }

  const sim::RobotDescription& robot_;
  std::ostringstream out_;
};

class Mujoco : public Contender {
 public:
  Mujoco(const PhysicsScene& scene, const sim::RobotDescription& robot, mjModel* model)
      : scene_(scene), model_(model), data_(mj_makeData(model)) {
    for (std::size_t i = 1; i < robot.links.size(); ++i) {
      hinge_.push_back(scene.model().hinge_index(robot.links[i].joint_name).value());
      joint_.push_back(mj_name2id(model, mjOBJ_JOINT, ("j" + std::to_string(i)).c_str()));
    }
    const Eigen::VectorXd hinges = scene.model().hinge_angles(scene.start_rad());
    for (std::size_t i = 0; i < hinge_.size(); ++i)
      data_->qpos[model->jnt_qposadr[joint_[i]]] = hinges[hinge_[i]];
    mj_forward(model_, data_);
  }
  ~Mujoco() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  [[nodiscard]] std::string name() const override { return "MuJoCo " + std::string(mj_versionString()); }

  Status advance(const Eigen::VectorXd& axes_rad) override {
    const Eigen::VectorXd hinges = scene_.model().hinge_angles(axes_rad);
    for (std::size_t i = 0; i < hinge_.size(); ++i) data_->ctrl[i] = hinges[hinge_[i]];
    for (int step = 0; step < 10; ++step) mj_step(model_, data_);
    for (int i = 0; i < model_->nv; ++i) {
      if (!std::isfinite(data_->qvel[i])) return Error{ErrorCode::kFailed, "MuJoCo's state is no number"};
    }
    return {};
  }

  [[nodiscard]] int contacts() const override { return data_->ncon; }

 private:
  const PhysicsScene& scene_;
  mjModel* model_;
  mjData* data_;
  std::vector<int> hinge_;
  std::vector<int> joint_;
};

}  // namespace

Result<std::unique_ptr<Contender>> make_mujoco(const PhysicsScene& scene) {
  auto robot = sim::read_robot(scene.urdf_path());
  if (!robot) return robot.error();
  // MuJoCo reads files only
  std::string path = (std::filesystem::temp_directory_path() / "nido_bench_XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file < 0) return Error{ErrorCode::kFailed, "cannot make a temporary file " + path};
  close(file);
  std::ofstream(path) << MjcfWriter(*robot).write(scene);
  std::array<char, 1000> trouble{};
  mjModel* model = mj_loadXML(path.c_str(), nullptr, trouble.data(), trouble.size());
  std::filesystem::remove(path);
  if (model == nullptr) return Error{ErrorCode::kFailed, std::string("MuJoCo: ") + trouble.data()};
  return std::unique_ptr<Contender>(std::make_unique<Mujoco>(scene, *robot, model));
}

}  // namespace nido::bench
