#pragma once

#include <gtest/gtest.h>

#include <random>

#include "nido/kinematics/robot_model.h"

namespace nido::test {

inline std::filesystem::path icub_path() {
  return std::filesystem::path(NIDO_CONFIG_DIR) / "robots/icub.urdf";
}

inline RobotModel icub() {
  auto model = RobotModel::load(icub_path());
  EXPECT_TRUE(model.ok()) << (model ? "" : model.error().message);
  return std::move(model).value();
}

// Axes anywhere within their limits.
inline Eigen::VectorXd random_axes(const RobotModel& model, std::mt19937_64& random) {
  Eigen::VectorXd axes = model.zero_axes();
  for (int i = 0; i < model.axis_count(); ++i) {
    axes[i] =
        std::uniform_real_distribution<double>(model.axis(i).lower_rad, model.axis(i).upper_rad)(random);
  }
  return axes;
}

}  // namespace nido::test
