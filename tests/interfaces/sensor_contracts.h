#pragma once

// The contracts of camera and touch, run unchanged against every family and against each through the network.
// Include it in one file of a test program and instantiate the suites with factories of rigs.

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/touch.h"

namespace nido::test {

class CameraRig {
 public:
  virtual ~CameraRig() = default;
  virtual ICamera& camera() = 0;
  // Lets 10 ms of the robot's time pass.
  virtual void advance() = 0;
  // Lets time pass until the condition holds; false when it never does.
  virtual bool eventually(const std::function<bool()>& condition) {
    for (int period = 0; period < 200; ++period) {
      if (condition()) return true;
      advance();
    }
    return condition();
  }

 protected:
  // The same for pictures that travel: they may be late or lost, so that the wall's clock sets the end.
  bool patiently(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      advance();
      std::this_thread::yield();
    }
    return true;
  }
};
using CameraRigFactory = std::function<std::unique_ptr<CameraRig>()>;

class CameraContract : public testing::TestWithParam<CameraRigFactory> {
 protected:
  void SetUp() override {
    rig_ = GetParam()();
    rig_->eventually([this] { return grab() && rig_->camera().info(); });
    const Status grabbed = grab();
    ASSERT_TRUE(grabbed.ok()) << grabbed.error().message;
  }
  Status grab() { return rig_->camera().grab(image_); }

  std::unique_ptr<CameraRig> rig_;
  Image image_;
};

TEST_P(CameraContract, PictureAndInfoAgree) {
  const CameraInfo info = *rig_->camera().info();
  EXPECT_GT(info.width, 0);
  EXPECT_GT(info.height, 0);
  EXPECT_EQ(image_.width, info.width);
  EXPECT_EQ(image_.height, info.height);
  EXPECT_EQ(image_.rgb.size(), static_cast<std::size_t>(info.width * info.height * 3));
}

TEST_P(CameraContract, TheLensLooksThroughThePicture) {
  const CameraInfo info = *rig_->camera().info();
  EXPECT_GT(info.fx_px, 0);
  EXPECT_GT(info.fy_px, 0);
  EXPECT_GT(info.cx_px, 0);
  EXPECT_LT(info.cx_px, info.width);
  EXPECT_GT(info.cy_px, 0);
  EXPECT_LT(info.cy_px, info.height);
}

TEST_P(CameraContract, ThePictureShowsSomething) {
  bool differs = false;
  for (const std::uint8_t value : image_.rgb) differs = differs || value != image_.rgb.front();
  EXPECT_TRUE(differs);
}

TEST_P(CameraContract, PicturesFollowTime) {
  const std::int64_t first_ns = image_.stamp_ns;
  EXPECT_TRUE(rig_->eventually([&] { return grab().ok() && image_.stamp_ns > first_ns; }));
}

class TouchRig {
 public:
  virtual ~TouchRig() = default;
  virtual ITouch& touch() = 0;
  virtual void advance() = 0;
  // Makes something touch a pad, and takes it away again; false if this rig cannot.
  virtual bool press(int pad, bool pressed) = 0;
  // How many there are, one that press() knows, and one far from it.
  [[nodiscard]] virtual int pads() const { return 6; }
  [[nodiscard]] virtual int pressed_pad() const { return 5; }
  [[nodiscard]] virtual int far_pad() const { return 0; }
};
using TouchRigFactory = std::function<std::unique_ptr<TouchRig>()>;

class TouchContract : public testing::TestWithParam<TouchRigFactory> {
 protected:
  void SetUp() override {
    rig_ = GetParam()();
    for (int period = 0; period < 200 && !rig_->touch().read_touch(); ++period) rig_->advance();
    ASSERT_TRUE(rig_->touch().read_touch().ok()) << rig_->touch().read_touch().error().message;
  }
  bool eventually(const std::function<bool()>& condition) {
    for (int period = 0; period < 200; ++period) {
      if (condition()) return true;
      rig_->advance();
    }
    return false;
  }
  bool eventually_on(int pad, bool on) {
    return eventually([&] { return rig_->touch().read_touch()->on.at(static_cast<std::size_t>(pad)) == on; });
  }
  std::unique_ptr<TouchRig> rig_;
};

TEST_P(TouchContract, EveryPadHasAValue) {
  const TouchReading reading = *rig_->touch().read_touch();
  const auto pads = static_cast<std::size_t>(rig_->pads());
  EXPECT_EQ(rig_->touch().pads(), rig_->pads());
  EXPECT_EQ(reading.on.size(), pads);
  ASSERT_EQ(reading.force_N.size(), pads);
  for (std::size_t pad = 0; pad < pads; ++pad) {
    EXPECT_GE(reading.force_N[pad], 0);
    EXPECT_TRUE(reading.on[pad] || reading.force_N[pad] == 0) << pad;
  }
}

TEST_P(TouchContract, FeelsWhatTouchesAndNothingElse) {
  const int pad = rig_->pressed_pad();
  const auto place = static_cast<std::size_t>(pad);
  EXPECT_TRUE(eventually_on(pad, false));
  if (!rig_->press(pad, true)) GTEST_SKIP() << "nothing can be put on this pad";
  EXPECT_TRUE(eventually_on(pad, true));
  EXPECT_TRUE(eventually([&] { return rig_->touch().read_touch()->force_N.at(place) > 0; }));
  EXPECT_FALSE(rig_->touch().read_touch()->on.at(static_cast<std::size_t>(rig_->far_pad())));
  ASSERT_TRUE(rig_->press(pad, false));
  EXPECT_TRUE(eventually_on(pad, false));
}

}  // namespace nido::test
