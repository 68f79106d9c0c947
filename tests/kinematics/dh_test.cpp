// The URDF's forward kinematics against the product of the Denavit-Hartenberg matrices it was made from.
#include <Eigen/SVD>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support.h"

namespace nido {
namespace {

Eigen::Matrix4d matrix(const nlohmann::json& rows) {
  Eigen::Matrix4d m;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) m(i, j) = rows.at(i).at(j).get<double>();
  }
  return m;
}

// The nearest rotation; the finger bases are printed with six digits.
Eigen::Matrix4d made_rigid(const Eigen::Matrix4d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.topLeftCorner<3, 3>(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix4d result = m;
  result.topLeftCorner<3, 3>() = svd.matrixU() * svd.matrixV().transpose();
  return result;
}

struct Dh {
  nlohmann::json chains;
  static Dh load() {
    std::ifstream file(std::filesystem::path(NIDO_CONFIG_DIR) / "robots/icub_geometry.json");
    return {nlohmann::json::parse(file).at("chains")};
  }
  // T_i = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)
  [[nodiscard]] Eigen::Matrix4d product(const std::string& chain, bool rigid,
                                        const std::function<double(const std::string&)>& angle) const {
    const auto& data = chains.at(chain);
    Eigen::Matrix4d T = rigid ? made_rigid(matrix(data.at("H0"))) : matrix(data.at("H0"));
    for (const auto& link : data.at("links")) {
      const std::string joint = link.at(0);
      const double t = (joint.empty() ? 0.0 : angle(joint)) + link.at(4).get<double>() * M_PI / 180;
      const double alpha = link.at(3).get<double>() * M_PI / 180;
      const double a = link.at(1);
      const double d = link.at(2);
      Eigen::Matrix4d step;
      step << std::cos(t), -std::sin(t) * std::cos(alpha), std::sin(t) * std::sin(alpha), a * std::cos(t),
          std::sin(t), std::cos(t) * std::cos(alpha), -std::cos(t) * std::sin(alpha), a * std::sin(t), 0,
          std::sin(alpha), std::cos(alpha), d, 0, 0, 0, 1;
      T = T * step;
    }
    return T * matrix(data.at("HN"));
  }
};

constexpr double kDegree = M_PI / 180;

// What a hinge does, from the iCub's documentation of its couplings and not from the URDF. q: all axes by
// name.
double hinge_angle_by_hand(const RobotModel& model, const Eigen::VectorXd& axes, const std::string& side,
                           const std::string& joint) {
  const auto q = [&](const std::string& axis) { return axes[*model.axis_index(axis)]; };
  const std::string s = side.substr(0, 1) + "_";
  if (joint == "left_eye_pan") return q("eyes_version") + q("eyes_vergence") / 2;
  if (joint == "right_eye_pan") return q("eyes_version") - q("eyes_vergence") / 2;
  if (joint.ends_with("abduction")) return (60 * kDegree - q(s + "hand_finger")) / 3;
  if (joint.starts_with("ring") || joint.starts_with("little")) return q(s + "pinky") / 3;
  for (const char* finger : {"thumb", "index", "middle"}) {
    if (joint.starts_with(std::string(finger) + "_distal")) return q(s + finger + "_distal") / 2;
    if (joint.starts_with(finger)) return q(s + joint);
  }
  return q(joint);
}

TEST(Dh, BodyChainsAgreeToANanometre) {
  const RobotModel model = test::icub();
  const Dh dh = Dh::load();
  std::mt19937_64 random(11);
  const std::map<std::string, std::string> tips = {
      {"right_arm", "r_hand"}, {"left_arm", "l_hand"}, {"right_leg", "r_foot"},        {"left_leg", "l_foot"},
      {"right_eye", "r_eye"},  {"left_eye", "l_eye"},  {"head_center", "head_center"}, {"inertial", "imu"}};
  for (int n = 0; n < 200; ++n) {
    const Eigen::VectorXd axes = test::random_axes(model, random);
    for (const auto& [chain, tip] : tips) {
      const Eigen::Matrix4d expected = dh.product(chain, false, [&](const std::string& joint) {
        if (chain == "head_center" && joint.find("eye") != std::string::npos) return 0.0;
        if (joint == "pan") return 0.0;
        return hinge_angle_by_hand(model, axes, "", joint);
      });
      const Eigen::Matrix4d found = model.X_RootLink(*model.link_index(tip), axes).matrix();
      ASSERT_LT((expected - found).cwiseAbs().maxCoeff(), 1e-9) << chain;
    }
  }
}

TEST(Dh, FingersAgreeInThePalmFrame) {
  const RobotModel model = test::icub();
  const Dh dh = Dh::load();
  std::mt19937_64 random(12);
  for (int n = 0; n < 100; ++n) {
    const Eigen::VectorXd axes = test::random_axes(model, random);
    for (const std::string side : {"right", "left"}) {
      const std::string s = side.substr(0, 1);
      const Eigen::Isometry3d X_RootPalm = model.X_RootLink(*model.link_index(s + "_hand"), axes);
      for (const std::string finger : {"thumb", "index", "middle", "ring", "little"}) {
        const auto angle = [&](const std::string& joint) {
          return hinge_angle_by_hand(model, axes, side, joint);
        };
        const Eigen::Matrix4d found =
            (X_RootPalm.inverse() * model.X_RootLink(*model.link_index(s + "_" + finger + "_tip"), axes))
                .matrix();
        ASSERT_LT((dh.product(side + "_" + finger, true, angle) - found).cwiseAbs().maxCoeff(), 1e-9)
            << side << finger;
        // with the matrices as printed the tips differ by their rounding only
        ASSERT_LT((dh.product(side + "_" + finger, false, angle) - found).col(3).norm(), 1e-5)
            << side << finger;
      }
    }
  }
}

TEST(Dh, HandsMirrorEachOther) {
  const RobotModel model = test::icub();
  std::mt19937_64 random(13);
  for (int n = 0; n < 50; ++n) {
    Eigen::VectorXd axes = test::random_axes(model, random);
    const Part& right = model.parts()[*model.part_index("right_arm")];
    const Part& left = model.parts()[*model.part_index("left_arm")];
    axes.segment(left.first_axis, 16) = axes.segment(right.first_axis, 16);
    for (const std::string frame : {"thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip",
                                    "hand_mark_knuckle", "hand_mark_wrist"}) {
      Eigen::Vector3d tip[2];
      int k = 0;
      for (const std::string s : {"r_", "l_"}) {
        const auto X_RootPalm = model.X_RootLink(*model.link_index(s + "hand"), axes);
        tip[k++] = X_RootPalm.inverse() * model.X_RootLink(*model.link_index(s + frame), axes).translation();
      }
      tip[1].z() *= -1;
      ASSERT_LT((tip[0] - tip[1]).norm(), 1e-9) << frame;
    }
  }
}

}  // namespace
}  // namespace nido
