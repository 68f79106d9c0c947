#pragma once

#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "nido/simulator/render/renderer.h"
#include "nido/simulator/simulation.h"
#include "nido/vision/vision_core.h"

namespace nido::test {

// A simulated robot, its cameras, and what vision needs from them. Ground truth stays on the test's side.
class Stage {
 public:
  // `world_yaml`: a world file as text. Fails the program with a sentence when something is missing.
  explicit Stage(const std::string& world_yaml, std::uint64_t seed = 1);

  sim::Simulation& simulation() { return *simulation_; }
  const RobotModel& model() const { return model_; }
  sim::Renderer& renderer() { return renderer_; }

  // Head joints that look at a point, at once.
  void look_at(const Eigen::Vector3d& p_Root_m);
  void place(const std::string& part, const std::vector<double>& position_deg);
  // Takes one picture per eye of the world as it stands now.
  void take(Image& left, Image& right);
  void render(sim::Eye eye, Image& picture);
  void render_depth(sim::Eye eye, sim::DepthImage& picture);
  const sim::SceneSnapshot& scene() const { return scene_; }
  [[nodiscard]] vision::EncoderSample encoders(const std::string& part) const;
  // Encoders and, when `pictures`, images of now.
  vision::VisionInputs inputs(bool pictures);
  // Centre of an object's box in the root frame, and its turn about z.
  struct Truth {
    Eigen::Vector3d p_Root_m;
    double yaw_rad;
  };
  [[nodiscard]] Truth truth(const std::string& object) const;

 private:
  std::unique_ptr<sim::Simulation> simulation_;
  RobotModel model_;
  sim::Renderer renderer_;
  sim::SceneSnapshot scene_;
};

// The text of a world with a table and the given objects: "{object: cube, ...}" lines.
std::string table_world(const std::vector<std::string>& objects);

// The value of a result; ends the program with the sentence when there is none.
template <class T>
T need(Result<T> result) {
  if (!result) {
    std::cerr << result.error().message << '\n';
    std::exit(3);
  }
  return std::move(result).value();
}

}  // namespace nido::test
