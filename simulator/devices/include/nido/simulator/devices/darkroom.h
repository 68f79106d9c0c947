#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"
#include "nido/simulator/render/depth_image.h"
#include "nido/simulator/render/renderer.h"

namespace nido::sim {

// Draws pictures on a thread of its own, in the order of asking, while the simulation goes on. Thread-safe.
class Darkroom {
 public:
  explicit Darkroom(Renderer renderer);
  // Finishes the picture that is being drawn; others are given up, as failures.
  ~Darkroom();
  Darkroom(const Darkroom&) = delete;
  Darkroom& operator=(const Darkroom&) = delete;

  // Asks for a picture of a scene. Pictures of one scene in a row share their shadows. `storage` is reused
  // for the pixels; its stamp is kept. `finish`, if any, is called with the drawn picture on the drawing
  // thread.
  using Finish = std::function<void(Image&)>;
  std::future<Result<Image>> draw(std::shared_ptr<const SceneSnapshot> scene, const Camera& camera,
                                  Image storage, Finish finish = {});
  // Asks for the depth and the instances of a scene.
  std::future<Result<DepthImage>> measure(std::shared_ptr<const SceneSnapshot> scene, const Camera& camera);

 private:
  // What is to be done with a scene; told when it cannot be: because the darkroom ends or the scene is bad.
  struct Job {
    std::shared_ptr<const SceneSnapshot> scene;
    std::function<void(const Status& ready)> work;
  };
  void add(Job job);
  void work();
  Status show(const std::shared_ptr<const SceneSnapshot>& scene);

  Renderer renderer_;                           // of the thread alone
  std::shared_ptr<const SceneSnapshot> drawn_;  // what the renderer has; of the thread alone
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool ending_ = false;
  std::thread thread_;  // last: starts when the rest is there
};

}  // namespace nido::sim
