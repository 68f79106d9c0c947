#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nido/simulator/render/camera.h"
#include "nido/simulator/window/screen.h"

namespace nido::sim {

// What mouse and keys mean: a camera that goes round a point, a thing that is pulled, what is shown, and what
// is asked of the clock. Knows no display, no simulation.
//
//     left button on a thing that moves   pulls it with a spring, until the button is let go
//     left button elsewhere               goes round
//     right or middle button              shifts
//     wheel                               nearer, farther
class ViewController {
 public:
  // What lies under a pixel and can be pulled.
  struct Pick {
    std::string object;
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();  // the point that is seen
    Eigen::Isometry3d X_WorldObject = Eigen::Isometry3d::Identity();
  };
  using Picker = std::function<std::optional<Pick>(double x_px, double y_px)>;

  // A spring between a point of an object and the mouse, which stays as far from the camera as the point was.
  struct Grab {
    std::string object;
    Eigen::Vector3d p_Object_m = Eigen::Vector3d::Zero();
    double depth_m = 0;  // along the optical axis
    double x_px = 0;     // the mouse
    double y_px = 0;
  };

  enum class Action { kPauseOrGo, kStep, kClose };

  ViewController(int width, int height);

  // The picture's size, pixels.
  void resize(int width, int height);
  void handle(const InputEvent& event, const Picker& pick);
  // The camera for the next picture.
  [[nodiscard]] Camera camera() const;
  [[nodiscard]] const std::optional<Grab>& grab() const { return grab_; }
  // Where the spring's other end is.
  [[nodiscard]] Eigen::Vector3d p_WorldMouse_m() const;
  // The object is gone.
  void let_go() { grab_.reset(); }
  [[nodiscard]] bool shows_contacts() const { return contacts_; }
  [[nodiscard]] bool shows_joints() const { return joints_; }
  [[nodiscard]] bool shows_help() const { return help_; }
  // What keys asked for since the last call.
  [[nodiscard]] std::vector<Action> take_actions();

 private:
  void look_from_the_start();
  void key(char key);
  void drag(double dx_px, double dy_px);

  int width_;
  int height_;
  Eigen::Vector3d p_WorldTarget_m_;
  double distance_m_ = 1;
  double yaw_rad_ = 0;    // of the camera seen from the target, about z
  double pitch_rad_ = 0;  // above the target
  enum class Drag { kNone, kRound, kShift };
  Drag drag_ = Drag::kNone;
  double x_px_ = 0;  // the mouse
  double y_px_ = 0;
  std::optional<Grab> grab_;
  bool contacts_ = false;
  bool joints_ = false;
  bool help_ = false;
  std::vector<Action> actions_;
};

// Force of the spring on a body, N: towards the mouse, damped, at most five times its weight and 900 N.
[[nodiscard]] Eigen::Vector3d spring_force_N(double mass_kg, const Eigen::Vector3d& p_World_m,
                                             const Eigen::Vector3d& v_World_m_s,
                                             const Eigen::Vector3d& p_WorldMouse_m);

}  // namespace nido::sim
