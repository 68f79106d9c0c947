#pragma once

#include <mutex>
#include <optional>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/inertial.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"

namespace nido {

// A camera that sees a test card: red grows to the right, green downwards, and a white bar, as wide as a
// sixteenth of the picture, crosses it from left to right every two seconds of the clock. Fails on demand.
// Thread-safe.
class FakeCamera final : public ICamera {
 public:
  // `clock` must outlive the camera; the size must be above zero.
  FakeCamera(CameraInfo info, const IClock& clock) : info_(std::move(info)), clock_(clock) {}
  // Until set otherwise, grab() fails with this.
  void set_failure(std::optional<Error> failure);

  Status grab(Image& image) override;
  [[nodiscard]] Result<CameraInfo> info() const override { return info_; }

 private:
  CameraInfo info_;
  const IClock& clock_;
  std::mutex mutex_;
  std::optional<Error> failure_;
};

// Touch pads that feel what a test tells them to. Thread-safe.
class FakeTouch final : public ITouch {
 public:
  FakeTouch(int pads, const IClock& clock) : clock_(clock), force_N_(static_cast<std::size_t>(pads), 0.0) {}
  // Presses a pad with a force; 0 lets it go. The pad must exist.
  void press(int pad, double force_N);
  void set_failure(std::optional<Error> failure);

  [[nodiscard]] int pads() const override { return static_cast<int>(force_N_.size()); }
  [[nodiscard]] Result<TouchReading> read_touch() const override;

 private:
  const IClock& clock_;
  mutable std::mutex mutex_;
  std::vector<double> force_N_;
  std::optional<Error> failure_;
};

// An empty world: answers `world num KIND` with 0 and refuses the rest.
class FakeWorld final : public IWorld {
 public:
  std::string command(const std::string& line) override;
};

// A sensor on which nothing pulls.
class FakeForceTorque final : public IForceTorque {
 public:
  explicit FakeForceTorque(const IClock& clock) : clock_(clock) {}
  [[nodiscard]] Result<WrenchReading> read_wrench() const override;

 private:
  const IClock& clock_;
};

// A sensor at rest, upright.
class FakeInertial final : public IInertial {
 public:
  explicit FakeInertial(const IClock& clock) : clock_(clock) {}
  [[nodiscard]] Result<InertialReading> read_inertial() const override;

 private:
  const IClock& clock_;
};

}  // namespace nido
