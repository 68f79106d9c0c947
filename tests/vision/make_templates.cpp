// Learns how things look from rendered views and writes config/objects/templates.yaml:
//
//     build/bin/make_vision_templates config/objects/templates.yaml
//
// Shapes come from config/objects/NAME.yaml; colours and pictures from views of each thing alone on the
// table, in several places, turns and lights. The renderer's instance picture says which pixels belong to the
// thing, as a person would outline it.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <set>

#include "stage.h"

namespace nido {
namespace {

using test::Stage;
using vision::Body;
using vision::ColourModel;
using vision::Hsv;
using vision::ObjectTemplate;
using vision::Solid;

struct Lesson {
  std::string name, colour, shape, file, world_line;
  double symmetry_deg;
};

Eigen::Vector3d read_vector(const YAML::Node& node) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < node.size(); ++i) v[static_cast<Eigen::Index>(i)] = node[i].as<double>();
  return v;
}

// Solids of an object file, about the middle of their common box.
Body read_body(const std::string& file, double symmetry_deg) {
  Body body;
  body.symmetry_rad = symmetry_deg * M_PI / 180;
  for (const auto& shape : YAML::LoadFile(file)["shapes"]) {
    Solid solid;
    const std::string kind = shape["shape"].as<std::string>();
    solid.size_m = read_vector(shape["size_m"]);
    if (shape["position_m"]) solid.p_BodySolid_m = read_vector(shape["position_m"]);
    solid.kind = kind == "box"        ? Solid::Kind::kBox
                 : kind == "cylinder" ? Solid::Kind::kCylinder
                                      : Solid::Kind::kSphere;
    if (kind == "capsule") {
      const double half_m = solid.size_m[1] / 2;
      solid.size_m = {solid.size_m[0], 0, 0};
      solid.p_BodySolid_m.z() += half_m;
      body.solids.push_back(solid);
      solid.p_BodySolid_m.z() -= 2 * half_m;
    }
    body.solids.push_back(solid);
  }
  // a box of five plates has the outline of its whole: keep the four walls, drop nothing
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  for (const Solid& solid : body.solids) {
    const Body single{{solid}, 0};
    const Eigen::Vector3d half = single.extents_m() / 2;
    low = low.cwiseMin(solid.p_BodySolid_m - half);
    high = high.cwiseMax(solid.p_BodySolid_m + half);
  }
  for (Solid& solid : body.solids) solid.p_BodySolid_m -= (low + high) / 2;
  return body;
}

struct PixelStatistics {
  std::vector<Hsv> inside;

  // Pixels of the wanted instances whose neighbours are wanted too.
  void add(const Image& image, const sim::DepthImage& depth, const std::set<std::uint32_t>& wanted) {
    const auto is_wanted = [&](int x, int y) {
      return wanted.contains(depth.instance[static_cast<std::size_t>(y) * depth.width + x]);
    };
    for (int y = 1; y + 1 < image.height; ++y) {
      for (int x = 1; x + 1 < image.width; ++x) {
        bool all = true;
        for (int k = 0; k < 9 && all; ++k) all = is_wanted(x + k % 3 - 1, y + k / 3 - 1);
        if (!all) continue;
        const std::uint8_t* p = image.rgb.data() + (static_cast<std::size_t>(y) * image.width + x) * 3;
        inside.push_back(vision::to_hsv(p[0] / 255.0, p[1] / 255.0, p[2] / 255.0));
      }
    }
  }
};

double quantile(std::vector<double> values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

ColourModel learn_colour(const std::string& name, const PixelStatistics& pixels) {
  double c = 0;
  double s = 0;
  for (const Hsv& p : pixels.inside) {
    c += p.saturation * std::cos(p.hue_deg * M_PI / 180);
    s += p.saturation * std::sin(p.hue_deg * M_PI / 180);
  }
  ColourModel colour;
  colour.name = name;
  colour.hue_deg = std::atan2(s, c) * 180 / M_PI;
  if (colour.hue_deg < 0) colour.hue_deg += 360;
  std::vector<double> off, saturation, value;
  for (const Hsv& p : pixels.inside) {
    off.push_back(vision::hue_distance_deg(p.hue_deg, colour.hue_deg));
    saturation.push_back(p.saturation);
    value.push_back(p.value);
  }
  colour.hue_tolerance_deg = std::clamp(quantile(off, 0.995) + 4.0, 8.0, 25.0);
  // half way between the thing and a colourless ground, so that a pixel half covered by the thing's edge is
  // at the limit
  colour.saturation_min =
      std::min(quantile(saturation, 0.005) - 0.05, 0.5 * quantile(saturation, 0.5) + 0.06);
  colour.saturation_max = std::min(1.0, quantile(saturation, 0.999) + 0.08);
  colour.value_min = 0.6 * quantile(value, 0.005);
  std::cout << name << ": hue " << colour.hue_deg << " +- " << quantile(off, 0.995) << ", saturation "
            << quantile(saturation, 0.005) << " to " << quantile(saturation, 0.999) << ", value from "
            << quantile(value, 0.005) << ", " << pixels.inside.size() << " pixels\n";
  return colour;
}

const std::vector<std::array<double, 2>> kPlaces = {
    {-0.29, 0.05}, {-0.26, 0.18}, {-0.38, -0.08}, {-0.42, 0.15}};

template <class Visit>
void for_views(const Lesson& lesson, int turns, Visit visit) {
  for (const auto& place : kPlaces) {
    for (int turn = 0; turn < turns; ++turn) {
      const double yaw_deg = lesson.symmetry_deg > 0 ? turn * lesson.symmetry_deg / turns : 0;
      Stage stage(test::table_world({"{object: " + lesson.world_line + ", name: thing, position_m: [" +
                                     std::to_string(place[0]) + ", " + std::to_string(place[1]) +
                                     "], yaw_deg: " + std::to_string(yaw_deg) + "}"}));
      stage.place("right_arm", {0, 80, 0, 50, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10});
      stage.look_at({-0.31, 0.08, -0.06});
      visit(stage);
      if (lesson.symmetry_deg <= 0) break;
    }
  }
}

std::set<std::uint32_t> instances_of(const sim::SceneSnapshot& scene, const std::string& name) {
  std::set<std::uint32_t> wanted;
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].name == name) wanted.insert(static_cast<std::uint32_t>(i + 1));
  }
  return wanted;
}

// A box whose edges and corners are worn by `bevel_m`: the hull of three boxes, each whole along one axis.
Body worn_box(const Body& box, double bevel_m) {
  Body worn = box;
  worn.solids.clear();
  for (int axis = 0; axis < 3; ++axis) {
    Solid solid = box.solids.front();
    solid.size_m.array() -= 2 * bevel_m;
    solid.size_m[axis] = box.solids.front().size_m[axis];
    worn.solids.push_back(solid);
  }
  return worn;
}

// How worn a painted wooden cube is: what explains its outlines best.
Body learn_wear(const Body& box, const vision::TemplateSet& set, const Lesson& lesson) {
  const std::vector<double> bevels_m = {0, 0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003, 0.004};
  std::vector<double> agreement(bevels_m.size(), 0.0);
  vision::BlobFinder finder(vision::ColourTable(set.colours), 12);
  for_views(lesson, 3, [&](Stage& stage) {
    vision::OutlinePair outlines;
    vision::EyePair eyes;
    for (std::size_t e = 0; e < 2; ++e) {
      const auto eye = e == 0 ? sim::Eye::kLeft : sim::Eye::kRight;
      Image image;
      stage.render(eye, image);
      eyes[e] = {PinholeCamera{}, stage.simulation().X_WorldCamera(eye)};
      for (const vision::Blob& blob : finder.find(image)) {
        if (set.colours[blob.colour].name == lesson.colour && !blob.touches_border && outlines[e].empty())
          outlines[e] = blob.hull;
      }
    }
    if (outlines[0].empty() || outlines[1].empty()) return;
    const auto start = vision::meet(eyes, vision::centroid(outlines[0]), vision::centroid(outlines[1]), 0.02);
    if (!start) return;
    for (std::size_t i = 0; i < bevels_m.size(); ++i) {
      const auto fit = vision::fit_body(worn_box(box, bevels_m[i]), eyes, outlines, {*start, 0, 0}, true);
      if (fit) agreement[i] += fit->overlap;
    }
  });
  const auto best = std::max_element(agreement.begin(), agreement.end()) - agreement.begin();
  std::cout << lesson.name << ": edges worn by " << bevels_m[static_cast<std::size_t>(best)] * 1000
            << " mm\n";
  return worn_box(box, bevels_m[static_cast<std::size_t>(best)]);
}

ColourModel learn_mark(const std::string& colour, const std::string& link) {
  PixelStatistics pixels;
  for (const double shoulder_yaw : {20.0, 50.0}) {
    for (const double prosup : {-60.0, 0.0, 60.0}) {
      for (const double elbow : {60.0, 90.0}) {
        Stage stage(
            test::table_world({"{object: ball, name: thing, colour: red, position_m: [-0.4, -0.2]}"}));
        stage.place("right_arm",
                    {-40, 30, shoulder_yaw, elbow, prosup, -20, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10});
        stage.look_at({-0.28, 0.10, 0.0});
        for (const double brightness : {0.7, 1.0, 1.3}) {
          sim::Lighting light;
          light.brightness = brightness;
          (void)stage.renderer().setLighting(light);
          Image image;
          sim::DepthImage depth;
          stage.render(sim::Eye::kLeft, image);
          stage.render_depth(sim::Eye::kLeft, depth);
          pixels.add(image, depth, instances_of(stage.scene(), link));
        }
      }
    }
  }
  return learn_colour(colour, pixels);
}

int run(const std::string& target) {
  const std::string folder = std::string(NIDO_CONFIG_DIR) + "/objects/";
  std::vector<Lesson> lessons;
  for (const char* colour : {"blue", "red", "green"}) {
    lessons.push_back({std::string(colour) + " cube", colour, "cube", "cube.yaml",
                       std::string("cube, colour: ") + colour, 90});
    lessons.push_back({std::string(colour) + " ball", colour, "ball", "ball.yaml",
                       std::string("ball, colour: ") + colour, 0});
  }
  lessons.push_back({"teddy bear", "brown", "bear", "bear.yaml", "bear", 360});
  lessons.push_back({"basket", "orange", "basket", "basket.yaml", "basket", 90});

  vision::TemplateSet set;
  std::map<std::string, PixelStatistics> pixels;
  for (const Lesson& lesson : lessons) {
    for_views(lesson, lesson.symmetry_deg > 180 ? 6 : 2, [&](Stage& stage) {
      for (const double brightness : {0.7, 1.0, 1.3}) {
        sim::Lighting light;
        light.brightness = brightness;
        (void)stage.renderer().setLighting(light);
        Image image;
        sim::DepthImage depth;
        stage.render(sim::Eye::kLeft, image);
        stage.render_depth(sim::Eye::kLeft, depth);
        pixels[lesson.colour].add(image, depth, instances_of(stage.scene(), "thing"));
      }
    });
  }
  for (const char* colour : {"blue", "red", "green", "brown", "orange"})
    set.colours.push_back(learn_colour(colour, pixels[colour]));
  set.knuckle_colour = "magenta";
  set.wrist_colour = "cyan";
  set.colours.push_back(learn_mark("magenta", "r_hand_mark_knuckle"));
  set.colours.push_back(learn_mark("cyan", "r_hand_mark_wrist"));

  const vision::ColourTable table(set.colours);
  for (const Lesson& lesson : lessons) {
    ObjectTemplate object;
    object.name = lesson.name;
    object.colour = lesson.colour;
    object.shape = lesson.shape;
    object.body = read_body(folder + lesson.file, lesson.symmetry_deg);
    if (lesson.shape == "cube") object.body = learn_wear(object.body, set, lesson);
    vision::BlobFinder finder(table, 12);
    for_views(lesson, lesson.symmetry_deg > 180 ? 8 : 4, [&](Stage& stage) {
      Image image;
      stage.render(sim::Eye::kLeft, image);
      for (const vision::Blob& blob : finder.find(image)) {
        if (set.colours[blob.colour].name != lesson.colour || blob.touches_border) continue;
        const vision::Patch patch = vision::cut_patch(image, blob, table);
        // what a known picture already says need not be kept
        const bool known =
            std::any_of(object.patches.begin(), object.patches.end(),
                        [&](const vision::Patch& p) { return vision::correlation(p, patch) > 0.97; });
        if (!known) object.patches.push_back(patch);
        break;
      }
    });
    std::cout << lesson.name << ": " << object.patches.size() << " pictures\n";
    set.objects.push_back(object);
  }

  std::ofstream out(target);
  out << "# How things look, learned from views: written by make_vision_templates (docs/vision.md). Colours "
         "as hue, saturation and\n"
         "# value of stored pixels; bodies as solids about the middle of their box; patches of 16 x 16 "
         "letters from a (dark) to z.\n"
      << set.to_yaml();
  out.close();
  if (!out) {
    std::cerr << "cannot write " << target << '\n';
    return 3;
  }
  return 0;
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_vision_templates FILE.yaml\n";
    return 2;
  }
  return nido::run(argv[1]);
}
