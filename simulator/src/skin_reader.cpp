#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <sstream>

#include "skin.h"

namespace nido::sim {
namespace {

using Element = const tinyxml2::XMLElement*;

// A triangle of an iCub's skin: twelve sensors in rows of 4, 3, 2 and 1 and two under them, which measure the
// temperature. Its values on the port are twelve in a row.
constexpr std::size_t kValuesOfTriangle = 12;
constexpr std::size_t kThermal1 = 6;
constexpr std::size_t kThermal2 = 10;
constexpr double kPitch_m = 0.0065;
constexpr std::size_t kMostValues = 12000;
constexpr double kFarthest_m = 10;

// where the ten taxels lie in the triangle's plane, its tip along y
std::vector<Eigen::Vector3d> places_in_triangle() {
  const double row_m = kPitch_m * std::sqrt(3.0) / 2;
  std::vector<Eigen::Vector3d> places;
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i < 4 - row; ++i) {
      // the middle of all ten is the origin
      places.emplace_back((i - (3 - row) / 2.0) * kPitch_m, (row - 1) * row_m, 0);
    }
  }
  return places;
}

struct Reader {
  const RobotModel& model;
  std::string source;
  std::vector<SkinPatch> patches{};
  std::string trouble{};

  bool refuse(Element element, const std::string& sentence) {
    trouble = source + ", line " + std::to_string(element->GetLineNum()) + ": " + sentence;
    return false;
  }

  bool text(Element element, const char* name, std::string& out) {
    const char* value = element->Attribute(name);
    if (value == nullptr || *value == '\0')
      return refuse(element, std::string("<") + element->Name() + "> needs the attribute \"" + name + "\"");
    out = value;
    return true;
  }

  bool count(Element element, const char* name, std::size_t most, std::size_t& out) {
    std::string written;
    if (!text(element, name, written)) return false;
    unsigned value = 0;
    if (element->QueryUnsignedAttribute(name, &value) != tinyxml2::XML_SUCCESS || value > most ||
        written.find_first_not_of("0123456789") != std::string::npos) {
      return refuse(element, std::string("attribute \"") + name + "\" of <" + element->Name() + "> is \"" +
                                 written + "\", but should be a whole number up to " + std::to_string(most));
    }
    out = value;
    return true;
  }

  bool vector(Element element, const char* name, Eigen::Vector3d& out) {
    std::string written;
    if (!text(element, name, written)) return false;
    std::istringstream words(written);
    std::string more;
    if (!(words >> out.x() >> out.y() >> out.z()) || words >> more || !out.allFinite() ||
        out.cwiseAbs().maxCoeff() > kFarthest_m) {
      return refuse(element, std::string("attribute \"") + name + "\" of <" + element->Name() + "> is \"" +
                                 written + "\", but should be three numbers within 10");
    }
    return true;
  }

  bool read_triangle(Element element, SkinPatch& patch, std::set<std::size_t>& known) {
    std::size_t number = 0;
    Eigen::Vector3d xyz;
    Eigen::Vector3d rpy;
    if (!count(element, "number", patch.values / kValuesOfTriangle - 1, number) ||
        !vector(element, "xyz", xyz) || !vector(element, "rpy", rpy))
      return false;
    if (!known.insert(number).second)
      return refuse(element, "patch \"" + patch.name + "\" has two triangles " + std::to_string(number));
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                                  .toRotationMatrix();
    std::size_t next = 0;
    const std::vector<Eigen::Vector3d> places = places_in_triangle();
    for (std::size_t i = 0; i < kValuesOfTriangle; ++i) {
      if (i == kThermal1 || i == kThermal2) continue;
      patch.taxels.push_back(
          {static_cast<int>(number * kValuesOfTriangle + i), xyz + R * places[next++], R.col(2)});
    }
    return true;
  }

  bool read_patch(Element element) {
    SkinPatch patch;
    if (!text(element, "name", patch.name) || !text(element, "link", patch.link) ||
        !count(element, "values", kMostValues, patch.values))
      return false;
    if (patch.values == 0 || patch.values % kValuesOfTriangle != 0)
      return refuse(element, "a patch has twelve values a triangle, not " + std::to_string(patch.values));
    if (const auto found = model.link_index(patch.link); !found)
      return refuse(element, found.error().message);
    for (const SkinPatch& other : patches) {
      if (other.name == patch.name) return refuse(element, "there are two patches \"" + patch.name + "\"");
      if (other.link == patch.link) return refuse(element, "link \"" + patch.link + "\" wears two patches");
    }
    std::set<std::size_t> known;
    for (Element e = element->FirstChildElement("triangle"); e != nullptr;
         e = e->NextSiblingElement("triangle")) {
      if (!read_triangle(e, patch, known)) return false;
    }
    if (patch.taxels.empty()) return refuse(element, "patch \"" + patch.name + "\" has no triangle");
    std::sort(patch.taxels.begin(), patch.taxels.end(),
              [](const Taxel& a, const Taxel& b) { return a.value < b.value; });
    patches.push_back(std::move(patch));
    return true;
  }
};

}  // namespace

Result<std::vector<SkinPatch>> read_skin(const RobotModel& model, const std::filesystem::path& urdf_path) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(urdf_path.c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr)
    return Error{ErrorCode::kInvalidArgument, urdf_path.string() + " cannot be read as XML"};
  Reader reader{model, urdf_path.string()};
  const Element block = document.RootElement()->FirstChildElement("nido");
  if (block == nullptr) return reader.patches;
  for (Element e = block->FirstChildElement("skin"); e != nullptr; e = e->NextSiblingElement("skin")) {
    if (!reader.read_patch(e)) return Error{ErrorCode::kInvalidArgument, reader.trouble};
  }
  return std::move(reader.patches);
}

}  // namespace nido::sim
