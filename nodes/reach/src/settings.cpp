#include "nido/reach/settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>

#include "nido/kinematics/body_corrections.h"

namespace nido::reach {
namespace {

constexpr double kRadPerDeg = static_cast<double>(EIGEN_PI) / 180.0;

Error refuse(const std::string& path, const YAML::Node& at, const std::string& sentence) {
  return {ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", path, at ? at.Mark().line + 1 : 0, sentence)};
}

Result<Eigen::Vector3d> read_vector(const std::string& path, const YAML::Node& node, const YAML::Node& shape,
                                    const std::string& what) {
  Eigen::Vector3d value;
  try {
    if (!node || !node.IsSequence() || node.size() != 3) throw YAML::Exception(shape.Mark(), what);
    for (std::size_t i = 0; i < 3; ++i) value(static_cast<Eigen::Index>(i)) = node[i].as<double>();
  } catch (const YAML::Exception&) {
    return refuse(path, node ? node : shape, what + " must be three numbers");
  }
  if (!value.allFinite() || value.norm() > 10.0) return refuse(path, node, what + " is out of all reason");
  return value;
}

// One shape: R_RootPalm, p_PalmObject_m, approach_m as grasp_postures.yaml explains them.
Result<PalmPosture> read_grasp_posture(const std::string& path, const std::string& shape,
                                       const YAML::Node& node) {
  const YAML::Node rows = node.IsMap() ? node["R_RootPalm"] : YAML::Node();
  if (!rows || !rows.IsSequence() || rows.size() != 3) {
    return refuse(path, node, "shape " + shape + ": R_RootPalm must be three rows of three numbers");
  }
  Eigen::Matrix3d R;
  for (std::size_t i = 0; i < 3; ++i) {
    auto row = read_vector(path, rows[i], node, "shape " + shape + ": a row of R_RootPalm");
    if (!row) return row.error();
    R.row(static_cast<Eigen::Index>(i)) = row->transpose();
  }
  if ((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3 || R.determinant() < 0.0) {
    return refuse(path, rows, "shape " + shape + ": R_RootPalm is no rotation");
  }
  auto object = read_vector(path, node["p_PalmObject_m"], node, "shape " + shape + ": p_PalmObject_m");
  if (!object) return object.error();
  auto approach = read_vector(path, node["approach_m"], node, "shape " + shape + ": approach_m");
  if (!approach) return approach.error();
  if (approach->norm() < 0.01)
    return refuse(path, node["approach_m"], "shape " + shape + ": approach_m is no way");
  PalmPosture posture;
  posture.X_ObjectPalm.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  posture.X_ObjectPalm.translation() = -(posture.X_ObjectPalm.linear() * *object);
  posture.approach_Object = -approach->normalized();
  posture.standoff_m = approach->norm();
  // the postures hold things turned any way; the arm may turn them about the vertical where it gets there
  // easier
  posture.turns_rad.clear();
  for (const double turn_deg : {0.0, 10.0, -10.0, 20.0, -20.0, 30.0, -30.0, 45.0, -45.0}) {
    posture.turns_rad.push_back(turn_deg * kRadPerDeg);
  }
  posture.turn_cost = 4.0;
  return posture;
}

Error with_mend(const Error& error, const std::string& command) {
  return {error.code, fmt::format("{}; `{}` makes it anew", error.message, command)};
}

}  // namespace

Result<Body> load_body(const std::string& urdf_path, const std::string& calibration_path,
                       const std::string& side) {
  auto model = nido::load_corrected_model(urdf_path, std::filesystem::path(calibration_path));
  if (!model) return model.error();
  auto chain = ArmChain::from_model(*model, side);
  if (!chain) return chain.error();
  auto hand = model->hand(side);
  if (!hand) return hand.error();
  const auto mark = std::ranges::find_if(hand->marks, [](const HandMark& m) { return m.name == "knuckle"; });
  if (mark == hand->marks.end()) {
    return Error{ErrorCode::kInvalidArgument, urdf_path + ": the " + side + " hand has no mark 'knuckle'"};
  }
  const Eigen::VectorXd zero = model->zero_axes();
  const Eigen::Isometry3d X_PalmMark =
      model->X_RootLink(hand->frame, zero).inverse() * model->X_RootLink(mark->link, zero);
  return Body{std::move(*chain), X_PalmMark.translation()};
}

PlannerOptions default_planner_options() {
  PlannerOptions options;
  options.home << 0.0, 0.0, 0.0, 0.0, 80.0, 5.0, 65.0, 0.0, 0.0, 0.0;
  options.home *= kRadPerDeg;
  // the trunk helps slowly and little: the head rides on it
  options.speed_rad_s << 0.5, 0.4, 0.4, 1.0, 1.0, 1.0, 1.0, 1.3, 1.3, 1.3;
  options.torso_and_arm_min.head<kTorsoJoints>() << -35.0 * kRadPerDeg, -10.0 * kRadPerDeg, -5.0 * kRadPerDeg;
  options.torso_and_arm_max.head<kTorsoJoints>() << 35.0 * kRadPerDeg, 10.0 * kRadPerDeg, 25.0 * kRadPerDeg;
  options.rest_weight << 0.6, 2.0, 0.6, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1;
  return options;
}

std::string weights_file(const std::string& what, const std::string& side) {
  return side == "right" ? what + ".txt" : fmt::format("{}_{}.txt", what, side);
}

SettingsPaths shipped_paths(const std::filesystem::path& config, const std::string& side) {
  SettingsPaths paths;
  paths.urdf = (config / "robots" / "icub.urdf").string();
  paths.postures = (config / "robots" / "grasp_postures.yaml").string();
  paths.posture_weights = (config / "weights" / weights_file("reach_posture", side)).string();
  paths.hand_weights = (config / "weights" / weights_file("reach_hand", side)).string();
  return paths;
}

PalmPosture mirrored(const PalmPosture& posture) {
  const Eigen::DiagonalMatrix<double, 3> left_and_right(1.0, -1.0, 1.0);
  // z comes out of the right palm and out of the back of the left hand
  const Eigen::DiagonalMatrix<double, 3> palm_and_back(1.0, 1.0, -1.0);
  PalmPosture other = posture;
  other.X_ObjectPalm.linear() = left_and_right * posture.X_ObjectPalm.linear() * palm_and_back;
  other.X_ObjectPalm.translation() = left_and_right * posture.X_ObjectPalm.translation();
  other.approach_Object = left_and_right * posture.approach_Object;
  for (double& turn : other.turns_rad) turn = -turn;
  return other;
}

PalmPosture default_reach_posture() {
  // palm down, fingers forward and to the left as the arm likes it; the middle of the palm over the thing's
  // top
  PalmPosture posture;
  posture.X_ObjectPalm.linear().col(0) = -Eigen::Vector3d::UnitX();
  posture.X_ObjectPalm.linear().col(1) = Eigen::Vector3d::UnitY();
  posture.X_ObjectPalm.linear().col(2) = -Eigen::Vector3d::UnitZ();
  posture.X_ObjectPalm.translation() = Eigen::Vector3d(0.03, 0.0, 0.0);
  posture.above_top_m = 0.018;
  posture.standoff_m = 0.06;
  posture.turns_rad = {0.35, 0.0, 0.7, -0.35, 1.05};
  return posture;
}

Result<ReachCore> make_reach_core(const SettingsPaths& paths, const std::string& side,
                                  bool paper_network_alone, const PlannerOptions& planner) {
  auto body = load_body(paths.urdf, paths.calibration, side);
  if (!body) return body.error();
  const bool left = side == "left";
  const std::string command = std::string("nido experiment run reach-learning --set weights=config/weights") +
                              (left ? " --hand left" : "");
  auto posture_file = learning::WeightsFile::load(paths.posture_weights);
  if (!posture_file) return with_mend(posture_file.error(), command);
  auto postures = PostureNetwork::read_from(*posture_file);
  if (!postures)
    return with_mend({postures.error().code, paths.posture_weights + ": " + postures.error().message},
                     command);
  auto hand_file = learning::WeightsFile::load(paths.hand_weights);
  if (!hand_file) return with_mend(hand_file.error(), command);
  auto seen_hand = SeenHandModel::read_from(*hand_file);
  if (!seen_hand)
    return with_mend({seen_hand.error().code, paths.hand_weights + ": " + seen_hand.error().message},
                     command);
  auto grasp_postures = load_grasp_postures(paths.postures);
  if (!grasp_postures) return grasp_postures.error();
  ReachOptions options;
  options.paper_network_alone = paper_network_alone;
  options.grasp_postures = std::move(*grasp_postures);
  options.reach_posture = default_reach_posture();
  if (left) {
    options.reach_posture = mirrored(options.reach_posture);
    for (auto& [shape, posture] : options.grasp_postures) posture = mirrored(posture);
  }
  return ReachCore(
      MotionPlanner(std::move(body->chain), std::move(*seen_hand), std::move(*postures), planner), options);
}

Result<std::map<std::string, PalmPosture>> load_grasp_postures(const std::string& path) {
  if (!std::filesystem::exists(path))
    return Error{ErrorCode::kNotFound, path + ": no such file of grasp postures"};
  YAML::Node file;
  try {
    file = YAML::LoadFile(path);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, path + ": " + e.what()};
  }
  const YAML::Node shapes = file.IsMap() ? file["shapes"] : YAML::Node();
  if (!shapes || !shapes.IsMap() || shapes.size() == 0) {
    return refuse(path, file, "expected a map `shapes` with a posture a shape");
  }
  std::map<std::string, PalmPosture> postures;
  for (const auto& entry : shapes) {
    const auto shape = entry.first.as<std::string>();
    auto posture = read_grasp_posture(path, shape, entry.second);
    if (!posture) return posture.error();
    postures[shape] = *posture;
  }
  // round things come next to what has no posture of its own
  if (!postures.contains(""))
    postures[""] = postures.contains("ball") ? postures["ball"] : postures.begin()->second;
  return postures;
}

}  // namespace nido::reach
