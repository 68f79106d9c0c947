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

 private:
  struct Job {
    std::shared_ptr<const SceneSnapshot> scene;
    Camera camera;
    Image picture;
    Finish finish;
    std::promise<Result<Image>> done;
  };
  void work();
  Result<Image> draw_now(Job& job);

  Renderer renderer_;                           // of the thread alone
  std::shared_ptr<const SceneSnapshot> drawn_;  // what the renderer has; of the thread alone
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool ending_ = false;
  std::thread thread_;  // last: starts when the rest is there
};

}  // namespace nido::sim
