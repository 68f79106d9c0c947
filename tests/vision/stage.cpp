#include "stage.h"

#include <cmath>
#include <cstdlib>
#include <iostream>

namespace nido::test {
namespace {

[[noreturn]] void give_up(const std::string& sentence) {
  std::cerr << sentence << '\n';
  std::exit(3);
}

void need_ok(const Status& status) {
  if (!status) give_up(status.error().message);
}

sim::SimulationOptions options(const std::string& world_yaml, std::uint64_t seed) {
  sim::SimulationOptions o;
  o.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  o.world_yaml = world_yaml;
  o.seed = seed;
  return o;
}

}  // namespace

Stage::Stage(const std::string& world_yaml, std::uint64_t seed)
    : simulation_(need(sim::Simulation::create(options(world_yaml, seed)))),
      model_(need(RobotModel::load(std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf"))),
      renderer_(need(sim::Renderer::create())) {}

void Stage::look_at(const Eigen::Vector3d& p_Root_m) {
  auto gaze = vision::GazeController::create(model_, PinholeCamera{}, {});
  if (!gaze) give_up(gaze.error().message);
  const auto torso = encoders("torso").position_rad;
  const auto head = gaze->solve(p_Root_m, {torso[0], torso[1], torso[2]}, {});
  need_ok(simulation_->place_joints(simulation_->part_index("head"), head));
}

void Stage::place(const std::string& part, const std::vector<double>& position_deg) {
  std::vector<double> position_rad(position_deg);
  for (double& v : position_rad) v *= M_PI / 180;
  need_ok(simulation_->place_joints(simulation_->part_index(part), position_rad));
}

void Stage::render(sim::Eye eye, Image& picture) {
  sim::Camera camera;
  camera.X_WorldCamera = simulation_->X_WorldCamera(eye);
  simulation_->scene(scene_);
  need_ok(renderer_.setLighting(scene_.light));
  need_ok(renderer_.setScene(scene_));
  need_ok(renderer_.render(camera, picture));
  picture.stamp_ns = simulation_->time_ns();
}

void Stage::render_depth(sim::Eye eye, sim::DepthImage& picture) {
  sim::Camera camera;
  camera.X_WorldCamera = simulation_->X_WorldCamera(eye);
  simulation_->scene(scene_);
  need_ok(renderer_.setScene(scene_));
  need_ok(renderer_.renderDepth(camera, picture));
}

void Stage::take(Image& left, Image& right) {
  render(sim::Eye::kLeft, left);
  render(sim::Eye::kRight, right);
}

vision::EncoderSample Stage::encoders(const std::string& part) const {
  vision::EncoderSample sample;
  sample.stamp = Time{simulation_->time_ns()};
  for (const auto& joint : simulation_->joints(simulation_->part_index(part))) {
    sample.position_rad.push_back(joint.position_rad);
    sample.velocity_rad_s.push_back(joint.velocity_rad_s);
  }
  return sample;
}

vision::VisionInputs Stage::inputs(bool pictures) {
  vision::VisionInputs in;
  in.head.push_back(encoders("head"));
  in.torso.push_back(encoders("torso"));
  if (pictures) {
    Image left;
    Image right;
    take(left, right);
    in.left = std::move(left);
    in.right = std::move(right);
  }
  return in;
}

Stage::Truth Stage::truth(const std::string& object) const {
  const sim::ObjectState state = need(simulation_->object(object));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  if (state.kind == "basket") middle.z() = 0.03;
  if (state.kind == "bear") middle = {0.006, 0, 0.04};  // of the box around seat, feet, head and ears
  const Eigen::Vector3d x = state.X_WorldObject.linear().col(0);
  return {state.X_WorldObject * middle, std::atan2(x.y(), x.x())};
}

std::string table_world(const std::vector<std::string>& objects) {
  std::string text = "table: {top_center_m: [-0.40, 0.0, -0.0826], size_m: [0.40, 0.70]}\nobjects:\n";
  for (const std::string& object : objects) text += "  - " + object + "\n";
  return text;
}

}  // namespace nido::test
