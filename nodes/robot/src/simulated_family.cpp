#include <fmt/format.h>

#include <cmath>

#include "nido/simulator/devices/simulated_camera.h"
#include "nido/simulator/devices/simulated_control_board.h"
#include "nido/simulator/devices/simulated_depth_camera.h"
#include "nido/simulator/devices/simulated_robot.h"
#include "nido/simulator/devices/simulated_sensors.h"
#include "src/device_registry.h"

namespace nido {
namespace {

const Schema& simulation_schema() {
  static const Schema schema{
      "simulation",
      "",
      {{.key = "urdf", .fallback = "icub.urdf", .meaning = "the body, seen from the robot file's folder"},
       {.key = "physics_step_s",
        .kind = ValueKind::kNumber,
        .fallback = "0.001",
        .meaning = "step of the physics, s",
        .min = 0.0001,
        .max = 0.005},
       {.key = "solver_iterations",
        .kind = ValueKind::kInteger,
        .fallback = "30",
        .meaning = "of each physics step",
        .min = 20,
        .max = 1000},
       {.key = "self_collision",
        .kind = ValueKind::kFlag,
        .fallback = "true",
        .meaning = "the robot's limbs and fingers touch each other"},
       {.key = "base",
        .fallback = "fixed",
        .meaning = "what holds the root: the world; a stand that can be seen and touched; nothing, it stands "
                   "on its feet",
        .allowed = {"fixed", "stand", "free"}},
       {.key = "scene_folder",
        .fallback = "out/scenes",
        .meaning =
            "where the world port keeps scenes and snapshots, seen from where the process was started"},
       {.key = "window",
        .kind = ValueKind::kFlag,
        .fallback = "false",
        .meaning = "shows the world on this computer's display"},
       {.key = "antialiasing",
        .kind = ValueKind::kInteger,
        .fallback = "4",
        .meaning = "samples a pixel, 1 or 4",
        .min = 1,
        .max = 4},
       {.key = "brightness",
        .kind = ValueKind::kNumber,
        .fallback = "1",
        .meaning = "of the room's light; 0.5: half of it",
        .min = 0,
        .max = 4}}};
  return schema;
}

// the simulation that the family's devices share; made at the first call
Result<std::shared_ptr<sim::SimulatedRobot>> shared_robot(DeviceContext& context) {
  if (context.simulated) return context.simulated;
  const Result<YAML::Node> parameters =
      check_document(context.simulation, simulation_schema(), context.file.string());
  if (!parameters) return parameters.error();
  sim::SimulationOptions options;
  options.urdf_path = context.file.parent_path() / (*parameters)["urdf"].as<std::string>();
  options.world_path = context.run.world_file;
  options.target = context.run.target;
  options.seed = context.run.seed;
  options.physics_step_s = (*parameters)["physics_step_s"].as<double>();
  options.solver_iterations = (*parameters)["solver_iterations"].as<int>();
  options.light.brightness = (*parameters)["brightness"].as<double>();
  options.self_collision = (*parameters)["self_collision"].as<bool>();
  const std::string base =
      context.run.base.empty() ? (*parameters)["base"].as<std::string>() : context.run.base;
  options.base = base == "free" ? sim::Base::kFree : base == "stand" ? sim::Base::kStand : sim::Base::kFixed;
  options.scene_folder = (*parameters)["scene_folder"].as<std::string>();
  sim::RenderOptions rendering;
  rendering.samples = (*parameters)["antialiasing"].as<int>();
  Result<std::shared_ptr<sim::SimulatedRobot>> made = sim::SimulatedRobot::create(options, rendering);
  if (made) context.simulated = *made;
  return made;
}

using Robot = std::shared_ptr<sim::SimulatedRobot>;
using Maker = Result<MadeDevice> (*)(const YAML::Node&, const Robot&, std::uint64_t seed);

// a kind whose devices need the shared simulation
DeviceKind kind(const std::string& name, std::vector<Field> fields, Maker make) {
  return {name, Schema{"device " + name, "", std::move(fields)},
          [make](const YAML::Node& parameters, DeviceContext& context) -> Result<MadeDevice> {
            const Result<Robot> robot = shared_robot(context);
            if (!robot) return robot.error();
            return make(parameters, *robot, context.run.seed);
          }};
}

// what a maker made, as a device
template <class Interface, class Made>
Result<MadeDevice> as_device(Result<std::unique_ptr<Made>> made) {
  if (!made) return made.error();
  return MadeDevice{std::unique_ptr<Interface>(std::move(*made))};
}

Result<MadeDevice> make_control_board(const YAML::Node& parameters, const Robot& robot, std::uint64_t) {
  return as_device<IControlBoard>(
      sim::SimulatedControlBoard::create(robot, parameters["part"].as<std::string>()));
}

std::vector<Field> picture_fields(const std::string& width, const std::string& height) {
  return {{.key = "width",
           .kind = ValueKind::kInteger,
           .fallback = width,
           .meaning = "pixels",
           .min = 1,
           .max = 4096},
          {.key = "height",
           .kind = ValueKind::kInteger,
           .fallback = height,
           .meaning = "pixels",
           .min = 1,
           .max = 4096}};
}

sim::Camera optics_of(const YAML::Node& parameters) {
  sim::Camera optics;
  optics.width = parameters["width"].as<int>();
  optics.height = parameters["height"].as<int>();
  const double fov_rad = parameters["vertical_fov_deg"].as<double>() * M_PI / 180.0;
  optics.fx_px = optics.fy_px = optics.height / 2.0 / std::tan(fov_rad / 2);
  optics.cx_px = optics.width / 2.0;
  optics.cy_px = optics.height / 2.0;
  return optics;
}

sim::Eye eye_of(const YAML::Node& parameters) {
  return parameters["eye"].as<std::string>() == "left" ? sim::Eye::kLeft : sim::Eye::kRight;
}

Result<MadeDevice> make_eye(const YAML::Node& parameters, const Robot& robot, std::uint64_t seed) {
  const sim::Eye eye = eye_of(parameters);
  // the two eyes must not see the same noise
  const sim::NoiseOptions noise{parameters["blur_px"].as<double>(), parameters["noise_levels"].as<double>(),
                                2 * seed + (eye == sim::Eye::kLeft ? 1 : 2)};
  return as_device<ICamera>(sim::SimulatedCamera::create(robot, eye, optics_of(parameters), noise));
}

Result<MadeDevice> make_depth_eye(const YAML::Node& parameters, const Robot& robot, std::uint64_t) {
  return as_device<IDepthCamera>(
      sim::SimulatedDepthCamera::create(robot, eye_of(parameters), optics_of(parameters)));
}

Result<MadeDevice> make_fixed_camera(const YAML::Node& parameters, const Robot& robot, std::uint64_t) {
  const auto point = [&](const std::string& name) {
    return Eigen::Vector3d(parameters[name + "_x_m"].as<double>(), parameters[name + "_y_m"].as<double>(),
                           parameters[name + "_z_m"].as<double>());
  };
  const sim::Camera camera =
      sim::lookAt(point("from"), point("to"), parameters["width"].as<int>(), parameters["height"].as<int>(),
                  parameters["vertical_fov_deg"].as<double>() * M_PI / 180.0);
  return as_device<ICamera>(sim::SimulatedCamera::create_fixed(robot, camera));
}

std::vector<Field> depth_eye_fields() {
  std::vector<Field> fields = picture_fields("320", "240");
  fields.push_back({.key = "eye", .required = true, .meaning = "which one", .allowed = {"left", "right"}});
  // 257.34 pixels of focal length at a height of 240
  fields.push_back({.key = "vertical_fov_deg",
                    .kind = ValueKind::kNumber,
                    .fallback = "50",
                    .meaning = "field of view",
                    .min = 1,
                    .max = 170});
  return fields;
}

std::vector<Field> eye_fields() {
  std::vector<Field> fields = depth_eye_fields();
  fields.push_back({.key = "blur_px",
                    .kind = ValueKind::kNumber,
                    .fallback = "0",
                    .meaning = "blur of the lens",
                    .min = 0,
                    .max = 5});
  fields.push_back({.key = "noise_levels",
                    .kind = ValueKind::kNumber,
                    .fallback = "0",
                    .meaning = "noise of each colour of each pixel, of 255",
                    .min = 0,
                    .max = 64});
  return fields;
}

std::vector<Field> fixed_camera_fields() {
  std::vector<Field> fields = picture_fields("640", "480");
  fields.push_back({.key = "vertical_fov_deg",
                    .kind = ValueKind::kNumber,
                    .fallback = "45",
                    .meaning = "field of view",
                    .min = 1,
                    .max = 170});
  for (const char* key : {"from_x_m", "from_y_m", "from_z_m", "to_x_m", "to_y_m", "to_z_m"}) {
    fields.push_back(
        {.key = key, .kind = ValueKind::kNumber, .required = true, .meaning = "root frame at the start"});
  }
  return fields;
}

}  // namespace

std::vector<DeviceKind> simulated_family() {
  return {
      kind("sim/control_board", {{.key = "part", .required = true, .meaning = "part of the body"}},
           &make_control_board),
      kind("sim/eye", eye_fields(), &make_eye),
      kind("sim/depth_eye", depth_eye_fields(), &make_depth_eye),
      kind("sim/fixed_camera", fixed_camera_fields(), &make_fixed_camera),
      kind("sim/touch",
           {{.key = "hand", .required = true, .meaning = "which one", .allowed = {"left", "right"}}},
           [](const YAML::Node& parameters, const Robot& robot, std::uint64_t) -> Result<MadeDevice> {
             const sim::Hand hand =
                 parameters["hand"].as<std::string>() == "left" ? sim::Hand::kLeft : sim::Hand::kRight;
             if (!robot->simulation().has_hand(hand)) return sim::no_such_hand(hand);
             return MadeDevice{std::unique_ptr<ITouch>(std::make_unique<sim::SimulatedTouch>(robot, hand))};
           }),
      kind("sim/skin",
           {{.key = "patch", .required = true, .meaning = "which one of the robot's description"}},
           [](const YAML::Node& parameters, const Robot& robot, std::uint64_t) -> Result<MadeDevice> {
             return as_device<ITouch>(
                 sim::SimulatedSkin::create(robot, parameters["patch"].as<std::string>()));
           }),
      kind("sim/world", {},
           [](const YAML::Node&, const Robot& robot, std::uint64_t) -> Result<MadeDevice> {
             return MadeDevice{std::unique_ptr<IWorld>(std::make_unique<sim::SimulatedWorld>(robot))};
           }),
      kind("sim/force_torque",
           {{.key = "limb",
             .required = true,
             .meaning = "which one",
             .allowed = {"left_arm", "right_arm", "left_leg", "right_leg"}}},
           [](const YAML::Node& parameters, const Robot& robot, std::uint64_t) -> Result<MadeDevice> {
             return as_device<IForceTorque>(
                 sim::SimulatedForceTorque::create(robot, parameters["limb"].as<std::string>()));
           }),
      kind("sim/inertial", {},
           [](const YAML::Node&, const Robot& robot, std::uint64_t) -> Result<MadeDevice> {
             return MadeDevice{std::unique_ptr<IInertial>(std::make_unique<sim::SimulatedInertial>(robot))};
           }),
  };
}

}  // namespace nido
