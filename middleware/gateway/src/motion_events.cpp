#include "icub_words.h"
#include "nido/gateway/icub_tasks.h"

namespace nido::gateway {
namespace {

constexpr std::size_t kMostShares = 100;

}  // namespace

std::optional<yarp::Bottle> MotionEvents::reply(const yarp::Bottle& words, std::size_t at) {
  if (!is(words, at + 1, "ogoi") && !is(words, at + 1, "ongoing")) return std::nullopt;
  if (is(words, at, "list")) return ack({list_of(shares_)});
  const auto share = number_at(words, at + 2);
  if (!share || *share < 0 || *share > 1) return std::nullopt;
  if (is(words, at, "regi")) {
    if (shares_.size() >= kMostShares) return nack("too many shares of a motion are told already");
    shares_.insert(*share);
    return ack();
  }
  if (is(words, at, "unre")) return shares_.erase(*share) > 0 ? ack() : nack("this share is not told");
  return std::nullopt;
}

std::vector<yarp::Bottle> MotionEvents::follow(bool moving, double progress, std::int64_t stamp_ns) {
  const yarp::Value time = yarp::Value::of(static_cast<double>(stamp_ns) * 1e-9);
  std::vector<yarp::Bottle> told;
  if (moving && (!was_moving_ || progress < was_at_)) {
    if (!was_moving_) told.push_back({yarp::Value::string("motion-onset"), time});
    was_at_ = -1;
  }
  if (moving || was_moving_) {
    for (const double share : shares_) {
      if (share > was_at_ && share <= progress) {
        told.push_back({yarp::Value::string("motion-ongoing"), time, yarp::Value::of(share)});
      }
    }
    was_at_ = progress;
  }
  if (!moving && was_moving_) told.push_back({yarp::Value::string("motion-done"), time});
  was_moving_ = moving;
  return told;
}

}  // namespace nido::gateway
