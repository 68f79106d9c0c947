#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/control_board.h"
#include "nido/kinematics/robot_model.h"

namespace nido {

// Where links of the body may not be driven: one rule of a robot file. Root frame, m.
struct WorkspaceRule {
  enum class Kind {
    kInside,   // they stay in the box
    kOutside,  // they stay out of it
    kPlane,    // they stay on the side of the plane that its normal points to
  };
  std::string name;                // of sentences: "table"
  std::vector<std::string> links;  // of the model: "l_hand"
  double radius_m = 0;             // of the sphere around the link's origin that has to obey
  Kind kind = Kind::kOutside;
  Eigen::AlignedBox3d box_Root_m;                           // of inside, outside; faces may be infinitely far
  Eigen::Vector3d p_RootPlane_m = Eigen::Vector3d::Zero();  // of plane
  Eigen::Vector3d normal_Root = Eigen::Vector3d::UnitZ();   // of plane, a unit vector
};

// The workspace of a robot: knows where all its joints are and where they go, board by board, and says by
// forward kinematics what may still be commanded. Links that are beyond a border already may come back and
// not go deeper. Thread-safe.
class Workspace {
 public:
  // kInvalidArgument names the rule that is none; kNotFound a link that the body does not have.
  static Result<std::shared_ptr<Workspace>> create(RobotModel model, std::vector<WorkspaceRule> rules);

  // A board's joints as the body's axes; joints that the body does not have are -1 and go free.
  [[nodiscard]] std::vector<int> axes_of(const IControlBoard& board) const;

  // Notes where a board's joints are, and where those go that are on their way to a target.
  void note(std::span<const int> axes, std::span<const double> position_rad,
            std::span<const std::optional<double>> target_rad);

  // kFailed, in a sentence that names rule, link and depth, when joints at these targets, and all others
  // where they are or go, would bring a link beyond a border.
  [[nodiscard]] Status check_targets(std::span<const int> axes, std::span<const double> target_rad) const;

  // Shortens the steps that joints of a board are about to make from `from_rad` within dt_s, so that links
  // come to rest before a border. The name of the rule that did so; nothing when none had to.
  std::optional<std::string> brake(std::span<const int> axes, std::span<const double> from_rad,
                                   std::span<double> step_rad, double dt_s) const;

  // What joints with these speeds have to be stopped at once, because nothing else would keep a link from
  // going beyond a border: indices into `axes`. The rule's name goes to `rule`.
  [[nodiscard]] std::vector<int> to_stop(std::span<const int> axes, std::span<const double> position_rad,
                                         std::span<const double> velocity_rad_s, std::string& rule) const;

  // Joints that carry a link which is so near to a border that no force may be put on them: indices into
  // `axes`. The rule's name goes to `rule`.
  [[nodiscard]] std::vector<int> near_a_border(std::span<const int> axes, std::string& rule) const;

 private:
  struct Guard {
    std::size_t rule = 0;
    int link = -1;
    std::vector<bool> moved_by;  // (axes of the body)
  };
  Workspace(RobotModel model, std::vector<WorkspaceRule> rules);
  // From the border, positive on the allowed side.
  [[nodiscard]] double distance_m(const Guard& guard, const Eigen::VectorXd& axes_rad) const;
  [[nodiscard]] static bool is_moved(const Guard& guard, int axis);
  [[nodiscard]] static bool is_moved(const Guard& guard, std::span<const int> axes);

  const RobotModel model_;
  const std::vector<WorkspaceRule> rules_;
  std::vector<Guard> guards_;
  mutable std::mutex mutex_;
  Eigen::VectorXd now_rad_;   // all axes
  Eigen::VectorXd goal_rad_;  // all axes: where they go, or are
};

}  // namespace nido
