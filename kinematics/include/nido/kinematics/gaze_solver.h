#pragma once

#include <Eigen/Geometry>
#include <array>

#include "nido/kinematics/camera_geometry.h"
#include "nido/kinematics/robot_model.h"

namespace nido {

// Order of the head's joints as on its board: neck pitch, roll, yaw, eyes tilt, version, vergence.
using HeadAngles = Eigen::Matrix<double, 6, 1>;
using TorsoAngles = Eigen::Vector3d;  // yaw, roll, pitch

struct GazeSolution {
  HeadAngles head_rad = HeadAngles::Zero();
  double error_px = 0;         // of the point's image from the image centre, in the worse eye
  double middle_error_px = 0;  // of the middle of both eyes' images
};

// How far the head's joints may turn for a solution. Equal limits hold a joint.
struct HeadRange {
  HeadAngles lower_rad = HeadAngles::Zero();
  HeadAngles upper_rad = HeadAngles::Zero();
};

// Joints of neck and eyes with which both eyes see a point in the middle of their pictures. Immutable, so
// thread-safe. The model must outlive it.
class GazeSolver {
 public:
  // Fails if the model has no head, torso and two cameras as an iCub has.
  static Result<GazeSolver> create(const RobotModel& model, const PinholeCamera& camera);

  // The neck does most of the turning, the eyes the rest, all within the limits. The neck stays near the
  // start where there is a choice. Always gives the best that was found.
  [[nodiscard]] GazeSolution solve(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                                   const HeadAngles& start_rad) const {
    return solve(p_Root_m, torso_rad, start_rad, range_);
  }
  // The same within a range, which is that of the joints or lies inside it.
  [[nodiscard]] GazeSolution solve(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                                   const HeadAngles& start_rad, const HeadRange& range) const;
  // How far from the image centre a point is seen, in the worse eye, pixels; measured as angles, so that it
  // is finite behind the eyes too.
  [[nodiscard]] double error_px(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                                const HeadAngles& head_rad) const;
  // The point at which the eyes look: nearest to both optical axes. Far away when they are parallel.
  [[nodiscard]] Eigen::Vector3d p_RootFixation_m(const TorsoAngles& torso_rad,
                                                 const HeadAngles& head_rad) const;

  [[nodiscard]] const HeadRange& range() const { return range_; }  // the joints' own limits

 private:
  GazeSolver(const RobotModel& model, const PinholeCamera& camera) : model_(&model), camera_(camera) {}
  [[nodiscard]] Eigen::VectorXd axes(const TorsoAngles& torso_rad, const HeadAngles& head_rad) const;
  // Angles under which the eyes see the point, by the focal length: left x, y, right x, y.
  [[nodiscard]] Eigen::Vector4d seen_px(const Eigen::Vector3d& p_Root_m, const Eigen::VectorXd& axes) const;

  const RobotModel* model_;
  PinholeCamera camera_;
  int head_first_ = 0;
  int torso_first_ = 0;
  std::array<int, 2> cameras_{};
  HeadRange range_;
};

}  // namespace nido
