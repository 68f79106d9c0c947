// What mouse and keys mean; no display, no simulation.
#include "nido/simulator/window/view_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace nido::sim {
namespace {

using Kind = InputEvent::Kind;
using Button = InputEvent::Button;

InputEvent mouse(Kind kind, double x_px, double y_px, Button button = Button::kLeft) {
  InputEvent event;
  event.kind = kind;
  event.button = button;
  event.x_px = x_px;
  event.y_px = y_px;
  return event;
}

InputEvent wheel(double notches) {
  InputEvent event = mouse(Kind::kScroll, 300, 200);
  event.scroll = notches;
  return event;
}

InputEvent key(char letter) {
  InputEvent event;
  event.kind = Kind::kKey;
  event.key = letter;
  return event;
}

std::optional<ViewController::Pick> nothing(double, double) { return std::nullopt; }

Eigen::Vector2d pixel_of(const Camera& camera, const Eigen::Vector3d& p_World_m) {
  const Eigen::Vector3d p = camera.X_WorldCamera.inverse() * p_World_m;
  return {camera.fx_px * p.x() / p.z() + camera.cx_px, camera.fy_px * p.y() / p.z() + camera.cy_px};
}

// Where the middle of the picture and of another camera's picture meet: what both go round.
Eigen::Vector3d nearest_to_both_axes(const Camera& a, const Camera& b) {
  const Eigen::Vector3d pa = a.X_WorldCamera.translation();
  const Eigen::Vector3d pb = b.X_WorldCamera.translation();
  const Eigen::Vector3d da = a.X_WorldCamera.linear().col(2);
  const Eigen::Vector3d db = b.X_WorldCamera.linear().col(2);
  Eigen::Matrix2d A;
  A << da.dot(da), -da.dot(db), da.dot(db), -db.dot(db);
  const Eigen::Vector2d s = A.inverse() * Eigen::Vector2d(da.dot(pb - pa), db.dot(pb - pa));
  return (pa + s.x() * da + pb + s.y() * db) / 2;
}

TEST(ViewController, GoesRoundWhatItLooksAt) {
  ViewController view(600, 400);
  const Camera before = view.camera();
  view.handle(mouse(Kind::kPress, 300, 200), nothing);
  view.handle(mouse(Kind::kMove, 380, 230), nothing);
  const Camera after = view.camera();
  EXPECT_GT((before.X_WorldCamera.translation() - after.X_WorldCamera.translation()).norm(), 0.1);
  const Eigen::Vector3d middle = nearest_to_both_axes(before, after);
  EXPECT_NEAR((pixel_of(before, middle) - Eigen::Vector2d(300, 200)).norm(), 0, 1e-6);
  EXPECT_NEAR((pixel_of(after, middle) - Eigen::Vector2d(300, 200)).norm(), 0, 1e-6);
  EXPECT_NEAR((before.X_WorldCamera.translation() - middle).norm(),
              (after.X_WorldCamera.translation() - middle).norm(), 1e-9);
  view.handle(mouse(Kind::kRelease, 380, 230), nothing);
  view.handle(mouse(Kind::kMove, 100, 100), nothing);
  EXPECT_TRUE(view.camera().X_WorldCamera.isApprox(after.X_WorldCamera)) << "the button is up";
  view.handle(key('v'), nothing);
  EXPECT_TRUE(view.camera().X_WorldCamera.isApprox(before.X_WorldCamera)) << "back at the start";
}

TEST(ViewController, ShiftsSoThatThingsStayUnderTheMouse) {
  ViewController view(600, 400);
  const Camera before = view.camera();
  const double distance_m = (before.X_WorldCamera.translation() - Eigen::Vector3d(-0.2, 0.05, 0)).norm();
  const Eigen::Vector3d point =
      before.X_WorldCamera * Eigen::Vector3d((250 - before.cx_px) / before.fx_px * distance_m,
                                             (180 - before.cy_px) / before.fy_px * distance_m, distance_m);
  view.handle(mouse(Kind::kPress, 250, 180, Button::kRight), nothing);
  view.handle(mouse(Kind::kMove, 290, 130), nothing);
  const Camera after = view.camera();
  EXPECT_NEAR((pixel_of(after, point) - Eigen::Vector2d(290, 130)).norm(), 0, 1e-6);
  EXPECT_TRUE(after.X_WorldCamera.linear().isApprox(before.X_WorldCamera.linear())) << "does not turn";
}

TEST(ViewController, TheWheelBringsNearer) {
  ViewController view(600, 400);
  const Eigen::Vector3d before = view.camera().X_WorldCamera.translation();
  const Eigen::Vector3d ahead = view.camera().X_WorldCamera.linear().col(2);
  view.handle(wheel(2), nothing);
  const Eigen::Vector3d step = view.camera().X_WorldCamera.translation() - before;
  EXPECT_GT(step.norm(), 0.1);
  EXPECT_NEAR(step.normalized().dot(ahead), 1, 1e-9);
  view.handle(wheel(-2), nothing);
  EXPECT_LT((view.camera().X_WorldCamera.translation() - before).norm(), 1e-9);
}

TEST(ViewController, ACameraIsAlwaysOne) {
  ViewController view(600, 400);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double far : {1e5, -1e5, 1e300, nan}) {
    for (const Button button : {Button::kLeft, Button::kRight}) {
      view.handle(mouse(Kind::kPress, 0, 0, button), nothing);
      view.handle(mouse(Kind::kMove, far, far), nothing);
      view.handle(mouse(Kind::kMove, -far, 3), nothing);
      view.handle(mouse(Kind::kRelease, 0, 0, button), nothing);
    }
    view.handle(wheel(far), nothing);
    view.resize(far > 0 ? 100000 : 0, -3);
    const Status sane = view.camera().check();
    EXPECT_TRUE(sane.ok()) << sane.error().message;
  }
}

TEST(ViewController, AThingIsPulledByThePointThatWasTaken) {
  ViewController view(600, 400);
  const Camera camera = view.camera();
  const Eigen::Vector3d taken = camera.X_WorldCamera * Eigen::Vector3d(0.05, 0.02, 1.1);
  Eigen::Isometry3d X_WorldCube = Eigen::Isometry3d::Identity();
  X_WorldCube.translation() = taken - Eigen::Vector3d(0.01, 0, 0.01);
  X_WorldCube.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector2d at = pixel_of(camera, taken);
  int asked = 0;
  const auto pick = [&](double x_px, double y_px) -> std::optional<ViewController::Pick> {
    ++asked;
    EXPECT_DOUBLE_EQ(x_px, at.x());
    EXPECT_DOUBLE_EQ(y_px, at.y());
    return ViewController::Pick{"cube", taken, X_WorldCube};
  };
  view.handle(mouse(Kind::kPress, at.x(), at.y()), pick);
  ASSERT_TRUE(view.grab());
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(view.grab()->object, "cube");
  EXPECT_LT((X_WorldCube * view.grab()->p_Object_m - taken).norm(), 1e-12);
  EXPECT_LT((view.p_WorldMouse_m() - taken).norm(), 1e-9);
  // a hundred pixels to the right, as far from the camera as before; the camera stays
  view.handle(mouse(Kind::kMove, at.x() + 100, at.y()), pick);
  const Eigen::Vector3d shift = view.p_WorldMouse_m() - taken;
  EXPECT_LT((shift - camera.X_WorldCamera.linear().col(0) * (100 / camera.fx_px * 1.1)).norm(), 1e-9);
  EXPECT_TRUE(view.camera().X_WorldCamera.isApprox(camera.X_WorldCamera));
  // another button changes nothing
  view.handle(mouse(Kind::kPress, 5, 5, Button::kRight), pick);
  view.handle(mouse(Kind::kRelease, 5, 5, Button::kRight), pick);
  EXPECT_TRUE(view.grab());
  view.handle(mouse(Kind::kRelease, 5, 5), pick);
  EXPECT_FALSE(view.grab());
  EXPECT_EQ(asked, 1);
}

TEST(ViewController, KeysSwitchAndAsk) {
  ViewController view(600, 400);
  EXPECT_FALSE(view.shows_contacts() || view.shows_joints() || view.shows_help());
  for (const char letter : {'c', 'j', 'h', 'x', ' ', '.', 'q'}) view.handle(key(letter), nothing);
  EXPECT_TRUE(view.shows_contacts() && view.shows_joints() && view.shows_help());
  using Action = ViewController::Action;
  EXPECT_EQ(view.take_actions(), (std::vector<Action>{Action::kPauseOrGo, Action::kStep, Action::kClose}));
  EXPECT_TRUE(view.take_actions().empty());
  for (const char letter : {'c', 'j', 'h'}) view.handle(key(letter), nothing);
  EXPECT_FALSE(view.shows_contacts() || view.shows_joints() || view.shows_help());
}

TEST(SpringForce, PullsTowardsTheMouseWithinItsBounds) {
  const Eigen::Vector3d here(0.1, 0.2, 0.3);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  EXPECT_EQ(spring_force_N(0.5, here, zero, here).norm(), 0);
  const Eigen::Vector3d little = spring_force_N(0.5, here, zero, here + Eigen::Vector3d(0.01, 0, 0));
  EXPECT_GT(little.x(), 0);
  EXPECT_EQ(little.y(), 0);
  // what flies is slowed down
  EXPECT_LT(spring_force_N(0.5, here, Eigen::Vector3d(1, 0, 0), here).x(), 0);
  // far away: five weights; of a heavy thing: what the world port takes
  EXPECT_NEAR(spring_force_N(0.5, here, zero, here + Eigen::Vector3d(0, 9, 9)).norm(), 5 * 0.5 * 9.81, 1e-9);
  EXPECT_NEAR(spring_force_N(500, here, zero, here + Eigen::Vector3d(0, 9, 9)).norm(), 900, 1e-9);
}

}  // namespace
}  // namespace nido::sim
