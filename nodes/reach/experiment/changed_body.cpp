#include "changed_body.h"

#include "nido/kinematics/body_corrections.h"
#include "nido/launcher/paths.h"
#include "wrong_body.h"

namespace nido::reach {

Result<std::string> write_changed_robot(const std::string& change, const std::string& side,
                                        const std::filesystem::path& folder) {
  constexpr double kLonger_m = 0.02;
  constexpr double kTilt_rad = 6.0 * static_cast<double>(EIGEN_PI) / 180.0;
  const auto places = find_places();
  if (!places) return places.error();
  const std::filesystem::path robots = places->config / "robots";
  BodyCorrections body;
  if (change == "eyes") {
    body.links["eyes"].turn_rad.z() = kTilt_rad;
  } else {
    const auto drawn = RobotModel::load(robots / "icub.urdf");
    if (!drawn) return drawn.error();
    const std::string limb = side.substr(0, 1) + "_";
    const auto elbow = drawn->link_index(limb + "elbow_1");
    const auto wrist = drawn->link_index(limb + "wrist_1");
    if (!elbow) return elbow.error();
    if (!wrist) return wrist.error();
    const Eigen::VectorXd rest = drawn->zero_axes();
    const Eigen::Isometry3d X_RootWrist = drawn->X_RootLink(*wrist, rest);
    const Eigen::Vector3d along_Root =
        (X_RootWrist.translation() - drawn->X_RootLink(*elbow, rest).translation()).normalized();
    body.links[limb + "wrist_1"].p_m = kLonger_m * (X_RootWrist.linear().transpose() * along_Root);
  }
  if (Status written = calibration::write_robot(robots, body, folder); !written) return written.error();
  return (folder / "icub_sim_babbling.yaml").string();
}

}  // namespace nido::reach
