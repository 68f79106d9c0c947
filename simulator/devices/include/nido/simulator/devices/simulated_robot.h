#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/device.h"
#include "nido/simulator/devices/darkroom.h"
#include "nido/simulator/simulation.h"

namespace nido::sim {

// A lock that serves in the order of asking, so that a simulation at full speed does not keep clients
// waiting. Meets the standard's requirements on a mutex.
class FairMutex {
 public:
  void lock() {
    std::unique_lock guard(guard_);
    const std::uint64_t ticket = next_ticket_++;
    turn_.wait(guard, [&] { return ticket == now_serving_; });
  }
  void unlock() {
    {
      const std::lock_guard guard(guard_);
      ++now_serving_;
    }
    turn_.notify_all();
  }

 private:
  std::mutex guard_;
  std::condition_variable turn_;
  std::uint64_t next_ticket_ = 0;
  std::uint64_t now_serving_ = 0;
};

// Why a device of an eye or a hand cannot be made.
[[nodiscard]] inline Error no_such_eye(Eye eye) {
  return {ErrorCode::kNotFound, std::string("the robot's description has no camera \"") +
                                    (eye == Eye::kLeft ? "left" : "right") + "\" in its <nido> block"};
}
[[nodiscard]] inline Error no_such_hand(Hand hand) {
  return {ErrorCode::kNotFound, std::string("the robot's description has no hand \"") +
                                    (hand == Hand::kLeft ? "left" : "right") + "\" in its <nido> block"};
}

// One simulation and one darkroom, shared by the devices of a simulated robot, and the clock of that robot.
// Devices hold it by shared_ptr and lock it for every call, so that they may be used from any thread.
class SimulatedRobot final : public ISteppable, public IClock {
 public:
  // Fails as Simulation::create and Renderer::create do.
  static Result<std::shared_ptr<SimulatedRobot>> create(const SimulationOptions& simulation,
                                                        const RenderOptions& rendering);

  // Steps by whole control periods until the robot's time is at least now_ns. Time goes on from where it was
  // when the world is reset.
  Status step_to(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t now_ns() const override { return now_ns_.load(); }

  // Goes on from a snapshot (Simulation::snapshot()), as if it had been there: its time is the time now.
  Status restore(const std::string& snapshot, const std::string& source, std::int64_t now_ns);

  // Hold this lock while the references below are used.
  [[nodiscard]] FairMutex& mutex() const { return mutex_; }
  [[nodiscard]] Simulation& simulation() { return *simulation_; }
  [[nodiscard]] const Simulation& simulation() const { return *simulation_; }
  // How the owner of the clock is asked, by a line, for a line; may wait for steps of the simulation, so call
  // it without the lock. Null: nobody owns one.
  using ClockCommand = std::function<std::string(const std::string&)>;
  void set_clock(ClockCommand clock);
  [[nodiscard]] const ClockCommand& clock() const { return clock_; }
  // A number for a camera of an eye: of its film, see Simulation::film().
  [[nodiscard]] std::size_t add_film() { return films_++; }
  // Begins a picture of the scene as it is now, to be stamped with the present time. See Darkroom::draw.
  std::future<Result<Image>> begin_picture(const Camera& camera, Image storage, Darkroom::Finish finish);
  // Begins to measure depth and instances of the scene as it is now.
  std::future<Result<DepthImage>> begin_depth(const Camera& camera);
  // The scene as it is now.
  std::shared_ptr<const SceneSnapshot> scene();
  // Tells that the scene changed other than by a step: the world port made or moved something.
  void scene_changed() { scene_.reset(); }

 private:
  SimulatedRobot(std::unique_ptr<Simulation> simulation, Renderer renderer);

  mutable FairMutex mutex_;
  ClockCommand clock_;
  std::atomic<std::size_t> films_{0};
  std::unique_ptr<Simulation> simulation_;
  std::shared_ptr<const SceneSnapshot> scene_;  // of this moment, if somebody asked for a picture
  Darkroom darkroom_;
  std::atomic<std::int64_t> now_ns_{0};
};

}  // namespace nido::sim
