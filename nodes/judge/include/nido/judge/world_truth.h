#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "nido/judge/ground_truth.h"

namespace nido {

// The truth as the simulator's world port tells it, in lines of text (docs/report.md).
class WorldTruth final : public GroundTruth {
 public:
  using Ask = std::function<Result<std::string>(const std::string& line)>;
  // `hand`: that may act: "right", "left" or "nearer", that is, either.
  WorldTruth(Ask ask, std::string hand) : ask_(std::move(ask)), hand_(std::move(hand)) {}

  Result<ObjectTruth> object(const std::string& name) override;
  Result<bool> held(const std::string& name) override;
  Result<bool> inside(const std::string& object, const std::string& basket) override;
  Result<std::vector<Eigen::Isometry3d>> X_RootPalms() override;

 private:
  // Asks and reads `count` numbers from the answer.
  Result<std::vector<double>> numbers(const std::string& line, std::size_t count);
  Ask ask_;
  std::string hand_;
};

}  // namespace nido
