#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A revolute joint of the body: what really turns. Its axis is z of the child link's frame, which is the
// parent's frame moved by X_ParentChild0 and then turned by the angle.
struct Hinge {
  std::string name;      // "r_index_distal_1"
  int child_link = -1;   // index into links()
  double lower_rad = 0;  // position limits
  double upper_rad = 0;
  double velocity_rad_s = 0;  // limit
  double effort_Nm = 0;       // limit
};

// One link or frame of the body. Links come after their parents.
struct BodyLink {
  std::string name;
  int parent = -1;  // index; -1: the root
  int hinge = -1;   // index into hinges() of the hinge that moves it; -1: fixed to its parent
  Eigen::Isometry3d X_ParentChild0 = Eigen::Isometry3d::Identity();  // at angle zero
  double mass_kg = 0;                                                // 0 for pure frames
  Eigen::Vector3d p_LinkCom_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_Link_kgm2 =
      Eigen::Matrix3d::Zero();  // about the centre of mass, along the link's axes
};

// How much an axis turns a hinge. The hinge's angle is the sum of multiplier * axis + offset over its axes.
struct HingeShare {
  int hinge = -1;  // index into hinges()
  double multiplier = 1;
  double offset_rad = 0;
};

// One joint as a control board knows it: 53 of them move 73 hinges.
struct Axis {
  std::string name;      // "r_elbow"
  double lower_rad = 0;  // position limits
  double upper_rad = 0;
  double velocity_rad_s = 0;         // limit
  double effort_Nm = 0;              // limit
  double reference_speed_rad_s = 0;  // of position mode, at start
  double home_rad = 0;               // the old simulator's start pose
  std::vector<HingeShare> hinges;    // at least one
};

struct Part {
  std::string name;        // "head"
  std::vector<Axis> axes;  // in the iCub's order
  int first_axis = 0;      // index of axes[0] in a vector of all axes
};

// Order of the touch pads of a hand everywhere: thumb, index, middle, ring, little finger tip, palm.
inline constexpr std::array<const char*, 6> kPadNames = {"thumb", "index",  "middle",
                                                         "ring",  "little", "palm"};

struct TouchPad {
  std::string name;    // one of kPadNames
  int body_link = -1;  // whose contacts count
  int tip_link = -1;   // frame at the finger's tip; for the palm the palm frame
};
struct HandMark {
  std::string name;    // "knuckle", "wrist"
  std::string colour;  // "magenta", "cyan"
  int link = -1;       // frame: origin in the disc's middle, z out of the back of the hand
  double radius_m = 0;
};
struct HandInfo {
  std::string side;            // "left", "right"
  int frame = -1;              // palm frame, index into links()
  std::vector<TouchPad> pads;  // in the order of kPadNames
  std::vector<HandMark> marks;
};
struct ForceTorqueInfo {
  std::string limb;  // "left_arm", ...
  int hinge = -1;    // the sensor sits in this hinge and feels what lies beyond
};

// The body, as written in a URDF with a <nido> block (docs/body.md): links, hinges, the axes of the control
// boards and what they move, masses, and where the sensors sit. Immutable after loading, so all functions are
// thread-safe.
//
// "axes" always means a vector of all axes in rad, part after part in the order of parts(), 53 for the iCub.
// Frame "Root" is the URDF's root link: x backward, y to the robot's right, z up. Functions that take indices
// or vectors treat a wrong index or size as a bug and end the process with a sentence.
class RobotModel {
 public:
  // Reads a file. kNotFound if it is not there, kInvalidArgument with file, place and what was expected if it
  // is not XML, not a URDF, has no <nido> block, or names links, joints or axes that do not exist.
  static Result<RobotModel> load(const std::filesystem::path& urdf_path);
  // The same from text; `source` names it in failures.
  static Result<RobotModel> parse(const std::string& urdf_text, const std::string& source);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<BodyLink>& links() const { return links_; }
  [[nodiscard]] const std::vector<Hinge>& hinges() const { return hinges_; }
  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  [[nodiscard]] int axis_count() const { return static_cast<int>(axis_refs_.size()); }
  [[nodiscard]] const Axis& axis(int index) const;

  // Look-ups by name. Fail with kNotFound and a sentence that lists names nearby.
  [[nodiscard]] Result<int> link_index(std::string_view link) const;
  [[nodiscard]] Result<int> hinge_index(std::string_view hinge) const;
  [[nodiscard]] Result<int> part_index(std::string_view part) const;
  // Index into a vector of all axes.
  [[nodiscard]] Result<int> axis_index(std::string_view axis) const;

  [[nodiscard]] const std::vector<HandInfo>& hands() const { return hands_; }  // left, right
  [[nodiscard]] Result<HandInfo> hand(std::string_view side) const;
  // Optical frame of an eye ("left", "right"): z forward, x right and y down in the image.
  [[nodiscard]] Result<int> camera_link(std::string_view side) const;
  [[nodiscard]] int inertial_link() const { return inertial_link_; }
  [[nodiscard]] const std::vector<ForceTorqueInfo>& force_torque_sensors() const { return force_torque_; }
  // Colliding cylinders whose name ends so are capsules: half spheres come on top of the cylinder's length.
  [[nodiscard]] const std::string& capsule_suffix() const { return capsule_suffix_; }

  // Vectors of all axes.
  [[nodiscard]] Eigen::VectorXd zero_axes() const { return Eigen::VectorXd::Zero(axis_count()); }
  [[nodiscard]] Eigen::VectorXd home_axes() const;
  [[nodiscard]] Eigen::VectorXd clamped(const Eigen::VectorXd& axes_rad) const;
  // All axes from one vector a part (rad); parts that are not named stay at 0. Fails on unknown parts, wrong
  // sizes, NaN.
  [[nodiscard]] Result<Eigen::VectorXd> axes_from_parts(
      const std::map<std::string, std::vector<double>>& parts_rad) const;
  // All axes from names (rad); axes that are not named stay at 0. Fails on unknown names and NaN.
  [[nodiscard]] Result<Eigen::VectorXd> axes_from_names(const std::map<std::string, double>& axes_rad) const;

  // Angle of every hinge, in the order of hinges().
  [[nodiscard]] Eigen::VectorXd hinge_angles(const Eigen::VectorXd& axes_rad) const;
  // The axes that fit hinge angles best (least squares over each coupled group): what encoders of the axes
  // would say.
  [[nodiscard]] Eigen::VectorXd axes_from_hinges(const Eigen::VectorXd& hinges_rad) const;

  // Pose of one link. Costs its chain only.
  [[nodiscard]] Eigen::Isometry3d X_RootLink(int link, const Eigen::VectorXd& axes_rad) const;
  // Poses of all links, in the order of links(), from the angles of all hinges.
  [[nodiscard]] std::vector<Eigen::Isometry3d> X_RootLinks(const Eigen::VectorXd& hinges_rad) const;
  // Velocity of a point fixed to `link` (p_LinkPoint_m in its frame) and turn rate of the link, in the root
  // frame, for each of the given axes: rows 0-2 m/rad, rows 3-5 rad/rad; column i belongs to
  // axes_of_interest[i].
  [[nodiscard]] Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(
      int link, const Eigen::VectorXd& axes_rad, const std::vector<int>& axes_of_interest,
      const Eigen::Vector3d& p_LinkPoint_m = Eigen::Vector3d::Zero()) const;

  [[nodiscard]] double mass_kg() const;
  [[nodiscard]] Eigen::Vector3d p_RootCom_m(const Eigen::VectorXd& axes_rad) const;

 private:
  RobotModel() = default;
  struct Loader;

  // Share of one axis in one hinge, seen from the hinge.
  struct AxisShare {
    int axis = -1;
    double multiplier = 1;
  };

  [[nodiscard]] double hinge_angle(int hinge, const Eigen::VectorXd& axes_rad) const;

  std::string name_;
  std::vector<BodyLink> links_;
  std::vector<Hinge> hinges_;
  std::vector<Part> parts_;
  std::vector<std::pair<int, int>> axis_refs_;        // axis -> part, number in the part
  std::vector<std::vector<AxisShare>> hinge_shares_;  // hinge -> its axes
  std::vector<double> hinge_offsets_rad_;
  Eigen::MatrixXd axes_from_hinges_;  // pseudo-inverse of the coupling
  std::vector<HandInfo> hands_;
  std::map<std::string, int, std::less<>> camera_links_;
  int inertial_link_ = -1;
  std::vector<ForceTorqueInfo> force_torque_;
  std::string capsule_suffix_;
};

}  // namespace nido
