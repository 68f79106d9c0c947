#include "nido/gateway/conversions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bridges.h"
#include "nido/msgs/types.h"
#include "nido/textproto/control_board_text.h"
#include "nido/value/value_message.h"
#include "nido/yarp/image.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Content;
using yarp::Value;

constexpr double kRadian_deg = 180.0 / std::numbers::pi;

// taxels of a hand's skin, by pad: thumb, index, middle, ring, little, palm
struct Taxels {
  std::size_t first;
  std::size_t count;
};
constexpr std::array<Taxels, 6> kHandTaxels = {{{48, 12}, {0, 12}, {12, 12}, {24, 12}, {36, 12}, {96, 48}}};
constexpr std::size_t kHandTaxelCount = 192;
constexpr double kTouched = 255;
constexpr double kFullScale_N = 1;  // of a taxel of a patch

double seconds(const msgs::Header& header) {
  return static_cast<double>(header.stamp().sec()) + static_cast<double>(header.stamp().nanosec()) * 1e-9;
}

template <class Message>
double time_of_message(const void* message) {
  return seconds(static_cast<const Message*>(message)->header());
}

std::vector<double> degrees(const std::vector<double>& values_rad) {
  std::vector<double> out(values_rad);
  for (double& value : out) value *= kRadian_deg;
  return out;
}

bool ends_with(const std::string& text, std::string_view end) {
  return std::string_view(text).ends_with(end);
}

std::string without_end(const std::string& text, std::string_view end) {
  return text.substr(0, text.size() - end.size());
}

// YARP's number of a word of up to four letters
std::int64_t word_number(std::string_view letters) {
  std::int64_t number = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(letters.size(), 4); ++i) {
    number |= static_cast<std::int64_t>(static_cast<unsigned char>(letters[i])) << (8 * i);
  }
  return number;
}

// joint position, speed, acceleration, motor position, speed, acceleration, torque, pwm, current, modes: each
// a list and whether it is valid
Content extended_state(const msgs::JointState& state, const std::vector<ControlMode>& modes) {
  const std::size_t axes = state.position().size();
  const std::vector<double> zeros(axes, 0.0);
  const std::vector<double> position_deg = degrees(state.position());
  const std::vector<double> velocity_deg_s = degrees(state.velocity());
  Bottle out;
  const auto add = [&](std::vector<double> values, bool valid) {
    values.resize(axes);
    out.push_back(Value::list(yarp::vector_bottle(values)));
    out.push_back(Value::word(valid ? "ok" : "fail"));
  };
  add(position_deg, true);
  add(velocity_deg_s, velocity_deg_s.size() == axes);
  add(zeros, true);
  // a motor of this robot turns as its joint does
  add(position_deg, true);
  add(velocity_deg_s, velocity_deg_s.size() == axes);
  add(zeros, true);
  add(state.effort(), state.effort().size() == axes);
  add(zeros, false);  // duty cycle and current are not measured
  add(zeros, false);
  Bottle mode_numbers;
  Bottle interaction_numbers;
  for (std::size_t i = 0; i < axes; ++i) {
    mode_numbers.push_back(Value::of(word_number(i < modes.size() ? mode_word(modes[i]) : "unkw")));
    interaction_numbers.push_back(Value::of(word_number("stif")));
  }
  out.push_back(Value::list(std::move(mode_numbers)));
  out.push_back(Value::word(modes.size() == axes ? "ok" : "fail"));
  out.push_back(Value::list(std::move(interaction_numbers)));
  out.push_back(Value::word("ok"));
  return Content(std::move(out));
}

std::vector<View> joint_views(const std::string& output, const std::shared_ptr<const Modes>& modes) {
  const auto time = &time_of_message<msgs::JointState>;
  std::vector<View> views = {{output, "joint positions in degrees, in the part's order", time,
                              [](const void* message) {
                                const auto& state = *static_cast<const msgs::JointState*>(message);
                                return Content(yarp::vector_bottle(degrees(state.position())));
                              },
                              false}};
  if (ends_with(output, "/state:o")) {
    views.push_back({without_end(output, "/state:o") + "/stateExt:o",
                     "positions, speeds, torques and modes of the joints, degrees and N m", time,
                     [modes](const void* message) {
                       return extended_state(*static_cast<const msgs::JointState*>(message), modes->get());
                     },
                     true});
  }
  return views;
}

std::vector<View> image_views(const std::string& output) {
  const auto content = [](const void* message) {
    const auto& picture = *static_cast<const msgs::Image*>(message);
    Image image;
    image.width = static_cast<int>(picture.width());
    image.height = static_cast<int>(picture.height());
    image.rgb = picture.data();
    return Content::of_bytes(yarp::encode_image(image));
  };
  const auto time = &time_of_message<msgs::Image>;
  std::vector<View> views = {{output, "colour pictures", time, content, false}};
  if (ends_with(output, "/image:o")) {
    views.push_back({without_end(output, "/image:o"), "colour pictures", time, content, false});
  }
  return views;
}

View generic_view(const std::string& output, const AnyType& type) {
  const auto to_json = type.to_json;
  return {output, "messages of type " + type.name + ", as pairs of name and value",
          [to_json](const void* message) {
            const Json json = to_json(message, 1);
            if (!json.contains("header")) return 0.0;
            const Json& stamp = json["header"]["stamp"];
            return stamp["sec"].get<double>() + stamp["nanosec"].get<double>() * 1e-9;
          },
          [to_json](const void* message) { return Content(bottle_of(to_json(message, 0))); }, false};
}

Content skin(const msgs::Touch& touch) {
  std::vector<double> taxels(kHandTaxelCount, 0.0);
  for (std::size_t pad = 0; pad < std::min(touch.on().size(), kHandTaxels.size()); ++pad) {
    if (!touch.on()[pad]) continue;
    const auto first = taxels.begin() + static_cast<std::ptrdiff_t>(kHandTaxels[pad].first);
    std::fill_n(first, kHandTaxels[pad].count, kTouched);
  }
  return Content(yarp::vector_bottle(taxels));
}

// A number for each taxel of a patch, 255 from the full scale on.
Content patch(const msgs::Touch& touch) {
  std::vector<double> taxels;
  for (const double force_N : touch.force_n())
    taxels.push_back(kTouched * std::clamp(force_N / kFullScale_N, 0.0, 1.0));
  return Content(yarp::vector_bottle(taxels));
}

// Three numbers each, in YARP's units.
struct Inertial {
  std::vector<double> roll_pitch_yaw_deg;
  std::vector<double> acceleration_m_s2;
  std::vector<double> rates_deg_s;
};
Inertial inertial_of(const msgs::Imu& imu) {
  const Eigen::Quaterniond q(imu.orientation().w(), imu.orientation().x(), imu.orientation().y(),
                             imu.orientation().z());
  const Eigen::Matrix3d R = q.normalized().toRotationMatrix();
  const double roll = std::atan2(R(2, 1), R(2, 2));
  const double pitch = std::atan2(0.0 - R(2, 0), std::hypot(R(2, 1), R(2, 2)));
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const auto& a = imu.linear_acceleration();
  const auto& w = imu.angular_velocity();
  return {{roll * kRadian_deg, pitch * kRadian_deg, yaw * kRadian_deg},
          {a.x(), a.y(), a.z()},
          {w.x() * kRadian_deg, w.y() * kRadian_deg, w.z() * kRadian_deg}};
}

Content inertial(const msgs::Imu& imu) {
  const Inertial all = inertial_of(imu);
  std::vector<double> numbers = all.roll_pitch_yaw_deg;
  numbers.insert(numbers.end(), all.acceleration_m_s2.begin(), all.acceleration_m_s2.end());
  numbers.insert(numbers.end(), all.rates_deg_s.begin(), all.rates_deg_s.end());
  numbers.resize(12);  // three zeros
  return Content(yarp::vector_bottle(numbers));
}

// As YARP's servers of many sensors tell it: a list for each kind of sensor, of a measurement and its time.
Content many_sensors(const msgs::Imu& imu) {
  const Inertial all = inertial_of(imu);
  Bottle out(kSensorKinds, Value::list());
  const auto put = [&](std::size_t kind, const std::vector<double>& numbers) {
    out[kind].items = {
        Value::list({Value::list(yarp::vector_bottle(numbers)), Value::of(seconds(imu.header()))})};
  };
  put(kGyroscopes, all.rates_deg_s);
  put(kAccelerometers, all.acceleration_m_s2);
  put(kOrientations, all.roll_pitch_yaw_deg);
  return Content(std::move(out));
}

Error wrong(std::string what) { return {ErrorCode::kInvalidArgument, std::move(what)}; }

msgs::Header header_of(const yarp::Incoming& incoming, std::int64_t now_ns) {
  std::int64_t ns = now_ns;
  if (const Result<yarp::Stamp> stamp = yarp::parse_stamp(incoming.envelope); stamp) {
    ns = std::llround(std::clamp(stamp->time_s, 0.0, 2e9) * 1e9);
  }
  msgs::Header header;
  header.stamp().sec(static_cast<std::int32_t>(ns / 1'000'000'000));
  header.stamp().nanosec(static_cast<std::uint32_t>(ns % 1'000'000'000));
  return header;
}

}  // namespace

std::vector<View> views_of(const std::string& output, const AnyType& type,
                           const std::shared_ptr<const Modes>& modes) {
  if (type.name == "sensor_msgs/msg/JointState") return joint_views(output, modes);
  if (type.name == "sensor_msgs/msg/Image") return image_views(output);
  if (type.name == "rosgraph_msgs/msg/Clock") {
    // as YARP's programs follow it
    return {{output, "the robot's time: seconds and nanoseconds", [](const void*) { return 0.0; },
             [](const void* message) {
               const auto& now = static_cast<const msgs::Clock*>(message)->clock();
               return Content(Bottle{Value::of(now.sec()), Value::of(static_cast<int>(now.nanosec()))});
             },
             false}};
  }
  if (type.name == "nido_msgs/msg/Values") {
    return {{output, "lists of anything", &time_of_message<msgs::Values>,
             [](const void* message) {
               // what is no list says nothing
               const Result<Values> values = values_of(*static_cast<const msgs::Values*>(message));
               return Content(values ? *values : Bottle());
             },
             false}};
  }
  std::vector<View> views = {generic_view(output, type)};
  const auto vector_view = [&](const std::string& name, const std::string& about, auto time, auto content) {
    views.push_back({name, about, time, content, false});
  };
  if (type.name == "nido_msgs/msg/Touch" && ends_with(output, "_hand:o")) {
    vector_view(without_end(output, ":o") + "_comp", "192 taxels of a hand's skin, 0 or 255",
                &time_of_message<msgs::Touch>,
                [](const void* message) { return skin(*static_cast<const msgs::Touch*>(message)); });
  }
  if (type.name == "nido_msgs/msg/Touch" && output.find("/skin/") != std::string::npos &&
      ends_with(output, ":o") && !ends_with(output, "_hand:o")) {
    vector_view(without_end(output, ":o") + "_comp", "a patch of skin, 0..255 a taxel; 255: 1 N or more",
                &time_of_message<msgs::Touch>,
                [](const void* message) { return patch(*static_cast<const msgs::Touch*>(message)); });
  }
  if (type.name == "geometry_msgs/msg/WrenchStamped" && ends_with(output, "/ft:o")) {
    vector_view(without_end(output, "/ft:o") + "/analog:o", "force (N) and torque (N m), six numbers",
                &time_of_message<msgs::WrenchStamped>, [](const void* message) {
                  const msgs::Wrench& wrench = static_cast<const msgs::WrenchStamped*>(message)->wrench();
                  return Content(
                      yarp::vector_bottle({wrench.force().x(), wrench.force().y(), wrench.force().z(),
                                           wrench.torque().x(), wrench.torque().y(), wrench.torque().z()}));
                });
  }
  if (type.name == "sensor_msgs/msg/Imu" && ends_with(output, ":o")) {
    vector_view(without_end(output, ":o"),
                "roll pitch yaw (degrees), acceleration (m/s2), angular velocity (degrees/s), three zeros",
                &time_of_message<msgs::Imu>,
                [](const void* message) { return inertial(*static_cast<const msgs::Imu*>(message)); });
  }
  if (type.name == "sensor_msgs/msg/Imu" && ends_with(output, kInertialOutput)) {
    vector_view(many_inertials(output) + "/measures:o",
                "gyroscope, accelerometer, orientation, as many sensors", &time_of_message<msgs::Imu>,
                [](const void* message) { return many_sensors(*static_cast<const msgs::Imu*>(message)); });
  }
  if (type.name == "nido_msgs/msg/Audio") {
    views.front().about = "sound";
    views.front().content = [](const void* message) {
      const auto& audio = *static_cast<const msgs::Audio*>(message);
      return Content::of_bytes(yarp::encode_sound({0, static_cast<int>(audio.sample_rate_hz()),
                                                   static_cast<int>(audio.channels()), audio.samples()}));
    };
  }
  return views;
}

Status take_into(const AnyType& type, const yarp::Incoming& incoming, std::int64_t now_ns, void* message) {
  if (type.name == "sensor_msgs/msg/Image" && !incoming.is_text) {
    Image image;
    if (Status decoded = yarp::decode_image(incoming.bytes, image); !decoded) return decoded;
    auto& out = *static_cast<msgs::Image*>(message);
    out.header(header_of(incoming, now_ns));
    out.width(static_cast<std::uint32_t>(image.width));
    out.height(static_cast<std::uint32_t>(image.height));
    out.encoding("rgb8");
    out.step(static_cast<std::uint32_t>(image.width * 3));
    out.data(std::move(image.rgb));
    return {};
  }
  if (type.name == "nido_msgs/msg/Audio" && !incoming.is_text) {
    Sound sound;
    if (Status decoded = yarp::decode_sound(incoming.bytes, sound); !decoded) return decoded;
    auto& out = *static_cast<msgs::Audio*>(message);
    out.header(header_of(incoming, now_ns));
    out.sample_rate_hz(static_cast<std::uint32_t>(sound.sample_rate_hz));
    out.channels(static_cast<std::uint32_t>(sound.channels));
    out.samples(std::move(sound.samples));
    return {};
  }
  const Result<yarp::Decoded> content = incoming.content();
  if (!content) return content.error();
  const Bottle& bottle = content->bottle;
  if (type.name == "nido_msgs/msg/Values") {
    auto& out = *static_cast<msgs::Values*>(message);
    out = message_of(bottle);
    out.header(header_of(incoming, now_ns));
    return {};
  }
  if (type.name == "nido_msgs/msg/JointCommand") {
    Result<StreamCommand> command = parse_stream_command(bottle);
    if (!command) return command.error();
    auto& out = *static_cast<msgs::JointCommand*>(message);
    out.header(header_of(incoming, now_ns));
    out.mode(std::string(to_string(command->mode)));
    out.joint().assign(command->joints.begin(), command->joints.end());
    out.value(std::move(command->values));
    return {};
  }
  if (type.name == "sensor_msgs/msg/JointState") {
    auto& out = *static_cast<msgs::JointState*>(message);
    out.header(header_of(incoming, now_ns));
    for (const Value& value : bottle) {
      if (!value.is_number()) return wrong("positions in degrees are expected");
      out.position().push_back(value.as_number() / kRadian_deg);
    }
    return {};
  }
  const Result<Json> json = json_of(bottle, type.to_json(message, 0));
  if (!json) return json.error();
  return type.from_json(*json, message);
}

}  // namespace nido::gateway
