#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <string>

#include "nido/simulator/render/renderer.h"
#include "nido/simulator/simulation.h"

namespace nido::sim {
namespace {

// The covers of head and eyes are drawn for people; they must not stand in the robot's own view.
TEST(OwnFace, IsNotInViewWhereverTheEyesTurn) {
  SimulationOptions options;
  options.urdf_path = NIDO_SOURCE_DIR "/config/robots/icub.urdf";
  auto made = Simulation::create(options);
  ASSERT_TRUE(made.ok()) << made.error().message;
  Simulation& simulation = **made;
  Result<Renderer> renderer = Renderer::create({.samples = 1});
  ASSERT_TRUE(renderer.ok()) << renderer.error().message;
  const int head = simulation.part_index("head");
  SceneSnapshot scene;
  DepthImage depth;
  std::set<std::string> seen;
  constexpr double kDegree = std::numbers::pi / 180;
  for (const double tilt_deg : {-30.0, 0.0, 15.0}) {
    for (const double version_deg : {-30.0, 0.0, 30.0}) {
      // beyond 40 degrees of pan an eye would see the other eye's ball
      for (const double vergence_deg : {0.0, version_deg == 0.0 ? 40.0 : 12.0}) {
        const std::vector<double> position_rad = {
            -0.4, 0, 0, tilt_deg * kDegree, version_deg * kDegree, vergence_deg * kDegree};
        ASSERT_TRUE(simulation.place_joints(head, position_rad).ok());
        simulation.scene(scene);
        ASSERT_TRUE(renderer->setScene(scene).ok());
        for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
          Camera camera;
          camera.X_WorldCamera = simulation.X_WorldCamera(eye);
          ASSERT_TRUE(renderer->renderDepth(camera, depth).ok());
          for (const std::uint32_t id : depth.instance) {
            if (id != 0) seen.insert(scene.instances[id - 1].name);
          }
        }
      }
    }
  }
  EXPECT_FALSE(seen.empty()) << "at least some of the body shows";
  for (const std::string& name : seen) {
    EXPECT_EQ(name.find("head"), std::string::npos) << name;
    EXPECT_EQ(name.find("eye"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace nido::sim
