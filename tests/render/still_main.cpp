// Draws the robot in a world once, to look at it: see docs/cameras.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <iostream>
#include <map>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "nido/simulator/render/renderer.h"
#include "nido/simulator/simulation.h"

using namespace nido;
using namespace nido::sim;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

int fail(const std::string& message) {
  std::cerr << message << '\n';
  return 1;
}

// "right_arm=-30,40,0,50": the first joints of a part in degrees; the others keep their place.
Status placeJoints(Simulation& simulation, const std::string& text) {
  const auto equals = text.find('=');
  const int part = equals == std::string::npos ? -1 : simulation.part_index(text.substr(0, equals));
  if (part < 0) return Error{ErrorCode::kInvalidArgument, "'" + text + "': expected PART=DEG,DEG,..."};
  std::vector<double> position_rad;
  for (const JointState& joint : simulation.joints(part)) position_rad.push_back(joint.position_rad);
  std::stringstream values(text.substr(equals + 1));
  std::string value;
  for (std::size_t i = 0; std::getline(values, value, ','); ++i) {
    if (i == position_rad.size())
      return Error{ErrorCode::kInvalidArgument, "'" + text + "': too many joints"};
    if (!value.empty()) position_rad[i] = std::stod(value) * kDegree;
  }
  return simulation.place_joints(part, position_rad);
}

}  // namespace

int main(int argc, char** argv) {
  std::string urdf = "config/robots/icub.urdf";
  std::string world = "config/worlds/table.yaml";
  std::string out = "still.png";
  std::string eye;
  std::vector<std::string> joints;
  std::vector<double> from = {-1.6, 0.9, 0.5};
  std::vector<double> to = {-0.1, 0.0, 0.0};
  std::vector<int> size = {640, 480};
  double fov_deg = 45;
  double brightness = 1;
  int bench = 0;
  CLI::App app{
      "Draws the robot in a world. Example: nido-render-still --joints head=-30 --eye left -o eye.png"};
  app.add_option("--urdf", urdf);
  app.add_option("--world", world, "world file; empty: only the floor");
  app.add_option("-o,--out", out, "PNG file");
  app.add_option("--joints", joints, "PART=DEG,DEG,... (several)");
  app.add_option("--eye", eye, "left or right: what this eye sees, 320x240");
  app.add_option("--from", from, "place of the outside camera, m")->expected(3);
  app.add_option("--to", to, "what it looks at, m")->expected(3);
  app.add_option("--size", size, "width and height")->expected(2);
  app.add_option("--fov", fov_deg, "vertical field of view of the outside camera");
  app.add_option("--brightness", brightness);
  app.add_option("--bench", bench, "draw both eyes so many times and print the median time");
  CLI11_PARSE(app, argc, argv);

  SimulationOptions options;
  options.urdf_path = urdf;
  options.world_path = world;
  auto simulation = Simulation::create(options);
  if (!simulation) return fail(simulation.error().message);
  for (const std::string& text : joints) {
    if (Status ok = placeJoints(**simulation, text); !ok) return fail(ok.error().message);
  }
  auto renderer = Renderer::create();
  if (!renderer) return fail(renderer.error().message);
  Lighting lighting;
  lighting.brightness = brightness;
  if (Status ok = renderer->setLighting(lighting); !ok) return fail(ok.error().message);
  SceneSnapshot scene;
  (*simulation)->scene(scene);
  if (Status ok = renderer->setScene(scene); !ok) return fail(ok.error().message);

  Camera camera =
      lookAt({from[0], from[1], from[2]}, {to[0], to[1], to[2]}, size[0], size[1], fov_deg * kDegree);
  if (!eye.empty()) {
    camera = Camera{};
    camera.X_WorldCamera = (*simulation)->X_WorldCamera(eye == "left" ? Eye::kLeft : Eye::kRight);
  }
  Image picture;
  if (Status ok = renderer->render(camera, picture); !ok) return fail(ok.error().message);
  cv::Mat bgr;
  cv::cvtColor(cv::Mat(picture.height, picture.width, CV_8UC3, picture.rgb.data()), bgr, cv::COLOR_RGB2BGR);
  if (!cv::imwrite(out, bgr)) return fail("cannot write " + out);

  if (bench > 0) {
    // processor time of this thread, so that other programs do not count
    const auto now_ms = [] {
      timespec time{};
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
      return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
    };
    std::map<std::string, std::vector<double>> times_ms;
    for (int i = 0; i < bench; ++i) {
      if (Status ok = (*simulation)->step(); !ok) return fail(ok.error().message);
      (*simulation)->scene(scene);
      double start_ms = now_ms();
      const auto lap = [&](const std::string& what) {
        const double now = now_ms();
        times_ms[what].push_back(now - start_ms);
        start_ms = now;
      };
      const double first_ms = start_ms;
      if (Status ok = renderer->setScene(scene); !ok) return fail(ok.error().message);
      lap("scene");
      for (const Eye which : {Eye::kLeft, Eye::kRight}) {
        Camera eye_camera;
        eye_camera.X_WorldCamera = (*simulation)->X_WorldCamera(which);
        if (Status ok = renderer->render(eye_camera, picture); !ok) return fail(ok.error().message);
        lap(which == Eye::kLeft ? "left eye with shadow map" : "right eye");
      }
      start_ms = first_ms;
      lap("in all");
    }
    for (auto& [what, values] : times_ms) {
      std::sort(values.begin(), values.end());
      std::cout << what << ": median " << values[values.size() / 2] << " ms, best " << values.front()
                << " ms\n";
    }
  }
  return 0;
}
