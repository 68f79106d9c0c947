#include "scenes.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <random>

#include "nido/simulator/render/picture_noise.h"

namespace nido::test {

RandomTable random_table(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) / 9007199254740992.0);
  };
  struct Thing {
    std::string name, text;
  };
  std::vector<Thing> things;
  for (const char* colour : {"blue", "red", "green"}) {
    for (const char* shape : {"cube", "ball"}) {
      things.push_back(
          {std::string(colour) + " " + shape, std::string("object: ") + shape + ", colour: " + colour});
    }
  }
  things.push_back({"teddy bear", "object: bear"});
  for (std::size_t i = things.size(); i-- > 1;) std::swap(things[i], things[random() % (i + 1)]);
  things.resize(static_cast<std::size_t>(count));

  RandomTable table;
  std::vector<std::array<double, 3>> taken;  // x, y, radius
  std::vector<std::string> lines;
  const auto put = [&](const Thing& thing, double radius, double x0, double x1, double y0, double y1) {
    for (int attempt = 0; attempt < 200; ++attempt) {
      const double x = between(x0, x1);
      const double y = between(y0, y1);
      const bool free = std::all_of(taken.begin(), taken.end(), [&](const auto& t) {
        return std::hypot(t[0] - x, t[1] - y) > t[2] + radius;
      });
      if (!free) continue;
      taken.push_back({x, y, radius});
      const double yaw_deg = between(-180, 180);
      lines.push_back("{" + thing.text + ", name: " + thing.name + ", position_m: [" + std::to_string(x) +
                      ", " + std::to_string(y) + "], yaw_deg: " + std::to_string(yaw_deg) + "}");
      table.names.push_back(thing.name);
      return;
    }
  };
  put({"basket", "object: basket"}, 0.13, -0.36, -0.30, random() % 2 == 0 ? 0.22 : -0.16,
      random() % 2 == 0 ? 0.24 : -0.14);
  for (const Thing& thing : things) put(thing, 0.05, -0.40, -0.23, -0.08, 0.24);
  table.yaml = table_world(lines);
  return table;
}

Accuracy measure_accuracy(int tables, std::uint64_t first_seed, const vision::TemplateSet& templates,
                          bool verbose, const Hardship& hardship) {
  Accuracy result;
  std::array<sim::PictureNoise, 2> noise = {
      need(sim::PictureNoise::create({.noise_levels = hardship.noise_levels, .seed = first_seed})),
      need(sim::PictureNoise::create({.noise_levels = hardship.noise_levels, .seed = first_seed + 1}))};
  for (int t = 0; t < tables; ++t) {
    const RandomTable table = random_table(first_seed + static_cast<std::uint64_t>(t), 4);
    std::string yaml = table.yaml;
    const std::string height = "-0.0826";
    yaml.replace(yaml.find(height), height.size(), std::to_string(-0.0826 + hardship.table_up_m));
    yaml += "light: {brightness: " + std::to_string(hardship.brightness) + "}\n";
    Stage stage(yaml, first_seed);
    stage.place("right_arm", {0, 80, 0, 50, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10});
    stage.place("left_arm", {0, 80, 0, 50, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10});
    auto core = need(vision::VisionCore::create(stage.model(), templates, {}));
    stage.look_at({-0.31, 0.06, -0.06});
    vision::VisionOutputs out;
    for (int frame = 0; frame < 5; ++frame) {
      if (!stage.simulation().step(0.03).ok()) break;
      auto inputs = stage.inputs(true);
      if (hardship.noise_levels > 0) {
        noise[0].apply(*inputs.left, static_cast<std::uint64_t>(t * 5 + frame));
        noise[1].apply(*inputs.right, static_cast<std::uint64_t>(t * 5 + frame));
      }
      const auto begin = std::chrono::steady_clock::now();
      out = core->step(Time{stage.simulation().time_ns()}, std::move(inputs));
      result.step_ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
    std::vector<bool> used(out.objects.size(), false);
    for (const std::string& name : table.names) {
      const Stage::Truth truth = stage.truth(name);
      // in view of both eyes, with room for its size
      bool in_view = true;
      for (const auto eye : {sim::Eye::kLeft, sim::Eye::kRight}) {
        const auto px =
            PinholeCamera{}.project(stage.simulation().X_WorldCamera(eye).inverse() * truth.p_Root_m);
        in_view = in_view && px && PinholeCamera{}.contains(*px, name == "basket" ? 70 : 25);
      }
      if (!in_view) continue;
      ++result.expected;
      bool found = false;
      for (std::size_t i = 0; i < out.objects.size(); ++i) {
        const auto& object = out.objects[i];
        const double error_m = (object.p_RootObject_m - truth.p_Root_m).norm();
        if (object.name != name || error_m > 0.04) continue;
        used[i] = true;
        if (found) continue;
        found = true;
        ++result.found;
        result.position_error_m.push_back(error_m);
        result.position_error_by_name_m[name].push_back(error_m);
        const double period = object.shape == "cube" || object.shape == "basket" ? M_PI / 2 : 0;
        if (period > 0)
          result.yaw_error_rad.push_back(std::abs(std::remainder(object.yaw_rad - truth.yaw_rad, period)));
        if (verbose) {
          const Eigen::Vector3d e = (object.p_RootObject_m - truth.p_Root_m) * 1000;
          std::printf("%2d %-11s conf %.2f error %5.1f mm (%5.1f %5.1f %5.1f) yaw error %5.1f deg\n", t,
                      name.c_str(), object.confidence, error_m * 1000, e.x(), e.y(), e.z(),
                      period > 0 ? result.yaw_error_rad.back() * 180 / M_PI : 0.0);
        }
      }
      if (!found && verbose)
        std::printf("%2d %-11s MISSED at %.3f %.3f\n", t, name.c_str(), truth.p_Root_m.x(),
                    truth.p_Root_m.y());
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
      const auto& object = out.objects[i];
      bool there = used[i];
      for (const std::string& name : table.names) {
        there = there ||
                (name == object.name && (stage.truth(name).p_Root_m - object.p_RootObject_m).norm() < 0.04);
      }
      if (there) continue;
      ++result.false_names;
      if (verbose) {
        std::printf("%2d FALSE %s conf %.2f at %.3f %.3f %.3f\n", t, object.name.c_str(), object.confidence,
                    object.p_RootObject_m.x(), object.p_RootObject_m.y(), object.p_RootObject_m.z());
      }
    }
  }
  return result;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace nido::test
