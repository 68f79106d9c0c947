#include "nido/reach/joint_path.h"

#include <gtest/gtest.h>

#include <random>

namespace nido::reach {
namespace {

TEST(MinimumJerk, RestsAtBothEnds) {
  EXPECT_EQ(minimum_jerk(-1.0), 0.0);
  EXPECT_EQ(minimum_jerk(0.0), 0.0);
  EXPECT_NEAR(minimum_jerk(0.5), 0.5, 1e-15);
  EXPECT_NEAR(minimum_jerk(1.0), 1.0, 1e-15);
  EXPECT_LT(minimum_jerk(0.01), 1e-4);
}

TEST(JointPath, MeetsItsEndsAndNeverBreaksASpeedLimit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> draw(-1.5, 1.5);
  for (int round = 0; round < 50; ++round) {
    std::vector<Joints> knots(1 + random() % 5);
    for (Joints& knot : knots) knot = Joints::NullaryExpr([&] { return draw(random); });
    const Joints limit = Joints::NullaryExpr([&] { return 0.2 + std::abs(draw(random)); });
    const JointPath path(knots, limit);
    EXPECT_EQ(path.at(0.0), knots.size() == 1 ? knots.back() : knots.front());
    EXPECT_TRUE(path.at(path.duration_s()).isApprox(knots.back()));
    EXPECT_TRUE(path.at(path.duration_s() + 5.0).isApprox(knots.back()));
    for (double t = 0.0; t < path.duration_s(); t += 0.01) {
      const Joints speed = (path.at(t + 0.01) - path.at(t)) / 0.01;
      EXPECT_LE((speed.cwiseAbs() - limit).maxCoeff(), 1e-6) << "round " << round << " t " << t;
    }
  }
}

TEST(JointPath, TakesAtLeastTheDurationAskedFor) {
  const Joints rest = Joints::Zero();
  EXPECT_DOUBLE_EQ(JointPath({rest, Joints::Constant(0.01)}, Joints::Ones(), 2.0).duration_s(), 2.0);
  EXPECT_EQ(JointPath({rest}, Joints::Ones()).at(1.0), rest);
  EXPECT_EQ(JointPath({rest, rest}, Joints::Ones()).at(1.0), rest);
}

}  // namespace
}  // namespace nido::reach
