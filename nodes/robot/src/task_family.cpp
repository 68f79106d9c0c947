#include "nido/kinematics/robot_model.h"
#include "nido/textproto/task_text.h"
#include "nido/yarp/devices.h"
#include "src/device_registry.h"
#include "task/cartesian_arm.h"
#include "task/head_gaze.h"

namespace nido {
namespace {

Field board_field(const char* key, const char* fallback) {
  return {.key = key, .fallback = fallback, .meaning = "name of the control board, further up in this file"};
}
Field urdf_field() {
  return {.key = "urdf", .fallback = "icub.urdf", .meaning = "the body, seen from the robot file's folder"};
}

Result<IControlBoard*> board_of(const YAML::Node& parameters, const char* key, const DeviceContext& context) {
  const auto name = parameters[key].as<std::string>();
  if (IControlBoard* board = context.board ? context.board(name) : nullptr) return board;
  return Error{ErrorCode::kInvalidArgument,
               std::string(key) + ": there is no control board '" + name + "' further up in the robot file"};
}

Result<RobotModel> model_of(const YAML::Node& parameters, const DeviceContext& context) {
  return RobotModel::load(context.file.parent_path() / parameters["urdf"].as<std::string>());
}

Result<MadeDevice> make_cartesian(const YAML::Node& parameters, DeviceContext& context) {
  const auto side = parameters["side"].as<std::string>();
  YAML::Node given = YAML::Clone(parameters);
  if (given["arm"].as<std::string>().empty()) given["arm"] = side + "_arm";
  const Result<IControlBoard*> arm = board_of(given, "arm", context);
  if (!arm) return arm.error();
  const Result<IControlBoard*> torso = board_of(given, "torso", context);
  if (!torso) return torso.error();
  const Result<RobotModel> model = model_of(given, context);
  if (!model) return model.error();
  auto hand =
      CartesianArm::create(*model, side, **arm, **torso, given["with_torso"].as<bool>(), context.clock);
  if (!hand) return hand.error();
  ISteppable* commander = hand->get();
  return MadeDevice{std::unique_ptr<ICartesianControl>(std::move(*hand)), nullptr, commander};
}

Result<MadeDevice> make_gaze(const YAML::Node& parameters, DeviceContext& context) {
  const Result<IControlBoard*> head = board_of(parameters, "head", context);
  if (!head) return head.error();
  const Result<IControlBoard*> torso = board_of(parameters, "torso", context);
  if (!torso) return torso.error();
  Result<RobotModel> model = model_of(parameters, context);
  if (!model) return model.error();
  PinholeCamera camera;
  camera.width_px = parameters["width"].as<int>();
  camera.height_px = parameters["height"].as<int>();
  camera.fx_px = camera.fy_px = parameters["focal_px"].as<double>();
  camera.cx_px = camera.width_px / 2.0;
  camera.cy_px = camera.height_px / 2.0;
  auto gaze = HeadGaze::create(std::move(model).value(), camera, **head, **torso, context.clock);
  if (!gaze) return gaze.error();
  ISteppable* commander = gaze->get();
  return MadeDevice{std::unique_ptr<IGazeControl>(std::move(*gaze)), nullptr, commander};
}

}  // namespace

std::vector<DeviceKind> task_family() {
  return {{"task/cartesian",
           {"device task/cartesian",
            "",
            {{.key = "side", .required = true, .meaning = "which hand", .allowed = {"left", "right"}},
             board_field("arm", "''"),
             board_field("torso", "torso"),
             {.key = "with_torso",
              .kind = ValueKind::kFlag,
              .fallback = "true",
              .meaning = "the torso moves with the arm"},
             urdf_field()}},
           &make_cartesian},
          {"task/gaze",
           {"device task/gaze",
            "",
            {board_field("head", "head"),
             board_field("torso", "torso"),
             {.key = "width",
              .kind = ValueKind::kInteger,
              .fallback = "320",
              .meaning = "of the eyes' pictures, pixels",
              .min = 1,
              .max = 4096},
             {.key = "height",
              .kind = ValueKind::kInteger,
              .fallback = "240",
              .meaning = "pixels",
              .min = 1,
              .max = 4096},
             {.key = "focal_px",
              .kind = ValueKind::kNumber,
              .fallback = "257.34",
              .meaning = "focal length, pixels",
              .min = 1,
              .max = 10000},
             urdf_field()}},
           &make_gaze}};
}

}  // namespace nido
