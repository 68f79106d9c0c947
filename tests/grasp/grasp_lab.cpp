#include "grasp_lab.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

#include "nido/grasp/settings.h"
#include "nido/reach/settings.h"

namespace nido::grasp {

namespace {

constexpr double kTable_m = -0.0826;
constexpr double kUp_m = 0.04;
constexpr double kLift_m = 0.12;
constexpr double kReleaseHeight_m = 0.10;  // over the rim, as goal selection has it
const Eigen::Vector2d kBasket_m{-0.32, 0.25};

std::string config(const std::string& file) { return std::string(NIDO_CONFIG_DIR) + "/" + file; }

void require(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

template <class T>
T required(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

}  // namespace

GraspLab::GraspLab(const LabThing& thing, GraspCore::Policy policy) : thing_(thing) {
  sim::SimulationOptions options;
  options.urdf_path = config("robots/icub.urdf");
  const bool made = thing.line.starts_with("mk ");
  options.world_yaml = fmt::format(
      "table: {{top_center_m: [-0.40, 0.0, {}], size_m: [0.40, 0.70]}}\n"
      "posture_deg:\n"
      "  left_arm: [0, 80, 5, 65, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10]\n"
      "  right_arm: [0, 80, 5, 65, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10]\n"
      "objects:\n  - {{object: basket, name: basket, position_m: [{}, {}]}}\n",
      kTable_m, kBasket_m.x(), kBasket_m.y());
  if (!made)
    options.world_yaml += fmt::format("  - {{{}, name: {}, position_m: [{}, {}], yaw_deg: {}}}\n", thing.line,
                                      thing.name, thing.place_m.x(), thing.place_m.y(), thing.yaw_deg);
  simulation_ = required(sim::Simulation::create(options));
  if (made) make_thing();
  arm_ = simulation_->part_index("right_arm");
  torso_ = simulation_->part_index("torso");
  const reach::SettingsPaths paths{.urdf = config("robots/icub.urdf"),
                                   .postures = config("robots/grasp_postures.yaml"),
                                   .posture_weights = config("weights/reach_posture.txt"),
                                   .hand_weights = config("weights/reach_hand.txt")};
  reach_ = std::make_unique<reach::ReachCore>(
      required(reach::make_reach_core(paths, "right", false, reach::default_planner_options())));
  grasp_ = std::make_unique<GraspCore>(required(load_grasp_options(paths.urdf, paths.postures, "right")),
                                       std::move(policy));
  for (int i = 0; i < 30; ++i) tick();
}

void GraspLab::make_thing() {
  // the world port's frame: x to the left, y up, z forward, origin on the floor
  const Eigen::Vector3d p(-thing_.place_m.y(), kTable_m + 0.5976 + 0.1, -thing_.place_m.x() - 0.026);
  const auto tell = [&](const std::string& line) {
    const std::string answer = simulation_->world("world " + line);
    if (answer.starts_with("[fail]")) throw std::runtime_error(answer + " to " + line);
  };
  tell(fmt::format("{} {} {} {} 0 0 1", thing_.line, p.x(), p.y(), p.z()));
  const std::string kind = thing_.line.substr(3, 3);
  tell(fmt::format("name {} 1 \"{}\"", kind, thing_.name));
  const sim::ObjectState o = required(simulation_->object(thing_.name));
  tell(fmt::format("rot \"{}\" -90 0 {}", thing_.name, thing_.yaw_deg));
  tell(fmt::format("set \"{}\" {} {} {}", thing_.name, p.x(), kTable_m + 0.5976 + o.size_m.z() / 2, p.z()));
}

Eigen::Vector3d GraspLab::p_Root_m() const {
  const sim::ObjectState o = required(simulation_->object(thing_.name));
  return o.X_WorldObject * Eigen::Vector3d(0, 0, o.kind == "bear" ? o.size_m.z() / 2 : 0);
}

Eigen::Vector3d GraspLab::p_Palm_m() const {
  return required(simulation_->X_WorldLink("r_hand")).inverse() * p_Root_m();
}

void GraspLab::tick() {
  require(simulation_->step());
  const auto arm = simulation_->joints(arm_);
  const auto torso = simulation_->joints(torso_);
  reach::ReachInput in = reach_goal_;
  reach_goal_ = {};
  reach::Joints measured;
  for (int i = 0; i < reach::kTorsoJoints; ++i) measured(i) = torso[static_cast<std::size_t>(i)].position_rad;
  for (int i = 0; i < reach::kArmJoints; ++i)
    measured(reach::kTorsoJoints + i) = arm[static_cast<std::size_t>(i)].position_rad;
  in.measured_rad = measured;
  // what eyes would say of the table, but for the thing's place
  in.objects.emplace();
  for (const sim::ObjectState& o : simulation_->objects()) {
    if (o.name == "table") continue;
    const bool on_ground = o.kind == "bear" || o.kind == "basket";
    Eigen::Vector3d p = o.X_WorldObject * Eigen::Vector3d(0, 0, on_ground ? o.size_m.z() / 2 : 0);
    if (o.name == thing_.name) p += thing_.error_Root_m;
    in.objects->push_back({o.name, p, o.size_m});
  }
  const reach::ReachOutput reach_out = reach_->step(simulation_->time_s(), in);
  reach_status_ = reach_out.status;

  GraspInputs feel;
  feel.goal = grasp_goal_;
  grasp_goal_.reset();
  feel.touch = simulation_->touch(sim::Hand::kRight).on;
  std::vector<double> arm_rad;
  for (const sim::JointState& joint : arm) arm_rad.push_back(joint.position_rad);
  feel.measured = fingers_of_arm(arm_rad);
  const GraspOutputs grasp_out = grasp_->step(sim::Simulation::kControlPeriod_s, feel);
  if (grasp_out.status) grasp_status_ = *grasp_out.status;

  if (reach_out.command_rad) {
    static constexpr std::array<int, 7> kArm = {0, 1, 2, 3, 4, 5, 6};
    static constexpr std::array<int, 3> kTorso = {0, 1, 2};
    const reach::Joints& q = *reach_out.command_rad;
    require(simulation_->command(torso_, sim::JointMode::kDirect, kTorso, std::span(q.data(), 3)));
    require(simulation_->command(arm_, sim::JointMode::kDirect, kArm, std::span(q.data() + 3, 7)));
  }
  if (grasp_out.active) {
    static constexpr std::array<int, 9> kFingers = {7, 8, 9, 10, 11, 12, 13, 14, 15};
    std::array<double, 9> target{};
    target[0] = grasp_out.target.spread_rad;
    std::copy(grasp_out.target.joint_rad.begin(), grasp_out.target.joint_rad.end(), target.begin() + 1);
    require(simulation_->command(arm_, sim::JointMode::kDirect, kFingers, target));
  }
}

std::string GraspLab::ask(const std::string& reach, const Eigen::Vector3d& p_Root_m,
                          const std::string& grasp) {
  ++id_;
  if (!reach.empty()) {
    const sim::ObjectState o = required(simulation_->object(thing_.name));
    reach_goal_.goal = reach::ReachGoal{id_, reach, thing_.name, p_Root_m, o.size_m, 0.0};
  }
  if (!grasp.empty()) grasp_goal_ = GraspGoal{id_, grasp, thing_.name};
  for (int i = 0; i < 3000; ++i) {
    tick();
    const bool reached =
        reach.empty() || (reach_status_.id == id_ && reach_status_.state != reach::ActionState::kRunning);
    const bool grasped = grasp.empty() || (grasp_status_.id == id_ && grasp_status_.state != "running");
    if (reached && grasped) break;
  }
  if (!reach.empty() && reach_status_.state != reach::ActionState::kDone) {
    return reach + ": " + (reach_status_.reason.empty() ? "no end" : reach_status_.reason);
  }
  if (!grasp.empty() && grasp_status_.state != "done") {
    return grasp + ": " + (grasp_status_.reason.empty() ? "no end" : grasp_status_.reason);
  }
  return {};
}

LabResult GraspLab::take(double hold_s) {
  LabResult result;
  result.trouble = ask("home", Eigen::Vector3d::Zero(), "");
  if (!result.trouble.empty()) return result;
  const Eigen::Vector3d p_start_m = p_Root_m();
  const Eigen::Vector3d p_believed_m = p_start_m + thing_.error_Root_m;
  result.trouble = ask("pregrasp", p_believed_m, "open");
  if (!result.trouble.empty()) return result;
  result.trouble = ask("", Eigen::Vector3d::Zero(), "grasp");
  const std::string lift = ask("lift", p_believed_m + Eigen::Vector3d(0, 0, kLift_m), "");
  if (result.trouble.empty()) result.trouble = lift;
  const Eigen::Vector3d p_Palm0_m = p_Palm_m();
  for (int i = 0; i * sim::Simulation::kControlPeriod_s < hold_s; ++i) {
    tick();
    if (p_Root_m().z() > p_start_m.z() + kUp_m) ++result.steps_held;
  }
  result.slip_m = (p_Palm_m() - p_Palm0_m).norm();
  result.lifted_m = p_Root_m().z() - p_start_m.z();
  result.held = required(simulation_->hold(thing_.name)).held() && result.lifted_m > kUp_m;
  result.said_so = grasp_->holding();
  return result;
}

void GraspLab::drop(LabResult& result) {
  const sim::ObjectState basket = required(simulation_->object("basket"));
  const Eigen::Vector3d p_rim_m = basket.X_WorldObject * Eigen::Vector3d(0, 0, basket.size_m.z()) +
                                  Eigen::Vector3d(0, 0, kReleaseHeight_m);
  result.trouble = ask("carry", p_rim_m, "");
  if (!result.trouble.empty()) return;
  result.trouble = ask("", Eigen::Vector3d::Zero(), "release");
  const std::string home = ask("home", Eigen::Vector3d::Zero(), "");
  if (result.trouble.empty()) result.trouble = home;
  for (int i = 0; i < 50; ++i) tick();
  result.in_basket = required(simulation_->is_inside(thing_.name, "basket"));
}

}  // namespace nido::grasp
