// Forward kinematics and Jacobian against orocos-kdl, which builds its own tree from the same file.
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <kdl/tree.hpp>
#include <numeric>

#include "support.h"

namespace nido {
namespace {

KDL::Frame to_kdl(const urdf::Pose& pose) {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
  pose.rotation.getQuaternion(x, y, z, w);
  return {KDL::Rotation::Quaternion(x, y, z, w),
          KDL::Vector(pose.position.x, pose.position.y, pose.position.z)};
}

void add_children(KDL::Tree& tree, const urdf::LinkConstSharedPtr& link) {
  for (const auto& child : link->child_links) {
    const auto& joint = *child->parent_joint;
    const KDL::Frame frame = to_kdl(joint.parent_to_joint_origin_transform);
    const KDL::Vector axis = frame.M * KDL::Vector(joint.axis.x, joint.axis.y, joint.axis.z);
    const KDL::Joint kdl_joint = joint.type == urdf::Joint::FIXED
                                     ? KDL::Joint(joint.name, KDL::Joint::None)
                                     : KDL::Joint(joint.name, frame.p, axis, KDL::Joint::RotAxis);
    tree.addSegment(KDL::Segment(child->name, kdl_joint, frame), link->name);
    add_children(tree, child);
  }
}

TEST(Kdl, PosesAndJacobiansAgree) {
  const RobotModel model = test::icub();
  const auto urdf_model = urdf::parseURDFFile(test::icub_path().string());
  ASSERT_TRUE(urdf_model);
  KDL::Tree tree(urdf_model->getRoot()->name);
  add_children(tree, urdf_model->getRoot());
  std::mt19937_64 random(21);
  for (const std::string tip : {"r_hand", "l_hand", "r_foot", "l_eye", "r_index_tip", "l_thumb_tip",
                                "r_little_tip", "l_hand_mark_wrist", "imu"}) {
    KDL::Chain chain;
    ASSERT_TRUE(tree.getChain(urdf_model->getRoot()->name, tip, chain));
    KDL::ChainFkSolverPos_recursive forward(chain);
    KDL::ChainJntToJacSolver jacobian(chain);
    for (int n = 0; n < 20; ++n) {
      const Eigen::VectorXd axes = test::random_axes(model, random);
      const Eigen::VectorXd hinges = model.hinge_angles(axes);
      KDL::JntArray q(chain.getNrOfJoints());
      std::vector<int> chain_hinges;
      for (const auto& segment : chain.segments) {
        if (segment.getJoint().getType() == KDL::Joint::None) continue;
        chain_hinges.push_back(*model.hinge_index(segment.getJoint().getName()));
        q(static_cast<unsigned>(chain_hinges.size() - 1)) = hinges[chain_hinges.back()];
      }
      KDL::Frame pose;
      ASSERT_EQ(forward.JntToCart(q, pose), 0);
      const int link = *model.link_index(tip);
      const Eigen::Isometry3d X = model.X_RootLink(link, axes);
      const Eigen::Isometry3d X_all = model.X_RootLinks(hinges)[link];
      ASSERT_LT((X.matrix() - X_all.matrix()).norm(), 1e-12);
      for (int i = 0; i < 3; ++i) {
        ASSERT_NEAR(pose.p(i), X.translation()[i], 1e-9) << tip;
        for (int j = 0; j < 3; ++j) ASSERT_NEAR(pose.M(i, j), X.linear()(i, j), 1e-9) << tip;
      }

      KDL::Jacobian by_hinge(chain.getNrOfJoints());
      ASSERT_EQ(jacobian.JntToJac(q, by_hinge), 0);
      std::vector<int> all_axes(model.axis_count());
      std::iota(all_axes.begin(), all_axes.end(), 0);
      Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, model.axis_count());
      for (int a = 0; a < model.axis_count(); ++a) {
        for (const HingeShare& share : model.axis(a).hinges) {
          for (std::size_t k = 0; k < chain_hinges.size(); ++k) {
            if (chain_hinges[k] == share.hinge)
              expected.col(a) += share.multiplier * by_hinge.data.col(static_cast<Eigen::Index>(k));
          }
        }
      }
      ASSERT_LT((expected - model.jacobian(link, axes, all_axes)).cwiseAbs().maxCoeff(), 1e-9) << tip;
    }
  }
}

}  // namespace
}  // namespace nido
