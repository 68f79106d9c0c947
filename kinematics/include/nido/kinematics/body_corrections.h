#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/kinematics/robot_model.h"

namespace nido {

// How a link really sits on its parent, beside where the drawing puts it; in the drawn link's frame, whose z
// is the axis of its joint.
struct LinkCorrection {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();       // moved by, m
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  // turned by: axis times angle, rad

  [[nodiscard]] Eigen::Isometry3d X_DrawnReal() const;
};

// Where a body is not built as its URDF says: encoders whose zero is off (a turn about z of a link
// that turns), eyes that sit askew, limbs that are longer. Found by self-calibration
// (docs/calibration.md), or made up to have a body that is not as drawn. A value.
struct BodyCorrections {
  std::map<std::string, LinkCorrection> links;  // by name; those not named are as drawn

  // YAML: `links: {r_palm: {p_m: [x, y, z], turn_rad: [x, y, z]}, ...}`. kNotFound, or kInvalidArgument
  // with file, line, what was found and what is allowed: corrections are at most 0.1 m and 0.6 rad.
  static Result<BodyCorrections> load(const std::filesystem::path& path);
  // `about` becomes the comment at the file's head. The file appears whole or not at all. kFailed with the
  // path.
  [[nodiscard]] Status save(const std::filesystem::path& path, const std::string& about) const;
};

// The URDF of the body as it really is. kInvalidArgument with `source` when it is not XML or lacks a link
// that is corrected.
Result<std::string> corrected_urdf(const std::string& urdf_text, const std::string& source,
                                   const BodyCorrections& corrections);

// The robot model of a URDF file, corrected. Failures as of RobotModel::load and the above.
Result<RobotModel> load_corrected_model(const std::filesystem::path& urdf_path,
                                        const BodyCorrections& corrections);
// The same with corrections from a calibration file; an empty `corrections_path`: as drawn.
Result<RobotModel> load_corrected_model(const std::filesystem::path& urdf_path,
                                        const std::filesystem::path& corrections_path);

}  // namespace nido
