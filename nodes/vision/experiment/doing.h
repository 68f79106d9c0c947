#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "nido/experiment/kept.h"

namespace nido::vision {

// A thing that the robot does not know, and what a person says about it. Drawn by seed and number.
struct TaughtDeed {
  std::string object;     // file in config/objects: "ball", "cube", "cylinder"
  std::string colour;     // "teal"
  std::string name;       // "candle"
  std::string order;      // "drop candle into basket"
  std::size_t voice = 0;  // of the person who begins
  double x_m = 0.0;       // root frame: where it is shown
  double y_m = 0.0;
  double test_x_m = 0.0;  // and where it stands afterwards
  double test_y_m = 0.0;
  double yaw_deg = 0.0;
};
TaughtDeed draw_deed(std::uint64_t seed, int number);

// Shows the thing, says its name and what to do with it, at most three times; then a robot that was switched
// on anew, with what it has kept of that, hears the bare name and sees the thing in another place among
// others; who is not understood says it again, in another voice. Both through the app speech_and_action, in
// `folder`. Keys of the answer: thing, name, order, presentations, learned, said (to the second robot),
// done_right, sentence (the judge's).
Result<nlohmann::json> teach_deed(const TaughtDeed& deed, std::uint64_t seed, const std::string& folder,
                                  const Lane& lane);

}  // namespace nido::vision
