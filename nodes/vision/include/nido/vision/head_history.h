#pragma once

#include <Eigen/Core>
#include <deque>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/time.h"

namespace nido::vision {

// Positions of a board's joints at one moment.
struct EncoderSample {
  Time stamp;
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_s;  // may be empty
};

// The last second of a board's encoders, to ask how the joints stood when a picture was taken. One thread.
class EncoderHistory {
 public:
  explicit EncoderHistory(std::size_t joint_count) : joint_count_(joint_count) {}
  // Refuses wrong sizes, numbers that are not finite, and stamps that go back; the history stays as it was.
  Status add(const EncoderSample& sample);
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  // Between the two samples around `time`, linearly; the first or last one outside. Nothing when empty.
  [[nodiscard]] std::vector<double> at(Time time) const;
  [[nodiscard]] const EncoderSample& latest() const { return samples_.back(); }
  // Fastest joint now, from the positions of the last two samples; rad/s.
  [[nodiscard]] double speed_rad_s() const;

 private:
  std::size_t joint_count_;
  std::deque<EncoderSample> samples_;
};

}  // namespace nido::vision
