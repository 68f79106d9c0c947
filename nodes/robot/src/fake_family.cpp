#include <fmt/format.h>

#include "fake/fake_control_board.h"
#include "fake/fake_sensors.h"
#include "nido/kinematics/robot_model.h"
#include "src/device_registry.h"

namespace nido {
namespace {

constexpr int kPads = 6;

Result<MadeDevice> make_control_board(const YAML::Node& parameters, DeviceContext& context) {
  const std::filesystem::path urdf = context.file.parent_path() / parameters["urdf"].as<std::string>();
  const Result<RobotModel> model = RobotModel::load(urdf);
  if (!model) return model.error();
  const Result<int> part = model->part_index(parameters["part"].as<std::string>());
  if (!part) return part.error();
  std::vector<FakeJoint> joints;
  for (const Axis& axis : model->parts()[static_cast<std::size_t>(*part)].axes) {
    joints.push_back({axis.name,
                      {axis.lower_rad, axis.upper_rad, axis.velocity_rad_s, axis.effort_Nm},
                      axis.home_rad,
                      axis.reference_speed_rad_s});
  }
  auto board = std::make_unique<FakeControlBoard>(std::move(joints), context.clock.now_ns());
  const std::string what = parameters["fail"].as<std::string>();
  if (what != "nothing") {
    const Error failure{ErrorCode::kFailed, "this fake board was told to fail"};
    FakeFailures failures;
    if (what == "commands") failures.commands = failure;
    if (what == "reads") failures.reads = failure;
    if (what == "device") failures.step = failure;
    const auto after_ns = static_cast<std::int64_t>(parameters["fail_after_s"].as<double>() * 1e9);
    board->schedule_failures(context.clock.now_ns() + after_ns, failures);
  }
  ISteppable* steppable = board.get();
  return MadeDevice{std::unique_ptr<IControlBoard>(std::move(board)), steppable};
}

Result<MadeDevice> make_camera(const YAML::Node& parameters, DeviceContext& context) {
  const int width = parameters["width"].as<int>();
  const int height = parameters["height"].as<int>();
  const CameraInfo info{
      width, height, static_cast<double>(width), static_cast<double>(width), width / 2.0, height / 2.0, {}};
  return MadeDevice{std::unique_ptr<ICamera>(std::make_unique<FakeCamera>(info, context.clock))};
}

}  // namespace

std::vector<DeviceKind> fake_family() {
  return {
      {"fake/control_board",
       {"device fake/control_board",
        "",
        {{.key = "part", .required = true, .meaning = "part of the body whose joints it has"},
         {.key = "urdf", .fallback = "icub.urdf", .meaning = "the body, seen from the robot file's folder"},
         {.key = "fail",
          .fallback = "nothing",
          .meaning = "what goes wrong",
          .allowed = {"nothing", "commands", "reads", "device"}},
         {.key = "fail_after_s",
          .kind = ValueKind::kNumber,
          .fallback = "0",
          .meaning = "when it begins to fail, s",
          .min = 0}}},
       &make_control_board},
      {"fake/camera",
       {"device fake/camera",
        "",
        {{.key = "width",
          .kind = ValueKind::kInteger,
          .fallback = "320",
          .meaning = "pixels",
          .min = 1,
          .max = 4096},
         {.key = "height",
          .kind = ValueKind::kInteger,
          .fallback = "240",
          .meaning = "pixels",
          .min = 1,
          .max = 4096}}},
       &make_camera},
      {"fake/touch",
       {"device fake/touch", "", {}},
       [](const YAML::Node&, DeviceContext& context) -> Result<MadeDevice> {
         return MadeDevice{std::unique_ptr<ITouch>(std::make_unique<FakeTouch>(kPads, context.clock))};
       }},
      {"fake/world",
       {"device fake/world", "", {}},
       [](const YAML::Node&, DeviceContext&) -> Result<MadeDevice> {
         return MadeDevice{std::unique_ptr<IWorld>(std::make_unique<FakeWorld>())};
       }},
      {"fake/force_torque",
       {"device fake/force_torque", "", {}},
       [](const YAML::Node&, DeviceContext& context) -> Result<MadeDevice> {
         return MadeDevice{std::unique_ptr<IForceTorque>(std::make_unique<FakeForceTorque>(context.clock))};
       }},
      {"fake/inertial",
       {"device fake/inertial", "", {}},
       [](const YAML::Node&, DeviceContext& context) -> Result<MadeDevice> {
         return MadeDevice{std::unique_ptr<IInertial>(std::make_unique<FakeInertial>(context.clock))};
       }},
  };
}

}  // namespace nido
