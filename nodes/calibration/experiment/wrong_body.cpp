#include "wrong_body.h"

#include <fstream>
#include <random>
#include <sstream>
#include <system_error>

#include "nido/calibration/self_calibration.h"

namespace nido::calibration {
namespace {

constexpr double kRadPerDeg = static_cast<double>(EIGEN_PI) / 180.0;

}  // namespace

BodyCorrections draw_wrong_body(std::uint64_t seed, const std::string& side) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto off = [&](double deviation) {
    double drawn = normal(random);
    while (std::abs(drawn) > 2.5) drawn = normal(random);
    return deviation * drawn;
  };
  BodyCorrections body;
  for (const Unknown& unknown : default_unknowns(side)) {
    if (unknown.link == wrist_mark(side)) continue;
    LinkCorrection& link = body.links[unknown.link];
    const bool is_eye = unknown.link == "l_eye" || unknown.link == "r_eye";
    if (unknown.component < 3) {
      link.p_m(unknown.component) = off(is_eye ? 0.002 : 0.003);
    } else {
      link.turn_rad(unknown.component - 3) = off((is_eye ? 1.5 : 2.5) * kRadPerDeg);
    }
  }
  return body;
}

Status write_robot(const std::filesystem::path& robots, const BodyCorrections& body,
                   const std::filesystem::path& folder) {
  const auto failed = [&](const std::filesystem::path& path) {
    return Error{ErrorCode::kFailed, path.string() + " cannot be written"};
  };
  std::error_code trouble;
  std::filesystem::create_directories(folder, trouble);
  std::ifstream drawn(robots / "icub.urdf");
  std::ostringstream text;
  text << drawn.rdbuf();
  const auto urdf = corrected_urdf(text.str(), (robots / "icub.urdf").string(), body);
  if (!urdf) return urdf.error();
  std::ofstream file(folder / "icub.urdf", std::ios::trunc);
  file << *urdf;
  file.close();
  if (!file) return failed(folder / "icub.urdf");
  for (const char* const name : {"icub_sim.yaml", "icub_sim_babbling.yaml"}) {
    std::filesystem::copy_file(robots / name, folder / name,
                               std::filesystem::copy_options::overwrite_existing, trouble);
    if (trouble) return failed(folder / name);
  }
  std::filesystem::remove(folder / "meshes", trouble);
  std::filesystem::create_directory_symlink(std::filesystem::absolute(robots) / "meshes", folder / "meshes",
                                            trouble);
  if (trouble) return failed(folder / "meshes");
  return body.save(folder / "real_body.yaml",
                   "how this body is built, beside its drawing: for the experimenter alone");
}

}  // namespace nido::calibration
