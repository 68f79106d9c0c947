#include <console_bridge/console.h>
#include <tinyxml2.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "nido/kinematics/robot_model.h"

namespace nido {
namespace {

Eigen::Isometry3d to_isometry(const urdf::Pose& pose) {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
  pose.rotation.getQuaternion(x, y, z, w);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  X.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return X;
}

}  // namespace

// Builds a model from the two halves of the file: the URDF proper through urdfdom, the <nido> block through
// tinyxml2. Every function returns false after writing its sentence to `trouble`.
struct RobotModel::Loader {
  using Element = const tinyxml2::XMLElement*;

  std::string source;
  RobotModel model;
  Error trouble;

  bool refuse(const std::string& sentence) {
    trouble = {ErrorCode::kInvalidArgument, source + ": " + sentence};
    return false;
  }
  bool refuse_at(Element element, const std::string& sentence) {
    trouble = {ErrorCode::kInvalidArgument,
               source + ", line " + std::to_string(element->GetLineNum()) + ": " + sentence};
    return false;
  }

  bool read_link(const urdf::LinkConstSharedPtr& link, int parent) {
    BodyLink out;
    out.name = link->name;
    out.parent = parent;
    const auto& joint = link->parent_joint;
    // where the axis is not z, the hinge moves a frame of its own whose z it is, and the link is fixed to
    // that
    bool is_turned = false;
    Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
    if (joint) {
      out.X_ParentChild0 = to_isometry(joint->parent_to_joint_origin_transform);
      if (joint->type == urdf::Joint::REVOLUTE) {
        const Eigen::Vector3d axis(joint->axis.x, joint->axis.y, joint->axis.z);
        if (!(axis.norm() > 1e-9)) return refuse("joint \"" + joint->name + "\" has no axis");
        is_turned = (axis - Eigen::Vector3d::UnitZ()).norm() > 1e-12;
        if (is_turned) turned = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis);
        if (!joint->limits) return refuse("joint \"" + joint->name + "\" has no <limit>");
        Hinge hinge;
        hinge.name = joint->name;
        hinge.child_link = static_cast<int>(model.links_.size());
        hinge.lower_rad = joint->limits->lower;
        hinge.upper_rad = joint->limits->upper;
        hinge.velocity_rad_s = joint->limits->velocity;
        hinge.effort_Nm = joint->limits->effort;
        if (!(hinge.lower_rad <= hinge.upper_rad)) {
          return refuse("joint \"" + joint->name + "\" has its lower limit above its upper one");
        }
        out.hinge = static_cast<int>(model.hinges_.size());
        model.hinges_.push_back(hinge);
      } else if (joint->type != urdf::Joint::FIXED) {
        return refuse(
            "joint \"" + joint->name +
            "\" is neither revolute nor fixed: a robot here has no other joints (one that turns for "
            "ever can be a revolute one with wide limits)");
      }
    }
    if (is_turned) {
      out.name = joint->name + "_axis";
      out.X_ParentChild0.rotate(turned);
      model.links_.push_back(out);
      out = {};
      out.name = link->name;
      out.parent = static_cast<int>(model.links_.size()) - 1;
      out.X_ParentChild0.rotate(turned.inverse());
    }
    if (link->inertial) {
      const auto& inertial = *link->inertial;
      const Eigen::Isometry3d X_LinkCom = to_isometry(inertial.origin);
      out.mass_kg = inertial.mass;
      out.p_LinkCom_m = X_LinkCom.translation();
      Eigen::Matrix3d I;
      I << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz, inertial.ixz,
          inertial.iyz, inertial.izz;
      out.inertia_Link_kgm2 = X_LinkCom.linear() * I * X_LinkCom.linear().transpose();
    }
    const int index = static_cast<int>(model.links_.size());
    model.links_.push_back(out);
    for (const auto& child : link->child_links) {
      if (!read_link(child, index)) return false;
    }
    return true;
  }

  bool text(Element element, const char* name, std::string& out) {
    const char* value = element->Attribute(name);
    if (value == nullptr || *value == '\0') {
      return refuse_at(element,
                       std::string("<") + element->Name() + "> needs the attribute \"" + name + "\"");
    }
    out = value;
    return true;
  }
  bool number(Element element, const char* name, double& out) {
    std::string written;
    if (!text(element, name, written)) return false;
    char* end = nullptr;
    out = std::strtod(written.c_str(), &end);
    if (end == written.c_str() || *end != '\0' || !std::isfinite(out)) {
      return refuse_at(element, std::string("attribute \"") + name + "\" of <" + element->Name() + "> is \"" +
                                    written + "\", but should be a number");
    }
    return true;
  }
  bool link(Element element, const char* name, int& out) {
    std::string written;
    if (!text(element, name, written)) return false;
    const auto found = model.link_index(written);
    if (!found) return refuse_at(element, found.error().message);
    out = *found;
    return true;
  }
  bool hinge(Element element, const char* name, int& out) {
    std::string written;
    if (!text(element, name, written)) return false;
    const auto found = model.hinge_index(written);
    if (!found) return refuse_at(element, found.error().message);
    out = *found;
    return true;
  }

  bool read_axis(Element element, Part& part) {
    Axis axis;
    if (!text(element, "name", axis.name) || !number(element, "lower", axis.lower_rad) ||
        !number(element, "upper", axis.upper_rad) || !number(element, "velocity", axis.velocity_rad_s) ||
        !number(element, "effort", axis.effort_Nm) ||
        !number(element, "reference_speed", axis.reference_speed_rad_s) ||
        !number(element, "home", axis.home_rad)) {
      return false;
    }
    if (!(axis.lower_rad <= axis.upper_rad)) {
      return refuse_at(element, "axis \"" + axis.name + "\" has its lower limit above its upper one");
    }
    if (model.axis_index(axis.name)) return refuse_at(element, "axis \"" + axis.name + "\" is named twice");
    for (Element e = element->FirstChildElement("hinge"); e != nullptr; e = e->NextSiblingElement("hinge")) {
      HingeShare share;
      if (!hinge(e, "joint", share.hinge) || !number(e, "multiplier", share.multiplier) ||
          !number(e, "offset", share.offset_rad)) {
        return false;
      }
      if (share.multiplier == 0) return refuse_at(e, "the multiplier of a hinge may not be 0");
      axis.hinges.push_back(share);
    }
    if (axis.hinges.empty()) return refuse_at(element, "axis \"" + axis.name + "\" moves no <hinge>");
    model.axis_refs_.emplace_back(static_cast<int>(model.parts_.size()) - 1,
                                  static_cast<int>(part.axes.size()));
    part.axes.push_back(axis);
    return true;
  }

  bool read_hand(Element element) {
    HandInfo hand;
    if (!text(element, "name", hand.side) || !link(element, "frame", hand.frame)) return false;
    for (Element e = element->FirstChildElement("pad"); e != nullptr; e = e->NextSiblingElement("pad")) {
      TouchPad pad;
      if (!text(e, "name", pad.name) || !link(e, "link", pad.body_link) || !link(e, "tip", pad.tip_link))
        return false;
      const std::size_t number = hand.pads.size();
      if (number >= kPadNames.size() || pad.name != kPadNames[number]) {
        return refuse_at(e, "the pads of a hand are thumb, index, middle, ring, little, palm, in this order");
      }
      hand.pads.push_back(pad);
    }
    if (hand.pads.size() != kPadNames.size()) return refuse_at(element, "a hand needs six pads");
    for (Element e = element->FirstChildElement("mark"); e != nullptr; e = e->NextSiblingElement("mark")) {
      HandMark mark;
      if (!text(e, "name", mark.name) || !text(e, "colour", mark.colour) || !link(e, "link", mark.link) ||
          !number(e, "radius", mark.radius_m)) {
        return false;
      }
      hand.marks.push_back(mark);
    }
    model.hands_.push_back(hand);
    return true;
  }

  bool read_block(Element block) {
    std::string version;
    if (!text(block, "version", version) || !text(block, "capsule_suffix", model.capsule_suffix_))
      return false;
    if (version != "1")
      return refuse_at(block, "the <nido> block has version \"" + version + "\", this program reads \"1\"");
    for (Element p = block->FirstChildElement("part"); p != nullptr; p = p->NextSiblingElement("part")) {
      model.parts_.emplace_back();
      Part& part = model.parts_.back();
      part.first_axis = model.axis_count();
      if (!text(p, "name", part.name)) return false;
      for (Element a = p->FirstChildElement("axis"); a != nullptr; a = a->NextSiblingElement("axis")) {
        if (!read_axis(a, part)) return false;
      }
    }
    for (Element h = block->FirstChildElement("hand"); h != nullptr; h = h->NextSiblingElement("hand")) {
      if (!read_hand(h)) return false;
    }
    for (Element c = block->FirstChildElement("camera"); c != nullptr; c = c->NextSiblingElement("camera")) {
      std::string side;
      int index = -1;
      if (!text(c, "name", side) || !link(c, "link", index)) return false;
      model.camera_links_[side] = index;
    }
    if (Element s = block->FirstChildElement("inertial_sensor")) {
      if (!link(s, "link", model.inertial_link_)) return false;
    }
    for (Element f = block->FirstChildElement("force_torque"); f != nullptr;
         f = f->NextSiblingElement("force_torque")) {
      ForceTorqueInfo info;
      if (!text(f, "limb", info.limb) || !hinge(f, "joint", info.hinge)) return false;
      model.force_torque_.push_back(info);
    }
    return true;
  }

  bool couple() {
    const auto hinge_count = model.hinges_.size();
    model.hinge_shares_.resize(hinge_count);
    model.hinge_offsets_rad_.assign(hinge_count, 0.0);
    Eigen::MatrixXd coupling =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(hinge_count), model.axis_count());
    for (int a = 0; a < model.axis_count(); ++a) {
      for (const HingeShare& share : model.axis(a).hinges) {
        model.hinge_shares_[share.hinge].push_back({a, share.multiplier});
        model.hinge_offsets_rad_[share.hinge] += share.offset_rad;
        coupling(share.hinge, a) += share.multiplier;
      }
    }
    for (std::size_t h = 0; h < hinge_count; ++h) {
      if (model.hinge_shares_[h].empty())
        return refuse("no axis of the <nido> block moves joint \"" + model.hinges_[h].name + "\"");
    }
    const Eigen::MatrixXd normal = coupling.transpose() * coupling;
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(normal);
    if (!lu.isInvertible())
      return refuse("two axes of the <nido> block move the same joints in the same way");
    model.axes_from_hinges_ = lu.inverse() * coupling.transpose();
    return true;
  }

  bool read(const std::string& urdf_text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(urdf_text.c_str(), urdf_text.size()) != tinyxml2::XML_SUCCESS) {
      return refuse("line " + std::to_string(document.ErrorLineNum()) +
                    " is not XML: " + document.ErrorName());
    }
    Element robot = document.RootElement();
    if (robot == nullptr || std::string(robot->Name()) != "robot")
      return refuse("the outermost element is not <robot>");

    // urdfdom reports through console_bridge; its last line becomes part of the sentence instead of noise
    struct Catcher : console_bridge::OutputHandler {
      void log(const std::string& line, console_bridge::LogLevel level, const char*, int) override {
        if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first.empty()) first = line;
      }
      std::string first;
    } catcher;
    console_bridge::OutputHandler* const before = console_bridge::getOutputHandler();
    console_bridge::useOutputHandler(&catcher);
    const urdf::ModelInterfaceSharedPtr urdf_model = urdf::parseURDF(urdf_text);
    console_bridge::useOutputHandler(before);
    if (!urdf_model || !urdf_model->getRoot()) {
      return refuse("not a URDF robot" + (catcher.first.empty() ? std::string() : ": " + catcher.first));
    }

    model.name_ = urdf_model->getName();
    if (!read_link(urdf_model->getRoot(), -1)) return false;
    Element block = robot->FirstChildElement("nido");
    if (block == nullptr)
      return refuse("the <robot> has no <nido> block, which names parts, axes and sensors (docs/body.md)");
    return read_block(block) && couple();
  }
};

Result<RobotModel> RobotModel::parse(const std::string& urdf_text, const std::string& source) {
  Loader loader;
  loader.source = source;
  if (!loader.read(urdf_text)) return loader.trouble;
  return std::move(loader.model);
}

Result<RobotModel> RobotModel::load(const std::filesystem::path& urdf_path) {
  std::error_code trouble;
  if (!std::filesystem::is_regular_file(urdf_path, trouble)) {
    return Error{ErrorCode::kNotFound, "there is no robot file \"" + urdf_path.string() + "\""};
  }
  std::ifstream file(urdf_path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  if (!file)
    return Error{ErrorCode::kNotFound, "the robot file \"" + urdf_path.string() + "\" cannot be read"};
  return parse(content.str(), urdf_path.string());
}

}  // namespace nido
