// nido-bench-cameras: what the eyes' pictures cost. Prints the rows of `nido bench cameras` (docs/cli.md).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nido/simulator/render/renderer.h"
#include "nido/simulator/simulation.h"

using namespace nido;
using namespace nido::sim;

namespace {

// One way to draw the same moment, and what it took.
struct Contender {
  std::string who;
  std::string metric;
  std::function<Status(const SceneSnapshot&)> draw;
  std::vector<double> wall_ms;
  std::vector<double> processor_ms;
};

double processor_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

int fail(const Error& error) {
  std::cerr << error.message << '\n';
  return error.code == ErrorCode::kNotFound ? 3 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string urdf = "config/robots/icub.urdf";
  std::string world = "config/worlds/table.yaml";
  int count = 100;
  bool json = false;
  CLI::App app{"Measures the eyes' pictures. Example: nido-bench-cameras --json"};
  app.add_option("--urdf", urdf);
  app.add_option("--world", world);
  app.add_option("-n,--count", count, "moments to draw")->check(CLI::Range(1, 100000));
  app.add_flag("--json", json);
  CLI11_PARSE(app, argc, argv);

  SimulationOptions options;
  options.urdf_path = urdf;
  options.world_path = world;
  auto made = Simulation::create(options);
  if (!made) return fail(made.error());
  Simulation& simulation = **made;
  // the head looks down at the table, and the arms move to and fro
  const int head = simulation.part_index("head");
  const int arm = simulation.part_index("right_arm");
  std::vector<double> head_rad(simulation.joints(head).size(), 0.0);
  head_rad[0] = -0.6;
  head_rad[5] = 0.1;
  if (Status ok = simulation.place_joints(head, head_rad); !ok) return fail(ok.error());
  if (Status ok = simulation.command_all(head, JointMode::kPosition, head_rad); !ok) return fail(ok.error());

  std::vector<Renderer> renderers;
  for (const int samples : {4, 1, 4, 4}) {
    Result<Renderer> renderer = Renderer::create({.samples = samples});
    if (!renderer) return fail(renderer.error());
    renderers.push_back(std::move(*renderer));
  }
  Image picture;
  const auto eye = [&](Eye which, int height) {
    Camera camera;
    camera.X_WorldCamera = simulation.X_WorldCamera(which);
    const double scale = height / 240.0;
    camera.width = static_cast<int>(320 * scale);
    camera.height = height;
    camera.fx_px = camera.fy_px = 257.34 * scale;
    camera.cx_px = 160 * scale;
    camera.cy_px = 120 * scale;
    return camera;
  };
  const auto pair = [&](Renderer& left, Renderer& right, int height, const SceneSnapshot& scene) -> Status {
    if (Status ok = left.setScene(scene); !ok) return ok;
    if (Status ok = left.render(eye(Eye::kLeft, height), picture); !ok) return ok;
    if (&left != &right) {
      if (Status ok = right.setScene(scene); !ok) return ok;
    }
    return right.render(eye(Eye::kRight, height), picture);
  };
  std::vector<Contender> contenders = {
      {"nido",
       "eyes_320x240",
       [&](const SceneSnapshot& s) { return pair(renderers[0], renderers[0], 240, s); },
       {},
       {}},
      {"nido, 1 sample a pixel",
       "eyes_320x240",
       [&](const SceneSnapshot& s) { return pair(renderers[1], renderers[1], 240, s); },
       {},
       {}},
      {"one renderer an eye",
       "eyes_320x240",
       [&](const SceneSnapshot& s) { return pair(renderers[2], renderers[3], 240, s); },
       {},
       {}},
      {"nido",
       "eyes_640x480",
       [&](const SceneSnapshot& s) { return pair(renderers[0], renderers[0], 480, s); },
       {},
       {}},
  };
  using Clock = std::chrono::steady_clock;
  SceneSnapshot scene;
  constexpr int kWarmUp = 3;  // shaders are compiled for the first pictures
  for (int i = -kWarmUp; i < count; ++i) {
    const std::vector<int> joints = {0, 3};
    const double way = (i / 20) % 2 == 0 ? 0.2 : -0.2;
    const std::vector<double> target_rad = {-0.5 + way, 0.9 + way};
    if (Status ok = simulation.command(arm, JointMode::kPosition, joints, target_rad); !ok)
      return fail(ok.error());
    if (Status ok = simulation.step(0.03); !ok) return fail(ok.error());
    simulation.scene(scene);
    for (Contender& contender : contenders) {  // interleaved: the machine's moods hit all alike
      // what another contender left is not to be taken for an unchanged scene
      scene.instances.front().X_WorldShape.translation().z() += 1e-9;
      const double processor_start_ms = processor_ms();
      const auto start = Clock::now();
      if (Status ok = contender.draw(scene); !ok) return fail(ok.error());
      if (i < 0) continue;
      contender.wall_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
      contender.processor_ms.push_back(processor_ms() - processor_start_ms);
    }
  }

  nlohmann::json rows = nlohmann::json::array();
  for (const Contender& contender : contenders) {
    const auto row = [&](const std::string& suffix, double value) {
      rows.push_back({{"who", contender.who},
                      {"metric", contender.metric + suffix},
                      {"value", value},
                      {"unit", "ms"},
                      {"n", count}});
    };
    row("_p50", quantile(contender.wall_ms, 0.5));
    row("_p99", quantile(contender.wall_ms, 0.99));
    row("_processor_p50", quantile(contender.processor_ms, 0.5));
  }
  if (json) {
    std::cout << nlohmann::json{{"bench", "cameras"}, {"rows", rows}}.dump() << '\n';
  } else {
    for (const auto& row : rows) {
      std::cout << row["who"].get<std::string>() << "  " << row["metric"].get<std::string>() << "  "
                << row["value"].get<double>() << " " << row["unit"].get<std::string>() << '\n';
    }
  }
  return 0;
}
