#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>

#include "nido/yarp/devices.h"
#include "nido/yarp/image.h"
#include "remote_stamps.h"

namespace nido::yarp {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr std::size_t kLongestVector = 64 * 1024;
constexpr std::size_t kLongestImage = 32 << 20;
constexpr std::size_t kLongestSound = 1 << 20;
constexpr std::size_t kHandTaxels = 192;
constexpr int kPads = 6;

// taxels of a pad: thumb, index, middle, ring, little, palm
constexpr std::array<std::pair<std::size_t, std::size_t>, kPads> kPadTaxels = {
    {{48, 12}, {0, 12}, {12, 12}, {24, 12}, {36, 12}, {96, 48}}};

// What a port of numbers gave last.
class NumbersPort {
 public:
  NumbersPort(std::shared_ptr<Network> network, const RemoteDevice& device, std::size_t count)
      : network_(std::move(network)), device_(device), count_(count), stamps_(device, *network_) {}

  Status open() {
    auto subscription = network_->subscribe(
        device_.remote, device_.local + ":i", kLongestVector,
        [this](const std::string& bytes, const std::string& envelope) { take(bytes, envelope); });
    if (!subscription) return subscription.error();
    subscription_ = std::move(*subscription);
    return wait_for_first([this] { return read(); });
  }

  struct Reading {
    std::int64_t stamp_ns = 0;
    std::vector<double> numbers;
  };
  Result<Reading> read() const {
    const std::lock_guard lock(mutex_);
    if (!newest_) return Error{ErrorCode::kTimeout, device_.remote + ": nothing has come yet"};
    return *newest_;
  }

 private:
  void take(const std::string& bytes, const std::string& envelope) {
    const Result<Decoded> decoded = decode_any(bytes, Dialect::k3);
    if (!decoded || decoded->bottle.size() < count_) return;
    Reading reading;
    for (const Value& value : decoded->bottle) {
      if (!value.is_number() || !std::isfinite(value.as_number())) return;
      reading.numbers.push_back(value.as_number());
    }
    const std::lock_guard lock(mutex_);
    reading.stamp_ns = stamps_.of(envelope);
    newest_ = std::move(reading);
  }

  const std::shared_ptr<Network> network_;
  const RemoteDevice device_;
  const std::size_t count_;
  mutable std::mutex mutex_;
  RemoteStamps stamps_;
  std::optional<Reading> newest_;
  std::unique_ptr<Network::Subscription> subscription_;  // last: ends before what it calls
};

class RemoteTouch final : public ITouch {
 public:
  RemoteTouch(std::shared_ptr<Network> network, const RemoteDevice& device, const TouchScale& scale)
      : port_(std::move(network), device,
              scale.taxels == 0 ? kHandTaxels : static_cast<std::size_t>(scale.taxels)),
        scale_(scale) {}
  Status open() { return port_.open(); }
  int pads() const override { return scale_.taxels == 0 ? kPads : scale_.taxels; }
  Result<TouchReading> read_touch() const override {
    const auto reading = port_.read();
    if (!reading) return reading.error();
    TouchReading touch;
    touch.stamp_ns = reading->stamp_ns;
    const auto add = [&](double value) {
      constexpr double kFullScale = 255.0;
      touch.on.push_back(value > scale_.threshold);
      touch.force_N.push_back(touch.on.back() ? value / kFullScale * scale_.full_scale_N : 0.0);
    };
    for (int taxel = 0; taxel < scale_.taxels; ++taxel)
      add(reading->numbers[static_cast<std::size_t>(taxel)]);
    if (scale_.taxels > 0) return touch;
    for (const auto& [first, count] : kPadTaxels) {
      const auto begin = reading->numbers.begin() + static_cast<std::ptrdiff_t>(first);
      add(*std::max_element(begin, begin + static_cast<std::ptrdiff_t>(count)));
    }
    return touch;
  }

 private:
  NumbersPort port_;
  const TouchScale scale_;
};

class RemoteForceTorque final : public IForceTorque {
 public:
  RemoteForceTorque(std::shared_ptr<Network> network, const RemoteDevice& device)
      : port_(std::move(network), device, 6) {}
  Status open() { return port_.open(); }
  Result<WrenchReading> read_wrench() const override {
    const auto reading = port_.read();
    if (!reading) return reading.error();
    const std::vector<double>& n = reading->numbers;
    return WrenchReading{reading->stamp_ns, {n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  }

 private:
  NumbersPort port_;
};

class RemoteInertial final : public IInertial {
 public:
  RemoteInertial(std::shared_ptr<Network> network, const RemoteDevice& device)
      : port_(std::move(network), device, 9) {}
  Status open() { return port_.open(); }
  Result<InertialReading> read_inertial() const override {
    const auto reading = port_.read();
    if (!reading) return reading.error();
    const std::vector<double>& n = reading->numbers;
    InertialReading inertial;
    inertial.stamp_ns = reading->stamp_ns;
    inertial.q_WorldSensor = Eigen::AngleAxisd(n[2] * kDegree_rad, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(n[1] * kDegree_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(n[0] * kDegree_rad, Eigen::Vector3d::UnitX());
    inertial.acceleration_m_s2 = {n[3], n[4], n[5]};
    inertial.angular_velocity_rad_s = Eigen::Vector3d(n[6], n[7], n[8]) * kDegree_rad;
    return inertial;
  }

 private:
  NumbersPort port_;
};

class RemoteCamera final : public ICamera {
 public:
  RemoteCamera(std::shared_ptr<Network> network, const RemoteDevice& device, CameraInfo info)
      : network_(std::move(network)), device_(device), info_(std::move(info)), stamps_(device, *network_) {}

  Status open() {
    auto subscription = network_->subscribe(
        device_.remote, device_.local + ":i", kLongestImage,
        [this](const std::string& bytes, const std::string& envelope) { take(bytes, envelope); });
    if (!subscription) return subscription.error();
    subscription_ = std::move(*subscription);
    ask_lens();
    Image image;
    return wait_for_first([this, &image] { return grab(image); });
  }

  Status grab(Image& image) override {
    const std::lock_guard lock(mutex_);
    if (newest_.rgb.empty()) return Error{ErrorCode::kTimeout, device_.remote + ": no picture has come yet"};
    image = newest_;
    return {};
  }
  Result<CameraInfo> info() const override {
    const std::lock_guard lock(mutex_);
    return info_;
  }

 private:
  // a camera without an rpc port has the lens that the robot file tells
  void ask_lens() {
    const auto get = [&](const char* what) -> Bottle {
      const Result<Bottle> reply = network_->ask(
          device_.remote + "/rpc", {Value::word("visr"), Value::word("get"), Value::word(what)});
      if (!reply || reply->size() < 4 || reply->front().is_word("fail")) return {};
      return Bottle(reply->begin() + 3, reply->end());
    };
    const Bottle lens = get("intp");
    const Bottle width = get("w");
    const Bottle height = get("h");
    if (lens.size() != 1 || !lens[0].is_list() || width.empty() || height.empty()) return;
    CameraInfo info;
    std::map<std::string, double> numbers;
    for (const Value& pair : lens[0].items) {
      if (pair.is_list() && pair.items.size() == 2 && pair.items[0].is_text() && pair.items[1].is_number()) {
        numbers[pair.items[0].text] = pair.items[1].as_number();
      }
    }
    if (numbers["focalLengthX"] <= 0 || numbers["focalLengthY"] <= 0 || !width[0].is_integer() ||
        !height[0].is_integer()) {
      return;
    }
    info.width = static_cast<int>(width[0].integer);
    info.height = static_cast<int>(height[0].integer);
    info.fx_px = numbers["focalLengthX"];
    info.fy_px = numbers["focalLengthY"];
    // the first pixel's centre is at (0, 0) there
    info.cx_px = numbers["principalPointX"] + 0.5;
    info.cy_px = numbers["principalPointY"] + 0.5;
    if (numbers.contains("k1")) {
      info.distortion = {numbers["k1"], numbers["k2"], numbers["t1"], numbers["t2"], numbers["k3"]};
    }
    const std::lock_guard lock(mutex_);
    info_ = info;
  }

  void take(const std::string& bytes, const std::string& envelope) {
    Image image;
    if (!decode_image(bytes, image) || image.rgb.empty()) return;
    const std::lock_guard lock(mutex_);
    image.stamp_ns = stamps_.of(envelope);
    newest_ = std::move(image);
    // a lens that is told for another size is that of this one, scaled
    if (info_.width > 0 && info_.height > 0 &&
        (info_.width != newest_.width || info_.height != newest_.height)) {
      const double x = static_cast<double>(newest_.width) / info_.width;
      const double y = static_cast<double>(newest_.height) / info_.height;
      info_ = {newest_.width,   newest_.height,  info_.fx_px * x, info_.fy_px * y,
               info_.cx_px * x, info_.cy_px * y, info_.distortion};
    }
  }

  const std::shared_ptr<Network> network_;
  const RemoteDevice device_;
  mutable std::mutex mutex_;
  CameraInfo info_;
  RemoteStamps stamps_;
  Image newest_;
  std::unique_ptr<Network::Subscription> subscription_;  // last: ends before what it calls
};

class RemoteAudio final : public IAudioGrabberSound {
 public:
  RemoteAudio(std::shared_ptr<Network> network, const RemoteDevice& device, int sample_rate_hz, int channels)
      : network_(std::move(network)),
        device_(device),
        sample_rate_hz_(sample_rate_hz),
        channels_(channels),
        stamps_(device, *network_) {}

  Status open() {
    auto subscription = network_->subscribe(
        device_.remote, device_.local + ":i", kLongestSound,
        [this](const std::string& bytes, const std::string& envelope) { take(bytes, envelope); });
    if (!subscription) return subscription.error();
    subscription_ = std::move(*subscription);
    return {};
  }
  int sample_rate_hz() const override { return sample_rate_hz_; }
  int channels() const override { return channels_; }
  Status start() override {
    const std::lock_guard lock(mutex_);
    started_ = true;
    return {};
  }
  Status stop() override {
    const std::lock_guard lock(mutex_);
    started_ = false;
    samples_.clear();
    return {};
  }
  Result<Sound> get_sound(std::size_t max_frames) override {
    const std::lock_guard lock(mutex_);
    if (!started_)
      return Error{ErrorCode::kFailed, device_.remote + " is not listened to: start() comes first"};
    const std::size_t count = std::min(max_frames * static_cast<std::size_t>(channels_), samples_.size());
    Sound sound{first_ns_, sample_rate_hz_, channels_, {}};
    sound.samples.assign(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count));
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count));
    first_ns_ += duration_ns(count);
    return sound;
  }

 private:
  [[nodiscard]] std::int64_t duration_ns(std::size_t samples) const {
    return static_cast<std::int64_t>(samples) / channels_ * 1'000'000'000 / sample_rate_hz_;
  }
  void take(const std::string& bytes, const std::string& envelope) {
    Sound sound;
    if (!decode_sound(bytes, sound) || sound.channels != channels_ || sound.sample_rate_hz != sample_rate_hz_)
      return;
    const std::lock_guard lock(mutex_);
    const std::int64_t stamp_ns = stamps_.of(envelope);
    if (!started_) return;
    if (samples_.empty()) first_ns_ = stamp_ns;
    samples_.insert(samples_.end(), sound.samples.begin(), sound.samples.end());
    // ten seconds are kept when nobody takes them
    const std::size_t most = static_cast<std::size_t>(10 * sample_rate_hz_ * channels_);
    if (samples_.size() > most) {
      const std::size_t over = samples_.size() - most;
      samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(over));
      first_ns_ += duration_ns(over);
    }
  }

  const std::shared_ptr<Network> network_;
  const RemoteDevice device_;
  const int sample_rate_hz_;
  const int channels_;
  std::mutex mutex_;
  RemoteStamps stamps_;
  bool started_ = false;
  std::int64_t first_ns_ = 0;  // of the first kept sample
  std::deque<std::int16_t> samples_;
  std::unique_ptr<Network::Subscription> subscription_;  // last: ends before what it calls
};

class RemoteWorld final : public IWorld {
 public:
  RemoteWorld(std::shared_ptr<Network> network, std::string remote)
      : network_(std::move(network)), remote_(std::move(remote)) {}
  std::string command(const std::string& line) override {
    const Result<Bottle> request = parse_bottle(line);
    const Result<Bottle> reply = request ? network_->ask(remote_, *request) : Result<Bottle>(request.error());
    if (!reply) return to_text(Bottle{Value::word("fail"), Value::string(reply.error().message)});
    // a sentence for people comes as one string
    if (reply->size() == 1 && reply->front().kind == Value::Kind::kString) return reply->front().text;
    return to_text(*reply);
  }

 private:
  const std::shared_ptr<Network> network_;
  const std::string remote_;
};

template <class Interface, class Device>
Result<std::unique_ptr<Interface>> opened(std::unique_ptr<Device> device) {
  if (Status status = device->open(); !status) return status.error();
  return std::unique_ptr<Interface>(std::move(device));
}

}  // namespace

Result<std::unique_ptr<ICamera>> yarp_camera(std::shared_ptr<Network> network, const RemoteDevice& device,
                                             const CameraInfo& info) {
  return opened<ICamera>(std::make_unique<RemoteCamera>(std::move(network), device, info));
}
Result<std::unique_ptr<ITouch>> yarp_touch(std::shared_ptr<Network> network, const RemoteDevice& device,
                                           const TouchScale& scale) {
  return opened<ITouch>(std::make_unique<RemoteTouch>(std::move(network), device, scale));
}
Result<std::unique_ptr<IForceTorque>> yarp_force_torque(std::shared_ptr<Network> network,
                                                        const RemoteDevice& device) {
  return opened<IForceTorque>(std::make_unique<RemoteForceTorque>(std::move(network), device));
}
Result<std::unique_ptr<IInertial>> yarp_inertial(std::shared_ptr<Network> network,
                                                 const RemoteDevice& device) {
  return opened<IInertial>(std::make_unique<RemoteInertial>(std::move(network), device));
}
Result<std::unique_ptr<IAudioGrabberSound>> yarp_audio(std::shared_ptr<Network> network,
                                                       const RemoteDevice& device, int sample_rate_hz,
                                                       int channels) {
  return opened<IAudioGrabberSound>(
      std::make_unique<RemoteAudio>(std::move(network), device, sample_rate_hz, channels));
}
Result<std::unique_ptr<IWorld>> yarp_world(std::shared_ptr<Network> network, const RemoteDevice& device) {
  const Result<Bottle> there = network->ask(device.remote, {Value::string("help")});
  if (!there) return there.error();
  return std::unique_ptr<IWorld>(std::make_unique<RemoteWorld>(std::move(network), device.remote));
}

}  // namespace nido::yarp
