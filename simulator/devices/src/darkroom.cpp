#include "nido/simulator/devices/darkroom.h"

#include <utility>

namespace nido::sim {

Darkroom::Darkroom(Renderer renderer) : renderer_(std::move(renderer)), thread_([this] { work(); }) {}

Darkroom::~Darkroom() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
  for (Job& job : jobs_) job.work(Error{ErrorCode::kInterrupted, "the simulation ends"});
}

void Darkroom::add(Job job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

std::future<Result<Image>> Darkroom::draw(std::shared_ptr<const SceneSnapshot> scene, const Camera& camera,
                                          Image storage, Finish finish) {
  // functions are copyable, promises and pictures are shared
  auto done = std::make_shared<std::promise<Result<Image>>>();
  auto picture = std::make_shared<Image>(std::move(storage));
  std::future<Result<Image>> drawn = done->get_future();
  add({std::move(scene), [this, camera, done, picture, finish = std::move(finish)](const Status& ready) {
         Status status = ready;
         if (status) status = renderer_.render(camera, *picture);
         if (!status) return done->set_value(status.error());
         if (finish) finish(*picture);
         done->set_value(std::move(*picture));
       }});
  return drawn;
}

std::future<Result<DepthImage>> Darkroom::measure(std::shared_ptr<const SceneSnapshot> scene,
                                                  const Camera& camera) {
  auto done = std::make_shared<std::promise<Result<DepthImage>>>();
  std::future<Result<DepthImage>> measured = done->get_future();
  add({std::move(scene), [this, camera, done](const Status& ready) {
         DepthImage depth;
         Status status = ready;
         if (status) status = renderer_.renderDepth(camera, depth);
         if (!status) return done->set_value(status.error());
         done->set_value(std::move(depth));
       }});
  return measured;
}

void Darkroom::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (ending_) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job.work(show(job.scene));
    lock.lock();
  }
}

Status Darkroom::show(const std::shared_ptr<const SceneSnapshot>& scene) {
  if (scene == drawn_) return {};
  if (Status set = renderer_.setScene(*scene); !set) return set;
  if (!drawn_ || !(drawn_->light == scene->light)) {
    if (Status set = renderer_.setLighting(scene->light); !set) return set;
  }
  drawn_ = scene;
  return {};
}

}  // namespace nido::sim
