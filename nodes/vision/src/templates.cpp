#include "nido/vision/templates.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

namespace nido::vision {
namespace {

void normalise(Patch& patch) {
  float mean = 0;
  for (const float v : patch.values) mean += v;
  mean /= static_cast<float>(patch.values.size());
  float square = 0;
  for (float& v : patch.values) {
    v -= mean;
    square += v * v;
  }
  const float scale = square > 0 ? 1.0F / std::sqrt(square) : 0.0F;
  for (float& v : patch.values) v *= scale;
}

// What is wrong with a file, with the place.
struct Trouble {
  std::string sentence;
};

class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  [[noreturn]] void refuse(const YAML::Node& node, const std::string& sentence) const {
    const int line = node.Mark().line;
    throw Trouble{file_ + (line >= 0 ? ", line " + std::to_string(line + 1) : "") + ": " + sentence};
  }
  void allow(const YAML::Node& map, const std::set<std::string>& keys, const std::string& what) const {
    if (!map.IsMap()) refuse(map, what + " should be a map");
    for (const auto& entry : map) {
      const auto key = entry.first.as<std::string>();
      if (!keys.contains(key))
        refuse(entry.first,
               fmt::format("{} has no \"{}\"; allowed are {}", what, key, fmt::join(keys, ", ")));
    }
  }
  YAML::Node need(const YAML::Node& map, const std::string& key, const std::string& what) const {
    const YAML::Node value = map[key];
    if (!value) refuse(map, fmt::format("{} needs \"{}\"", what, key));
    return value;
  }
  std::string text(const YAML::Node& map, const std::string& key, const std::string& what) const {
    const YAML::Node value = need(map, key, what);
    if (!value.IsScalar() || value.Scalar().empty())
      refuse(value, fmt::format("\"{}\" of {} should be a text", key, what));
    return value.Scalar();
  }
  double number(const YAML::Node& value, double low, double high, const std::string& what) const {
    double result = 0;
    if (!value.IsScalar() || !YAML::convert<double>::decode(value, result) ||
        !(result >= low && result <= high)) {
      refuse(value, fmt::format("{} is \"{}\"; it should be a number from {} to {}", what,
                                value.IsScalar() ? value.Scalar() : "...", low, high));
    }
    return result;
  }
  double number(const YAML::Node& map, const std::string& key, double low, double high,
                const std::string& what) const {
    return number(need(map, key, what), low, high, fmt::format("\"{}\" of {}", key, what));
  }
  Eigen::Vector3d vector(const YAML::Node& value, std::size_t count, double low, double high,
                         const std::string& what) const {
    if (!value.IsSequence() || value.size() != count)
      refuse(value, fmt::format("{} should be a list of {} numbers", what, count));
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i)
      result[static_cast<Eigen::Index>(i)] = number(value[i], low, high, what);
    return result;
  }

 private:
  std::string file_;
};

ColourModel read_colour(const Reader& reader, const YAML::Node& node) {
  const std::string what = "a colour";
  reader.allow(
      node, {"name", "hue_deg", "hue_tolerance_deg", "saturation_min", "saturation_max", "value_min"}, what);
  ColourModel colour;
  colour.name = reader.text(node, "name", what);
  colour.hue_deg = reader.number(node, "hue_deg", 0, 360, what);
  colour.hue_tolerance_deg = reader.number(node, "hue_tolerance_deg", 1, 60, what);
  colour.saturation_min = reader.number(node, "saturation_min", 0, 1, what);
  colour.saturation_max = reader.number(node, "saturation_max", 0, 1, what);
  colour.value_min = reader.number(node, "value_min", 0, 1, what);
  return colour;
}

Solid read_solid(const Reader& reader, const YAML::Node& node) {
  const std::string what = "a solid";
  reader.allow(node, {"box_m", "sphere_m", "cylinder_m", "at_m"}, what);
  Solid solid;
  int kinds = 0;
  if (const auto box = node["box_m"]) {
    ++kinds;
    solid.kind = Solid::Kind::kBox;
    solid.size_m = reader.vector(box, 3, 1e-4, 2, "box_m");
  }
  if (const auto sphere = node["sphere_m"]) {
    ++kinds;
    solid.kind = Solid::Kind::kSphere;
    solid.size_m[0] = reader.number(sphere, 1e-4, 1, "sphere_m");
  }
  if (const auto cylinder = node["cylinder_m"]) {
    ++kinds;
    solid.kind = Solid::Kind::kCylinder;
    solid.size_m = reader.vector(cylinder, 2, 1e-4, 2, "cylinder_m");
  }
  if (kinds != 1) reader.refuse(node, "a solid needs one of box_m, sphere_m, cylinder_m");
  if (const auto at = node["at_m"]) solid.p_BodySolid_m = reader.vector(at, 3, -1, 1, "at_m");
  return solid;
}

// A patch is one line of letters, 'a' darkest to 'z' brightest: small in the file and readable as a picture
// when wrapped.
constexpr int kLevels = 26;

Patch read_patch(const Reader& reader, const YAML::Node& node) {
  Patch patch;
  const std::string letters = node.IsScalar() ? node.Scalar() : "";
  if (letters.size() != patch.values.size()) {
    reader.refuse(
        node, fmt::format("a patch is a text of {} letters, found {}", patch.values.size(), letters.size()));
  }
  for (std::size_t i = 0; i < letters.size(); ++i) {
    if (letters[i] < 'a' || letters[i] > 'z') reader.refuse(node, "a patch has letters from a to z only");
    patch.values[i] = static_cast<float>(letters[i] - 'a');
  }
  normalise(patch);
  return patch;
}

std::string write_patch(const Patch& patch) {
  const auto [low, high] = std::minmax_element(patch.values.begin(), patch.values.end());
  const float span = std::max(*high - *low, 1e-9F);
  std::string letters;
  for (const float v : patch.values) {
    letters += static_cast<char>('a' + std::lround((v - *low) / span * static_cast<float>(kLevels - 1)));
  }
  return letters;
}

ObjectTemplate read_object(const Reader& reader, const YAML::Node& node, const TemplateSet& set) {
  const std::string what = "an object";
  reader.allow(node, {"name", "colour", "shape", "symmetry_deg", "body", "patches"}, what);
  ObjectTemplate object;
  object.name = reader.text(node, "name", what);
  object.colour = reader.text(node, "colour", what);
  object.shape = reader.text(node, "shape", what);
  if (set.colour_index(object.colour) < 0) {
    reader.refuse(node["colour"], fmt::format("there is no colour \"{}\" in this file", object.colour));
  }
  object.body.symmetry_rad = reader.number(node, "symmetry_deg", 0, 360, what) * M_PI / 180;
  const YAML::Node body = reader.need(node, "body", what);
  if (!body.IsSequence() || body.size() == 0) reader.refuse(body, "\"body\" should be a list of solids");
  for (const auto& solid : body) object.body.solids.push_back(read_solid(reader, solid));
  if (const YAML::Node patches = node["patches"]) {
    if (!patches.IsSequence()) reader.refuse(patches, "\"patches\" should be a list");
    for (const auto& patch : patches) object.patches.push_back(read_patch(reader, patch));
  }
  return object;
}

}  // namespace

Patch cut_patch(const Image& image, const Blob& blob, const ColourTable& table) {
  // area sampling: every pixel of the box adds to the cell that holds its centre, by nearest cells when the
  // box is small
  Patch patch;
  const double width = blob.right - blob.left + 1;
  const double height = blob.bottom - blob.top + 1;
  constexpr int kSub = 2;  // samples a cell along each side
  for (int cell_y = 0; cell_y < Patch::kSide; ++cell_y) {
    for (int cell_x = 0; cell_x < Patch::kSide; ++cell_x) {
      float sum = 0;
      for (int s = 0; s < kSub * kSub; ++s) {
        const double fx = (cell_x + (s % kSub + 0.5) / kSub) / Patch::kSide;
        const double fy = (cell_y + (s / kSub + 0.5) / kSub) / Patch::kSide;
        const int x = std::min(blob.right, blob.left + static_cast<int>(fx * width));
        const int y = std::min(blob.bottom, blob.top + static_cast<int>(fy * height));
        const std::uint8_t* p = image.rgb.data() + (static_cast<std::size_t>(y) * image.width + x) * 3;
        if (table.classify(p[0], p[1], p[2]) != blob.colour) continue;
        sum += static_cast<float>(std::max({p[0], p[1], p[2]}));
      }
      patch.values[static_cast<std::size_t>(cell_y * Patch::kSide + cell_x)] = sum;
    }
  }
  normalise(patch);
  return patch;
}

double correlation(const Patch& a, const Patch& b) {
  float sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) sum += a.values[i] * b.values[i];
  return sum;
}

int TemplateSet::colour_index(const std::string& name) const {
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (colours[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

Result<TemplateSet> TemplateSet::load(const std::filesystem::path& path) {
  const Reader reader(path.string());
  try {
    const YAML::Node file = YAML::LoadFile(path.string());
    TemplateSet set;
    reader.allow(file, {"colours", "marks", "objects"}, "the file");
    for (const auto& colour : reader.need(file, "colours", "the file")) {
      set.colours.push_back(read_colour(reader, colour));
      if (set.colour_index(set.colours.back().name) != static_cast<int>(set.colours.size()) - 1) {
        reader.refuse(colour, fmt::format("colour \"{}\" is named twice", set.colours.back().name));
      }
    }
    if (set.colours.size() > 200) reader.refuse(file["colours"], "at most 200 colours are allowed");
    const YAML::Node marks = reader.need(file, "marks", "the file");
    reader.allow(marks, {"knuckle", "wrist"}, "\"marks\"");
    set.knuckle_colour = reader.text(marks, "knuckle", "\"marks\"");
    set.wrist_colour = reader.text(marks, "wrist", "\"marks\"");
    for (const std::string& colour : {set.knuckle_colour, set.wrist_colour}) {
      if (set.colour_index(colour) < 0)
        reader.refuse(marks, fmt::format("there is no colour \"{}\" in this file", colour));
    }
    for (const auto& object : reader.need(file, "objects", "the file"))
      set.objects.push_back(read_object(reader, object, set));
    return set;
  } catch (const Trouble& trouble) {
    return Error{ErrorCode::kInvalidArgument, trouble.sentence};
  } catch (const YAML::BadFile&) {
    return Error{ErrorCode::kNotFound, "there is no file of templates \"" + path.string() + "\""};
  } catch (const YAML::Exception& trouble) {
    return Error{ErrorCode::kInvalidArgument,
                 path.string() + ", line " + std::to_string(trouble.mark.line + 1) + ": " + trouble.msg};
  }
}

void TemplateSet::add(const TemplateSet& other) {
  for (const ColourModel& colour : other.colours) {
    if (colour_index(colour.name) < 0) colours.push_back(colour);
  }
  objects.insert(objects.end(), other.objects.begin(), other.objects.end());
}

TemplateSet TemplateSet::from(std::size_t first) const {
  TemplateSet rest = *this;
  rest.objects.erase(rest.objects.begin(),
                     rest.objects.begin() + static_cast<std::ptrdiff_t>(std::min(first, objects.size())));
  return rest;
}

Status TemplateSet::save(const std::filesystem::path& path) const {
  const std::filesystem::path part = path.string() + ".part";
  std::ofstream file(part);
  file << to_yaml();
  file.close();
  std::error_code failure;
  if (file) std::filesystem::rename(part, path, failure);
  if (!file || failure) return Error{ErrorCode::kFailed, "cannot write " + path.string()};
  return {};
}

std::string TemplateSet::to_yaml() const {
  std::string text = "colours:\n";
  for (const ColourModel& c : colours) {
    text += fmt::format(
        "  - {{name: {}, hue_deg: {:.1f}, hue_tolerance_deg: {:.1f}, saturation_min: {:.2f}, saturation_max: "
        "{:.2f}, value_min: {:.2f}}}\n",
        c.name, c.hue_deg, c.hue_tolerance_deg, c.saturation_min, c.saturation_max, c.value_min);
  }
  text += fmt::format("marks: {{knuckle: {}, wrist: {}}}\nobjects:\n", knuckle_colour, wrist_colour);
  for (const ObjectTemplate& o : objects) {
    text += fmt::format("  - name: {}\n    colour: {}\n    shape: {}\n    symmetry_deg: {:g}\n    body:\n",
                        o.name, o.colour, o.shape, o.body.symmetry_rad * 180 / M_PI);
    for (const Solid& s : o.body.solids) {
      const Eigen::Vector3d& at = s.p_BodySolid_m;
      std::string size;
      switch (s.kind) {
        case Solid::Kind::kBox:
          size = fmt::format("box_m: [{:g}, {:g}, {:g}]", s.size_m[0], s.size_m[1], s.size_m[2]);
          break;
        case Solid::Kind::kSphere:
          size = fmt::format("sphere_m: {:g}", s.size_m[0]);
          break;
        case Solid::Kind::kCylinder:
          size = fmt::format("cylinder_m: [{:g}, {:g}]", s.size_m[0], s.size_m[1]);
          break;
      }
      text += fmt::format("      - {{{}, at_m: [{:g}, {:g}, {:g}]}}\n", size, at[0], at[1], at[2]);
    }
    if (o.patches.empty()) continue;
    text += "    patches:\n";
    for (const Patch& p : o.patches) text += "      - " + write_patch(p) + "\n";
  }
  return text;
}

}  // namespace nido::vision
