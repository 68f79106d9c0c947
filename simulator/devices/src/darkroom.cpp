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
  for (Job& job : jobs_) job.done.set_value(Error{ErrorCode::kInterrupted, "the simulation ends"});
}

std::future<Result<Image>> Darkroom::draw(std::shared_ptr<const SceneSnapshot> scene, const Camera& camera,
                                          Image storage, Finish finish) {
  Job job{std::move(scene), camera, std::move(storage), std::move(finish), {}};
  std::future<Result<Image>> picture = job.done.get_future();
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
  return picture;
}

void Darkroom::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (ending_) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job.done.set_value(draw_now(job));
    lock.lock();
  }
}

Result<Image> Darkroom::draw_now(Job& job) {
  if (job.scene != drawn_) {
    if (Status set = renderer_.setScene(*job.scene); !set) return set.error();
    if (!drawn_ || !(drawn_->light == job.scene->light)) {
      if (Status set = renderer_.setLighting(job.scene->light); !set) return set.error();
    }
    drawn_ = job.scene;
  }
  if (Status drawn = renderer_.render(job.camera, job.picture); !drawn) return drawn.error();
  if (job.finish) job.finish(job.picture);
  return std::move(job.picture);
}

}  // namespace nido::sim
