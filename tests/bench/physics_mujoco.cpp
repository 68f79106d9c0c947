#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
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

// Links that do not touch each other.
using Pairs = std::set<std::pair<std::size_t, std::size_t>>;

// MuJoCo's own description of the robot that our URDF describes: the same masses, shapes and limits.
class MjcfWriter {
 public:
  explicit MjcfWriter(const sim::RobotDescription& robot) : robot_(robot) {}

  std::string write(const PhysicsScene& scene, const Pairs& apart) {
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
    out_ << "</actuator>\n<contact>\n";
    for (const auto& [a, b] : apart)
      out_ << "<exclude body1=\"" << name(a) << "\" body2=\"" << name(b) << "\"/>\n";
    out_ << "</contact></mujoco>\n";
    return out_.str();
  }

 private:
  static std::string name(std::size_t link) { return link == 0 ? "world" : "b" + std::to_string(link); }

  void shapes(const sim::LinkDescription& link) {
    for (const sim::LinkShape& shape : link.collisions) {
      const Eigen::Vector3d& s = shape.placed.shape.size;
      out_ << "<geom contype=\"1\" conaffinity=\"3\" mass=\"0\" " << pose(shape.placed.X_OwnerShape);
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
      out_ << "<body name=\"" << name(index) << "\" " << pose(link.X_ParentLink) << "><inertial pos=\""
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

// 1 left, 2 right, 0: no part of a hand.
int hand_of(const sim::LinkDescription& link) {
  for (const char* part : {"_thumb", "_index", "_middle", "_ring", "_little", "_hand", "_palm"}) {
    for (const sim::NamedFrame& frame : link.frames) {
      if (frame.name.starts_with(std::string("l") + part)) return 1;
      if (frame.name.starts_with(std::string("r") + part)) return 2;
    }
  }
  return 0;
}

// Links within two hinges of each other and those of one hand: the simulator's own rule (docs/simulator.md).
Pairs neighbours(const sim::RobotDescription& robot) {
  const auto path = [&robot](std::size_t link) {
    std::set<std::size_t> links;
    for (; link != 0; link = static_cast<std::size_t>(robot.links[link].parent)) links.insert(link);
    return links;
  };
  Pairs pairs;
  for (std::size_t a = 0; a < robot.links.size(); ++a) {
    for (std::size_t b = a + 1; b < robot.links.size(); ++b) {
      std::vector<std::size_t> between;
      const std::set<std::size_t> to_a = path(a);
      const std::set<std::size_t> to_b = path(b);
      std::set_symmetric_difference(to_a.begin(), to_a.end(), to_b.begin(), to_b.end(),
                                    std::back_inserter(between));
      const int hand = hand_of(robot.links[a]);
      if (between.size() <= 2 || (hand != 0 && hand == hand_of(robot.links[b]))) pairs.emplace(a, b);
    }
  }
  return pairs;
}

Result<mjModel*> compile(const sim::RobotDescription& robot, const PhysicsScene& scene, const Pairs& apart) {
  // MuJoCo reads files only
  std::string path = (std::filesystem::temp_directory_path() / "nido_bench_XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file < 0) return Error{ErrorCode::kFailed, "cannot make a temporary file " + path};
  close(file);
  std::ofstream(path) << MjcfWriter(robot).write(scene, apart);
  std::array<char, 1000> trouble{};
  mjModel* model = mj_loadXML(path.c_str(), nullptr, trouble.data(), trouble.size());
  std::filesystem::remove(path);
  if (model == nullptr) return Error{ErrorCode::kFailed, std::string("MuJoCo: ") + trouble.data()};
  return model;
}

// The links that touch each other at home.
Pairs touching_at_home(const sim::RobotDescription& robot, const PhysicsScene& scene, const mjModel* model) {
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model), mj_deleteData);
  const Eigen::VectorXd hinges = scene.model().hinge_angles(scene.model().home_axes());
  for (std::size_t i = 1; i < robot.links.size(); ++i) {
    const int joint = mj_name2id(model, mjOBJ_JOINT, ("j" + std::to_string(i)).c_str());
    data->qpos[model->jnt_qposadr[joint]] =
        hinges[scene.model().hinge_index(robot.links[i].joint_name).value()];
  }
  mj_forward(model, data.get());
  // the link of a body; none: -1
  const auto link = [model](int geom) {
    const int body = model->geom_bodyid[geom];
    const char* name = mj_id2name(model, mjOBJ_BODY, body);
    return body == 0 ? 0 : name != nullptr && name[0] == 'b' ? std::stoi(name + 1) : -1;
  };
  Pairs pairs;
  for (int i = 0; i < data->ncon; ++i) {
    const int a = link(data->contact[i].geom1);
    const int b = link(data->contact[i].geom2);
    if (a >= 0 && b >= 0) pairs.emplace(std::min(a, b), std::max(a, b));
  }
  return pairs;
}

}  // namespace

Result<std::unique_ptr<Contender>> make_mujoco(const PhysicsScene& scene) {
  auto robot = sim::read_robot(scene.urdf_path());
  if (!robot) return robot.error();
  Pairs apart = neighbours(*robot);
  Result<mjModel*> model = compile(*robot, scene, apart);
  if (!model) return model.error();
  apart.merge(touching_at_home(*robot, scene, *model));
  mj_deleteModel(*model);
  model = compile(*robot, scene, apart);
  if (!model) return model.error();
  return std::unique_ptr<Contender>(std::make_unique<Mujoco>(scene, *robot, *model));
}

}  // namespace nido::bench
