#include "fake/fake_sensors.h"

#include <sstream>
#include <string>

namespace nido {
namespace {

constexpr std::int64_t kBarPeriod_ns = 2'000'000'000;
constexpr double kGravity_m_s2 = 9.81;

}  // namespace

void FakeCamera::set_failure(std::optional<Error> failure) {
  const std::lock_guard lock(mutex_);
  failure_ = std::move(failure);
}

Status FakeCamera::grab(Image& image) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_) return *failure_;
  }
  const std::int64_t now_ns = clock_.now_ns();
  image.stamp_ns = now_ns;
  image.width = info_.width;
  image.height = info_.height;
  image.rgb.resize(static_cast<std::size_t>(info_.width) * static_cast<std::size_t>(info_.height) * 3);
  const std::int64_t bar_start = (now_ns % kBarPeriod_ns) * info_.width / kBarPeriod_ns;
  const std::int64_t bar_end = bar_start + std::max(1, info_.width / 16);
  std::size_t next = 0;
  for (int row = 0; row < info_.height; ++row) {
    for (int column = 0; column < info_.width; ++column) {
      const bool in_bar = column >= bar_start && column < bar_end;
      image.rgb[next++] = in_bar ? 255 : static_cast<std::uint8_t>(column * 255 / info_.width);
      image.rgb[next++] = in_bar ? 255 : static_cast<std::uint8_t>(row * 255 / info_.height);
      image.rgb[next++] = in_bar ? 255 : 64;
    }
  }
  return {};
}

void FakeTouch::press(int pad, double force_N) {
  const std::lock_guard lock(mutex_);
  force_N_.at(static_cast<std::size_t>(pad)) = force_N;
}

void FakeTouch::set_failure(std::optional<Error> failure) {
  const std::lock_guard lock(mutex_);
  failure_ = std::move(failure);
}

Result<TouchReading> FakeTouch::read_touch() const {
  const std::lock_guard lock(mutex_);
  if (failure_) return *failure_;
  TouchReading reading;
  reading.stamp_ns = clock_.now_ns();
  reading.force_N = force_N_;
  for (const double force_N : force_N_) reading.on.push_back(force_N > 0);
  return reading;
}

std::string FakeWorld::command(const std::string& line) {
  std::istringstream words(line);
  std::string world;
  std::string verb;
  words >> world >> verb;
  if (world == "world" && verb == "num") return "0";
  return "[fail] \"this robot has no simulated world: only 'world num KIND' is answered\"";
}

Result<WrenchReading> FakeForceTorque::read_wrench() const {
  WrenchReading reading;
  reading.stamp_ns = clock_.now_ns();
  return reading;
}

Result<InertialReading> FakeInertial::read_inertial() const {
  InertialReading reading;
  reading.stamp_ns = clock_.now_ns();
  reading.acceleration_m_s2.z() = kGravity_m_s2;
  return reading;
}

}  // namespace nido
