#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nido/yarp/bottle.h"

// Reading what clients of the iCub's controllers say, and answering them.
namespace nido::gateway {

constexpr double kDegree_rad = std::numbers::pi / 180.0;

inline bool is(const yarp::Bottle& words, std::size_t at, std::string_view letters) {
  // a string of a client that spells words out, or its first four letters as a vocab
  return at < words.size() && words[at].is_text() &&
         std::string_view(words[at].text).substr(0, 4) == letters.substr(0, 4);
}

inline yarp::Bottle ack(yarp::Bottle more = {}) {
  more.insert(more.begin(), yarp::Value::word("ack"));
  return more;
}
inline yarp::Bottle nack(const std::string& reason) {
  return {yarp::Value::word("nack"), yarp::Value::string(reason)};
}
inline yarp::Bottle outcome(const Status& status) { return status ? ack() : nack(status.error().message); }
inline yarp::Value truth(bool yes) { return yarp::Value::word(yes ? "true" : "fals"); }

template <class Numbers>
yarp::Value list_of(const Numbers& numbers) {
  yarp::Bottle list;
  for (const double number : numbers) list.push_back(yarp::Value::of(number));
  return yarp::Value::list(std::move(list));
}

// A name and what it stands for.
inline yarp::Value property(const char* name, yarp::Value value) {
  return yarp::Value::list({yarp::Value::string(name), std::move(value)});
}
inline yarp::Value event_names() {
  yarp::Bottle names;
  for (const char* name : {"motion-onset", "motion-done", "motion-ongoing", "*"}) {
    names.push_back(yarp::Value::string(name));
  }
  return yarp::Value::list(std::move(names));
}

// A number at a place; nothing when it is none or not finite.
inline std::optional<double> number_at(const yarp::Bottle& words, std::size_t at) {
  if (at >= words.size() || !words[at].is_number() || !std::isfinite(words[at].as_number())) {
    return std::nullopt;
  }
  return words[at].as_number();
}
// As many numbers as are words there, from `at` on.
inline std::optional<std::vector<double>> numbers_from(const yarp::Bottle& words, std::size_t at = 0) {
  std::vector<double> numbers;
  for (; at < words.size(); ++at) {
    const std::optional<double> number = number_at(words, at);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}
// Those of a list.
inline std::optional<std::vector<double>> numbers_in(const yarp::Bottle& words, std::size_t at) {
  if (at >= words.size() || !words[at].is_list()) return std::nullopt;
  return numbers_from(words[at].items);
}

// x y z, axis, angle
inline std::vector<double> pose_numbers(const Eigen::Isometry3d& X) {
  const Eigen::AngleAxisd turn(X.linear());
  return {X.translation().x(), X.translation().y(), X.translation().z(), turn.axis().x(),
          turn.axis().y(),     turn.axis().z(),     turn.angle()};
}
inline yarp::Bottle stamped_pose(const Eigen::Isometry3d& X, std::int64_t stamp_ns) {
  return ack(
      {list_of(pose_numbers(X)),
       yarp::Value::list({yarp::Value::of(0), yarp::Value::of(static_cast<double>(stamp_ns) * 1e-9)})});
}

}  // namespace nido::gateway
