#include "nido/reach/correction_memory.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <system_error>

namespace nido::reach {
namespace {

// Weight of "nothing was learned": half of a correction is left at twice kReach_m, a fortieth at 0.2 m.
constexpr double kNothing = 0.2;
constexpr double kSamePlace_m = 0.03;  // a later correction here replaces the one before

double influence(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  return std::exp(-(a_m - b_m).squaredNorm() /
                  (2.0 * CorrectionMemory::kReach_m * CorrectionMemory::kReach_m));
}

bool read_vector(const YAML::Node& node, double most, Eigen::Vector3d& out) {
  if (!node || !node.IsSequence() || node.size() != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    double value = 0;
    if (!YAML::convert<double>::decode(node[i], value) || !(std::abs(value) <= most)) return false;
    out(static_cast<Eigen::Index>(i)) = value;
  }
  return true;
}

}  // namespace

Eigen::Vector3d CorrectionMemory::offset_m(const std::string& action, const std::string& object,
                                           const Eigen::Vector3d& p_Root_m) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = kNothing;
  for (const Learned& one : learned_) {
    if (one.action != action || one.object != object) continue;
    const double weight = influence(one.p_Root_m, p_Root_m);
    sum += weight * one.offset_m;
    weights += weight;
  }
  return sum / weights;
}

Status CorrectionMemory::learn(const std::string& action, const std::string& object,
                               const Eigen::Vector3d& p_Root_m, const Eigen::Vector3d& offset_m) {
  if (!p_Root_m.allFinite() || !offset_m.allFinite() || offset_m.norm() > kMost_m) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a correction of {:.0f} mm is not learned; at most {:.0f} mm are",
                             1000.0 * offset_m.norm(), 1000.0 * kMost_m)};
  }
  std::erase_if(learned_, [&](const Learned& one) {
    return one.action == action && one.object == object && (one.p_Root_m - p_Root_m).norm() < kSamePlace_m;
  });
  // what is known nearby has its say here too: the new one makes up for it
  Eigen::Vector3d own_m = (1.0 + kNothing) * offset_m;
  for (const Learned& one : learned_) {
    if (one.action == action && one.object == object)
      own_m -= influence(one.p_Root_m, p_Root_m) * (one.offset_m - offset_m);
  }
  learned_.push_back({action, object, p_Root_m, own_m});
  return {};
}

Result<CorrectionMemory> CorrectionMemory::load(const std::filesystem::path& path) {
  std::error_code absent;
  if (!std::filesystem::exists(path, absent))
    return Error{ErrorCode::kNotFound, path.string() + ": no such file of corrections"};
  YAML::Node file;
  try {
    file = YAML::LoadFile(path.string());
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, path.string() + ": " + e.what()};
  }
  const YAML::Node list = file.IsMap() ? file["corrections"] : YAML::Node();
  if (!list || !(list.IsSequence() || list.IsNull()))
    return Error{ErrorCode::kInvalidArgument, path.string() + ":1: expected a list `corrections`"};
  CorrectionMemory memory;
  for (const YAML::Node& node : list) {
    Learned one;
    const bool named = node.IsMap() && node["action"] && node["action"].IsScalar() && node["object"] &&
                       node["object"].IsScalar();
    if (!named || !read_vector(node["p_Root_m"], 10.0, one.p_Root_m) ||
        !read_vector(node["offset_m"], 1.0, one.offset_m)) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}:{}: expected {{action, object, p_Root_m: [x, y, z], offset_m: [x, y, z]}}",
                               path.string(), node.Mark().line + 1)};
    }
    one.action = node["action"].as<std::string>();
    one.object = node["object"].as<std::string>();
    memory.learned_.push_back(std::move(one));
  }
  return memory;
}

Status CorrectionMemory::save(const std::filesystem::path& path) const {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "corrections" << YAML::Value << YAML::BeginSeq;
  for (const Learned& one : learned_) {
    const auto list = [](const Eigen::Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "action" << YAML::Value << one.action << YAML::Key
        << "object" << YAML::Value << one.object << YAML::Key << "p_Root_m" << YAML::Value << YAML::Flow
        << list(one.p_Root_m) << YAML::Key << "offset_m" << YAML::Value << YAML::Flow << list(one.offset_m)
        << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  const std::filesystem::path part = path.string() + ".part";
  std::ofstream file(part, std::ios::trunc);
  file << "# what people have corrected about reaches, by nido-reach\n" << out.c_str() << '\n';
  file.close();
  std::error_code trouble;
  if (file) std::filesystem::rename(part, path, trouble);
  if (!file || trouble) return Error{ErrorCode::kFailed, path.string() + " cannot be written"};
  return {};
}

}  // namespace nido::reach
