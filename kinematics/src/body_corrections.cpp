#include "nido/kinematics/body_corrections.h"

#include <tinyxml2.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

namespace nido {
namespace {

constexpr double kMostMoved_m = 0.1;
constexpr double kMostTurned_rad = 0.6;

Error refuse(const std::filesystem::path& path, const YAML::Node& at, const std::string& sentence) {
  const int line = at ? at.Mark().line + 1 : 0;
  return {ErrorCode::kInvalidArgument, path.string() + ":" + std::to_string(line) + ": " + sentence};
}

Result<Eigen::Vector3d> read_vector(const std::filesystem::path& path, const YAML::Node& node,
                                    const std::string& what, double most) {
  const std::string expected = what + " must be three numbers of at most " + std::to_string(most);
  if (!node.IsSequence() || node.size() != 3) return refuse(path, node, expected);
  Eigen::Vector3d value;
  for (std::size_t i = 0; i < 3; ++i) {
    double number = 0;
    if (!YAML::convert<double>::decode(node[i], number) || !(std::abs(number) <= most))
      return refuse(path, node, expected);
    value(static_cast<Eigen::Index>(i)) = number;
  }
  return value;
}

std::string text_of(const std::array<double, 3>& numbers) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.12g %.12g %.12g", numbers[0], numbers[1], numbers[2]);
  return text.data();
}

std::array<double, 3> numbers_of(const char* text) {
  std::array<double, 3> numbers{};
  std::istringstream stream(text == nullptr ? "0 0 0" : text);
  for (double& number : numbers) stream >> number;
  return numbers;
}

// A URDF origin: roll about x, pitch about y, yaw about z of the fixed axes, one after the other.
Eigen::Isometry3d to_isometry(const std::array<double, 3>& xyz, const std::array<double, 3>& rpy) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
  X.linear() = (Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return X;
}

std::array<double, 3> rpy_of(const Eigen::Matrix3d& R) {
  const double upright = std::hypot(R(0, 0), R(1, 0));
  if (upright < 1e-9)  // yaw and roll turn about one axis: all of it is called roll
    return {std::atan2(-R(1, 2), R(1, 1)), std::atan2(-R(2, 0), upright), 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), upright), std::atan2(R(1, 0), R(0, 0))};
}

Result<std::string> read_text(const std::filesystem::path& path) {
  std::error_code trouble;
  if (!std::filesystem::is_regular_file(path, trouble))
    return Error{ErrorCode::kNotFound, "there is no file \"" + path.string() + "\""};
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  if (!file) return Error{ErrorCode::kNotFound, "the file \"" + path.string() + "\" cannot be read"};
  return content.str();
}

}  // namespace

Eigen::Isometry3d LinkCorrection::X_DrawnReal() const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = p_m;
  const double angle_rad = turn_rad.norm();
  if (angle_rad > 0) X.linear() = Eigen::AngleAxisd(angle_rad, turn_rad / angle_rad).toRotationMatrix();
  return X;
}

Result<BodyCorrections> BodyCorrections::load(const std::filesystem::path& path) {
  const auto text = read_text(path);
  if (!text) return text.error();
  YAML::Node file;
  try {
    file = YAML::Load(*text);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, path.string() + ": " + e.what()};
  }
  if (!file.IsMap() || file.size() != 1 || !file["links"] || !file["links"].IsMap())
    return refuse(path, file, "expected one map `links` of corrections by link");
  BodyCorrections corrections;
  for (const auto& entry : file["links"]) {
    const auto link = entry.first.as<std::string>();
    if (!entry.second.IsMap()) return refuse(path, entry.second, "link " + link + ": expected a map");
    LinkCorrection& correction = corrections.links[link];
    for (const auto& field : entry.second) {
      const auto key = field.first.as<std::string>();
      if (key != "p_m" && key != "turn_rad") {
        return refuse(path, field.second,
                      "link " + link + ": '" + key + "' is unknown; allowed: p_m, turn_rad");
      }
      auto value = read_vector(path, field.second, "link " + link + ": " + key,
                               key == "p_m" ? kMostMoved_m : kMostTurned_rad);
      if (!value) return value.error();
      (key == "p_m" ? correction.p_m : correction.turn_rad) = *value;
    }
  }
  return corrections;
}

Status BodyCorrections::save(const std::filesystem::path& path, const std::string& about) const {
  const std::filesystem::path part = path.string() + ".part";
  std::ofstream file(part, std::ios::trunc);
  file << "# " << about << "\nlinks:\n";
  for (const auto& [link, correction] : links) {
    const auto list = [](const Eigen::Vector3d& v) {
      std::array<char, 96> text{};
      std::snprintf(text.data(), text.size(), "[%.9g, %.9g, %.9g]", v.x(), v.y(), v.z());
      return std::string(text.data());
    };
    file << "  " << link << ": {p_m: " << list(correction.p_m) << ", turn_rad: " << list(correction.turn_rad)
         << "}\n";
  }
  file.close();
  std::error_code trouble;
  if (file) std::filesystem::rename(part, path, trouble);
  if (!file || trouble) return Error{ErrorCode::kFailed, path.string() + " cannot be written"};
  return {};
}

Result<std::string> corrected_urdf(const std::string& urdf_text, const std::string& source,
                                   const BodyCorrections& corrections) {
  tinyxml2::XMLDocument document;
  if (document.Parse(urdf_text.c_str(), urdf_text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return Error{ErrorCode::kInvalidArgument,
                 source + ":" + std::to_string(document.ErrorLineNum()) + ": not XML"};
  }
  std::size_t found = 0;
  for (auto* joint = document.RootElement()->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const auto* child = joint->FirstChildElement("child");
    const char* name = child == nullptr ? nullptr : child->Attribute("link");
    const auto correction = corrections.links.find(name == nullptr ? "" : name);
    if (correction == corrections.links.end()) continue;
    ++found;
    auto* origin = joint->FirstChildElement("origin");
    if (origin == nullptr) origin = joint->InsertNewChildElement("origin");
    const Eigen::Isometry3d X =
        to_isometry(numbers_of(origin->Attribute("xyz")), numbers_of(origin->Attribute("rpy"))) *
        correction->second.X_DrawnReal();
    const Eigen::Vector3d& p = X.translation();
    origin->SetAttribute("xyz", text_of({p.x(), p.y(), p.z()}).c_str());
    origin->SetAttribute("rpy", text_of(rpy_of(X.linear())).c_str());
  }
  if (found != corrections.links.size()) {
    return Error{ErrorCode::kInvalidArgument,
                 source + " has " + std::to_string(found) + " of the " +
                     std::to_string(corrections.links.size()) +
                     " links that are corrected: the corrections are of another robot"};
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return std::string(printer.CStr());
}

Result<RobotModel> load_corrected_model(const std::filesystem::path& urdf_path,
                                        const BodyCorrections& corrections) {
  const auto urdf = read_text(urdf_path);
  if (!urdf) return urdf.error();
  const auto corrected = corrected_urdf(*urdf, urdf_path.string(), corrections);
  if (!corrected) return corrected.error();
  return RobotModel::parse(*corrected, urdf_path.string());
}

Result<RobotModel> load_corrected_model(const std::filesystem::path& urdf_path,
                                        const std::filesystem::path& corrections_path) {
  if (corrections_path.empty()) return RobotModel::load(urdf_path);
  const auto corrections = BodyCorrections::load(corrections_path);
  if (!corrections) return corrections.error();
  return load_corrected_model(urdf_path, *corrections);
}

}  // namespace nido
