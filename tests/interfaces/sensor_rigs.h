#pragma once

// A fake camera and a fake hand with their time, as they are or to be served.

#include "fake/fake_sensors.h"
#include "rigs.h"
#include "sensor_contracts.h"

namespace nido::test {

class FakeCameraRig final : public CameraRig {
 public:
  ICamera& camera() override { return camera_; }
  void advance() override { clock_.advance_ns(kPeriod_ns); }
  const IClock& clock() const { return clock_; }

 private:
  ManualClock clock_;
  FakeCamera camera_{{64, 48, 50, 50, 32, 24, {}}, clock_};
};

class FakeTouchRig final : public TouchRig {
 public:
  ITouch& touch() override { return touch_; }
  void advance() override { clock_.advance_ns(kPeriod_ns); }
  bool press(int pad, bool pressed) override {
    touch_.press(pad, pressed ? 2.5 : 0);
    return true;
  }
  const IClock& clock() const { return clock_; }

 private:
  ManualClock clock_;
  FakeTouch touch_{6, clock_};
};

}  // namespace nido::test
