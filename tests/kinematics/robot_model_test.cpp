#include <Eigen/Eigenvalues>
#include <cmath>
#include <fstream>
#include <sstream>

#include "support.h"

namespace nido {
namespace {

constexpr double kDegree = M_PI / 180;

std::string icub_text() {
  std::ifstream file(test::icub_path());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(RobotModel, HasTheICubsPartsInTheirOrder) {
  const RobotModel model = test::icub();
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"head", 6}, {"torso", 3}, {"left_arm", 16}, {"right_arm", 16}, {"left_leg", 6}, {"right_leg", 6}};
  ASSERT_EQ(model.parts().size(), expected.size());
  int first = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(model.parts()[i].name, expected[i].first);
    EXPECT_EQ(model.parts()[i].axes.size(), expected[i].second);
    EXPECT_EQ(model.parts()[i].first_axis, first);
    first += static_cast<int>(expected[i].second);
  }
  EXPECT_EQ(model.axis_count(), 53);
  EXPECT_EQ(model.hinges().size(), 73U);
  // the board orders the torso yaw, roll, pitch; the body hangs pitch, roll, yaw
  EXPECT_EQ(model.parts()[1].axes[0].name, "torso_yaw");
  EXPECT_EQ(model.parts()[1].axes[2].name, "torso_pitch");
  const BodyLink& chest = model.links()[*model.link_index("chest")];
  EXPECT_EQ(model.hinges()[chest.hinge].name, "torso_yaw");
}

TEST(RobotModel, WeighsAndMeasuresWhatThePaperSays) {
  const RobotModel model = test::icub();
  EXPECT_NEAR(model.mass_kg(), 20.3, 0.02 * 20.3);
  const double sole_m = model.X_RootLink(*model.link_index("r_foot"), model.zero_axes()).translation().z();
  EXPECT_NEAR(sole_m, -0.5975, 1e-9);
  // top of the head: its round collision shape
  const std::string text = icub_text();
  const auto at = text.find("<collision name=\"head_0\">");
  ASSERT_NE(at, std::string::npos);
  Eigen::Vector3d centre_m;
  double radius_m = 0;
  ASSERT_EQ(std::sscanf(text.c_str() + text.find("xyz=", at), "xyz=\"%lf %lf %lf", &centre_m.x(),
                        &centre_m.y(), &centre_m.z()),
            3);
  ASSERT_EQ(std::sscanf(text.c_str() + text.find("<sphere", at), "<sphere radius=\"%lf", &radius_m), 1);
  const double top_m =
      (model.X_RootLink(*model.link_index("head"), model.zero_axes()) * centre_m).z() + radius_m;
  EXPECT_NEAR(top_m - sole_m, 1.05, 0.005);
}

TEST(RobotModel, EveryMassHasAnInertiaThatABodyCanHave) {
  const RobotModel model = test::icub();
  for (const BodyLink& link : model.links()) {
    if (link.mass_kg == 0) continue;
    const Eigen::Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(link.inertia_Link_kgm2).eigenvalues();
    EXPECT_GT(moments[0], 0) << link.name;
    EXPECT_GE(moments[0] + moments[1], moments[2] * (1 - 1e-9)) << link.name;
    // radius of gyration between half a millimetre and 20 cm
    EXPECT_GT(std::sqrt(moments[0] / link.mass_kg), 5e-4) << link.name;
    EXPECT_LT(std::sqrt(moments[2] / link.mass_kg), 0.2) << link.name;
  }
}

TEST(RobotModel, SignsAreTheICubs) {
  const RobotModel model = test::icub();
  const auto moved = [&](const char* axis, double deg, const char* link) {
    const Eigen::VectorXd axes = *model.axes_from_names({{axis, deg * kDegree}});
    const int index = *model.link_index(link);
    return Eigen::Vector3d(model.X_RootLink(index, axes).translation() -
                           model.X_RootLink(index, model.zero_axes()).translation());
  };
  EXPECT_LT(moved("torso_pitch", 10, "head_center").x(), -0.01);   // forward
  EXPECT_LT(moved("torso_roll", 10, "head_center").y(), -0.01);    // to the left
  EXPECT_GT(moved("neck_pitch", 10, "head_center").z(), 0.005);    // up
  EXPECT_LT(moved("r_shoulder_pitch", -20, "r_hand").x(), -0.05);  // forward
  EXPECT_GT(moved("r_shoulder_roll", 20, "r_hand").y(), 0.05);     // away from the body
  EXPECT_LT(moved("l_shoulder_roll", 20, "l_hand").y(), -0.05);
  EXPECT_GT(moved("r_knee", -30, "r_foot").x(), 0.05);  // the heel goes back
  const Eigen::VectorXd version = *model.axes_from_names({{"eyes_version", 10 * kDegree}});
  EXPECT_GT(model.X_RootLink(*model.camera_link("left"), version).linear().col(2).y(), 0.1);  // looks right
  const Eigen::VectorXd vergence = *model.axes_from_names({{"eyes_vergence", 10 * kDegree}});
  EXPECT_GT(model.X_RootLink(*model.camera_link("left"), vergence).linear().col(2).y(),
            0.05);  // both look inwards
  EXPECT_LT(model.X_RootLink(*model.camera_link("right"), vergence).linear().col(2).y(), -0.05);
}

TEST(RobotModel, AxesComeBackFromHinges) {
  const RobotModel model = test::icub();
  std::mt19937_64 random(5);
  for (int n = 0; n < 50; ++n) {
    const Eigen::VectorXd axes = test::random_axes(model, random);
    const Eigen::VectorXd hinges = model.hinge_angles(axes);
    for (std::size_t h = 0; h < model.hinges().size(); ++h) {
      const double angle = hinges[static_cast<Eigen::Index>(h)];
      EXPECT_GE(angle, model.hinges()[h].lower_rad - 1e-9) << model.hinges()[h].name;
      EXPECT_LE(angle, model.hinges()[h].upper_rad + 1e-9) << model.hinges()[h].name;
    }
    EXPECT_LT((model.axes_from_hinges(hinges) - axes).norm(), 1e-9);
  }
}

TEST(RobotModel, KnowsItsSensors) {
  const RobotModel model = test::icub();
  ASSERT_EQ(model.hands().size(), 2U);
  for (const HandInfo& hand : model.hands()) {
    ASSERT_EQ(hand.pads.size(), 6U);
    ASSERT_EQ(hand.marks.size(), 2U);
    // both marks look out of the back of the hand, 46 mm apart
    const Eigen::VectorXd axes = model.zero_axes();
    const auto X_knuckle = model.X_RootLink(hand.marks[0].link, axes);
    const auto X_wrist = model.X_RootLink(hand.marks[1].link, axes);
    EXPECT_NEAR((X_knuckle.translation() - X_wrist.translation()).norm(), 0.046, 1e-9);
    const double outward = hand.side == "right" ? 1 : -1;  // at zero the palms face the body
    EXPECT_NEAR(X_knuckle.linear().col(2).y(), outward, 1e-9);
  }
  EXPECT_EQ(model.force_torque_sensors().size(), 4U);
  EXPECT_GE(model.inertial_link(), 0);
}

// config/robots/arm.urdf: z, then y, then an axis across both, after a turned origin
TEST(RobotModel, TurnsAboutAnyAxis) {
  const auto loaded = RobotModel::load(std::filesystem::path(NIDO_CONFIG_DIR) / "robots/arm.urdf");
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  const RobotModel& arm = *loaded;
  const Eigen::Vector3d axes_rad(0.4, -0.7, 1.1);
  using Eigen::AngleAxisd;
  using Eigen::Translation3d;
  using Eigen::Vector3d;
  const Eigen::Isometry3d lower = Translation3d(0, 0, 0.05) * AngleAxisd(0.4, Vector3d::UnitZ()) *
                                  AngleAxisd(-0.7, Vector3d::UnitY()) * Translation3d(0, 0, 0.24) *
                                  AngleAxisd(0.3, Vector3d::UnitZ()) *
                                  AngleAxisd(1.1, Vector3d(0.6, -0.8, 0));
  const int tip = *arm.link_index("tip");
  EXPECT_TRUE(arm.X_RootLink(*arm.link_index("lower"), axes_rad).isApprox(lower, 1e-12));
  EXPECT_TRUE(arm.X_RootLinks(axes_rad)[static_cast<std::size_t>(tip)].isApprox(
      lower * Translation3d(0, 0, 0.2), 1e-12));
  const auto J = arm.jacobian(tip, axes_rad, {0, 1, 2});
  constexpr double kStep_rad = 1e-6;
  for (int a = 0; a < 3; ++a) {
    const Vector3d step = kStep_rad * Vector3d::Unit(a);
    const Vector3d moved_m = arm.X_RootLink(tip, axes_rad + step).translation() -
                             arm.X_RootLink(tip, axes_rad - step).translation();
    EXPECT_LT((J.col(a).head<3>() - moved_m / (2 * kStep_rad)).norm(), 1e-8) << a;
  }
  EXPECT_NEAR(arm.mass_kg(), 1.7, 1e-12);
}

TEST(RobotModel, RefusesBadFilesInASentence) {
  const std::string good = icub_text();
  const auto refusal = [](const std::string& text) {
    const auto result = RobotModel::parse(text, "robot.urdf");
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : result.error().message;
  };
  const auto missing = RobotModel::load("no/such.urdf");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("no/such.urdf"), std::string::npos);

  EXPECT_NE(refusal("<robot name=").find("not XML"), std::string::npos);
  EXPECT_NE(refusal("").find("not XML"), std::string::npos);
  EXPECT_NE(refusal("<world/>").find("<robot>"), std::string::npos);
  EXPECT_NE(refusal("<robot name='x'/>").find("not a URDF robot"), std::string::npos);
  EXPECT_NE(refusal(good.substr(0, good.size() / 2)).find("not XML"), std::string::npos);
  EXPECT_NE(refusal("<robot name='x'><link name='a'/></robot>").find("<nido>"), std::string::npos);
  EXPECT_NE(refusal(replaced(good, "<hinge joint=\"r_elbow\"", "<hinge joint=\"r_elbo\"")).find("r_elbow"),
            std::string::npos);
  EXPECT_NE(refusal(replaced(good, "<camera name=\"left\" link=\"l_eye\"",
                             "<camera name=\"left\" link=\"third_eye\""))
                .find("third_eye"),
            std::string::npos);
  EXPECT_NE(refusal(replaced(good, "<axis name=\"neck_roll\"", "<axis name=\"neck_pitch\"")).find("twice"),
            std::string::npos);
  EXPECT_NE(refusal(replaced(good, "<pad name=\"thumb\"", "<pad name=\"toe\"")).find("pads"),
            std::string::npos);
  EXPECT_NE(
      refusal(replaced(good, "<axis name=\"neck_pitch\" lower=\"", "<axis name=\"neck_pitch\" lower=\"x"))
          .find("number"),
      std::string::npos);
  EXPECT_NE(
      refusal(replaced(good, "<axis name=\"neck_pitch\" lower=\"-", "<axis name=\"neck_pitch\" lower=\"7"))
          .find("limit"),
      std::string::npos);
  EXPECT_NE(refusal(replaced(good, "<nido version=\"1\"", "<nido version=\"9\"")).find("version"),
            std::string::npos);
}

TEST(RobotModel, RefusesUnknownNamesAndBadNumbers) {
  const RobotModel model = test::icub();
  const auto link = model.link_index("r_hnd");
  ASSERT_FALSE(link.ok());
  EXPECT_NE(link.error().message.find("r_hand"), std::string::npos) << link.error().message;
  EXPECT_FALSE(model.axis_index("").ok());
  EXPECT_FALSE(model.hand("upper").ok());
  EXPECT_FALSE(model.camera_link("third").ok());
  EXPECT_FALSE(model.axes_from_parts({{"head", {0, 0}}}).ok());
  EXPECT_FALSE(model.axes_from_parts({{"tail", {0}}}).ok());
  EXPECT_FALSE(model.axes_from_parts({{"torso", {0, std::nan(""), 0}}}).ok());
  EXPECT_FALSE(model.axes_from_names({{"r_elbow", INFINITY}}).ok());
  const auto axes = model.axes_from_parts({{"torso", {0.1, 0.2, 0.3}}});
  ASSERT_TRUE(axes.ok());
  EXPECT_DOUBLE_EQ((*axes)[*model.axis_index("torso_pitch")], 0.3);
}

}  // namespace
}  // namespace nido
