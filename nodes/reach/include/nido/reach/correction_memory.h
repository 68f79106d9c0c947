#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido::reach {

// What people have corrected about reaches: for an action upon a thing, at a place, how far beside the
// planned goal the hand shall go. Between places where something was learned it is the mean, weighted by a
// Gaussian of the distance; far from all of them, for other things and for other actions it is nothing. A
// value, thread-compatible.
class CorrectionMemory {
 public:
  // Of a correction's influence (standard deviation of the Gaussian).
  static constexpr double kReach_m = 0.06;
  // A correction may be so long.
  static constexpr double kMost_m = 0.08;

  // Where to go beside the goal, root frame, for a thing that is seen at p_Root_m.
  [[nodiscard]] Eigen::Vector3d offset_m(const std::string& action, const std::string& object,
                                         const Eigen::Vector3d& p_Root_m) const;
  // From now on offset_m() is exactly this here. kInvalidArgument, and nothing learned, when it is longer
  // than kMost_m or no number.
  Status learn(const std::string& action, const std::string& object, const Eigen::Vector3d& p_Root_m,
               const Eigen::Vector3d& offset_m);
  [[nodiscard]] std::size_t size() const { return learned_.size(); }

  // YAML. kNotFound; kInvalidArgument with file, line and what was expected.
  static Result<CorrectionMemory> load(const std::filesystem::path& path);
  // The file appears whole or not at all. kFailed with the path.
  [[nodiscard]] Status save(const std::filesystem::path& path) const;

 private:
  struct Learned {
    std::string action;
    std::string object;
    Eigen::Vector3d p_Root_m;
    Eigen::Vector3d offset_m;
  };
  std::vector<Learned> learned_;
};

}  // namespace nido::reach
