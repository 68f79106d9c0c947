#include "nido/simulator/render/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

#include "scenes.h"

namespace nido::sim {
namespace {

std::uint64_t hashOf(const Image& picture) {
  std::uint64_t hash = 1469598103934665603ULL;
  for (const std::uint8_t byte : picture.rgb) hash = (hash ^ byte) * 1099511628211ULL;
  return hash;
}

Renderer makeRenderer(const RenderOptions& options = {}) {
  Result<Renderer> made = Renderer::create(options);
  EXPECT_TRUE(made.ok());
  return std::move(made).value();
}

Image drawn(Renderer& renderer, const Camera& camera) {
  Image picture;
  const Status ok = renderer.render(camera, picture);
  EXPECT_TRUE(ok.ok()) << (ok ? "" : ok.error().message);
  return picture;
}

DepthImage measured(Renderer& renderer, const Camera& camera) {
  DepthImage picture;
  const Status ok = renderer.renderDepth(camera, picture);
  EXPECT_TRUE(ok.ok()) << (ok ? "" : ok.error().message);
  return picture;
}

void show(Renderer& renderer, const SceneSnapshot& scene) {
  const Status ok = renderer.setScene(scene);
  ASSERT_TRUE(ok.ok()) << ok.error().message;
}

std::uint8_t brightnessAt(const Image& picture, int column, int row) {
  return picture.rgb[static_cast<std::size_t>(3 * (row * picture.width + column))];
}

// Middle of the outline of a ball, which is an ellipse and not centred on the picture of the ball's centre:
// rays d with (d c)^2 = d^2 (c^2 - r^2).
Eigen::Vector2d outlineCentre(const Camera& camera, const Eigen::Vector3d& p_World_m, double radius_m) {
  const Eigen::Vector3d c = camera.X_WorldCamera.inverse() * p_World_m;
  const Eigen::Matrix3d Q =
      c * c.transpose() - (c.squaredNorm() - radius_m * radius_m) * Eigen::Matrix3d::Identity();
  const Eigen::Vector2d middle = -Q.topLeftCorner<2, 2>().inverse() * Q.topRightCorner<2, 1>();
  return {camera.fx_px * middle.x() + camera.cx_px, camera.fy_px * middle.y() + camera.cy_px};
}

TEST(Renderer, PutsEdgesWhereThePinholeModelSays) {
  RenderOptions options;
  options.room = false;
  Renderer renderer = makeRenderer(options);
  Camera camera;
  camera.X_WorldCamera = lookForward();
  camera.fx_px = 250;
  camera.fy_px = 230;
  camera.cx_px = 150.3;  // off the middle on purpose
  camera.cy_px = 110.8;
  const double z_m = 0.5;
  // the corner at the upper left of a plate, a twentieth of a pixel to either side of a pixel's centre
  for (const double shift_px : {-0.05, 0.05}) {
    const double u = 100.5 + shift_px;
    const double v = 60.5 + shift_px;
    const double x_m = (u - camera.cx_px) / camera.fx_px * z_m;
    const double y_m = (v - camera.cy_px) / camera.fy_px * z_m;
    SceneSnapshot scene;
    const double thick_m = 1e-4;
    const double edge_m = 0.1;
    // camera x is world y, camera y is world -z, camera z is world -x
    scene.instances.push_back(makeInstance("plate", ShapeKind::kBox, {thick_m, edge_m, edge_m},
                                           {-z_m - 0.5 * thick_m, x_m + 0.5 * edge_m, -(y_m + 0.5 * edge_m)},
                                           {1, 1, 1, 1}));
    show(renderer, scene);
    const DepthImage depth = measured(renderer, camera);
    const auto at = [&](int column, int row) {
      return depth.instance[static_cast<std::size_t>(row * 320 + column)];
    };
    const bool covered = shift_px < 0;
    EXPECT_EQ(at(100, 80), covered ? 1U : 0U) << "left edge at u = " << u;
    EXPECT_EQ(at(99, 80), 0U);
    EXPECT_EQ(at(101, 80), 1U);
    EXPECT_EQ(at(120, 60), covered ? 1U : 0U) << "top edge at v = " << v;
    EXPECT_EQ(at(120, 59), 0U);
    EXPECT_EQ(at(120, 61), 1U);
    EXPECT_NEAR(depth.z_m[80 * 320 + 120], z_m, 1e-5);
    EXPECT_EQ(depth.z_m[0], 0);
  }
}

TEST(Renderer, AntialiasedBallIsCentredWithinATenthOfAPixel) {
  RenderOptions options;
  options.room = false;
  Renderer renderer = makeRenderer(options);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 40; ++trial) {
    const Camera camera = lookAt({0, 0.1 * unit(random), 0.3 + 0.1 * unit(random)},
                                 {-0.4 - 0.1 * unit(random), 0.1 * unit(random), -0.1}, 320, 240, 0.8727);
    const double radius_m = 0.01 + 0.025 * unit(random);
    const Eigen::Vector3d p_World_m(-0.4 + 0.1 * unit(random), -0.1 + 0.2 * unit(random),
                                    -0.15 + 0.2 * unit(random));
    SceneSnapshot scene;
    scene.instances.push_back(
        makeInstance("ball", ShapeKind::kSphere, {radius_m, 0, 0}, p_World_m, {0, 0, 0, 1}));
    scene.instances.front().shape.shininess = 0;  // black all over
    show(renderer, scene);
    const Image picture = drawn(renderer, camera);
    const double background = brightnessAt(picture, 0, 0);
    const double ball =
        brightnessAt(picture, static_cast<int>(outlineCentre(camera, p_World_m, radius_m).x()),
                     static_cast<int>(outlineCentre(camera, p_World_m, radius_m).y()));
    ASSERT_GT(background - ball, 100);
    double area = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int row = 0; row < picture.height; ++row) {
      for (int column = 0; column < picture.width; ++column) {
        const double covered = (background - brightnessAt(picture, column, row)) / (background - ball);
        area += covered;
        sum += covered * Eigen::Vector2d(column + 0.5, row + 0.5);
      }
    }
    const Eigen::Vector2d expected = outlineCentre(camera, p_World_m, radius_m);
    EXPECT_LT((sum / area - expected).norm(), 0.1) << "trial " << trial << ", area " << area << " px";
    const Eigen::Vector3d c = camera.X_WorldCamera.inverse() * p_World_m;
    const double expected_area = M_PI * camera.fx_px * camera.fy_px * radius_m * radius_m *
                                 std::sqrt(c.squaredNorm() - radius_m * radius_m) /
                                 std::pow(c.z() * c.z() - radius_m * radius_m, 1.5);
    EXPECT_NEAR(std::sqrt(area / expected_area), 1.0, 0.015) << "trial " << trial;
  }
}

TEST(Renderer, SameSceneSameBytes) {
  Renderer renderer = makeRenderer();
  const SceneSnapshot scene = makeTableScene();
  const Camera camera = tableCamera();
  show(renderer, scene);
  const std::uint64_t first = hashOf(drawn(renderer, camera));
  EXPECT_EQ(first, hashOf(drawn(renderer, camera)));
  SceneSnapshot moved = scene;
  for (VisualInstance& instance : moved.instances) instance.X_WorldShape.translation().y() += 0.02;
  show(renderer, moved);
  EXPECT_NE(first, hashOf(drawn(renderer, camera)));
  show(renderer, scene);
  EXPECT_EQ(first, hashOf(drawn(renderer, camera))) << "after moving there and back";
  Renderer other = makeRenderer();
  show(other, scene);
  EXPECT_EQ(first, hashOf(drawn(other, camera))) << "by another renderer";
}

TEST(Renderer, PicturesOfOtherSizesInBetweenChangeNothing) {
  Renderer renderer = makeRenderer();
  show(renderer, makeTableScene());
  Camera camera = tableCamera();
  const std::uint64_t first = hashOf(drawn(renderer, camera));
  for (const int size : {33, 64, 100, 200, 319, 400}) {
    Camera small = camera;
    small.width = size;
    small.height = size / 2 + 1;
    const Image picture = drawn(renderer, small);
    EXPECT_EQ(picture.rgb.size(), static_cast<std::size_t>(3 * size * (size / 2 + 1)));
    EXPECT_EQ(measured(renderer, small).z_m.size(), static_cast<std::size_t>(size * (size / 2 + 1)));
  }
  EXPECT_EQ(first, hashOf(drawn(renderer, camera)));
}

TEST(Renderer, NearerThingsHideFartherOnes) {
  Renderer renderer = makeRenderer();
  SceneSnapshot scene;
  scene.instances.push_back(
      makeInstance("near", ShapeKind::kBox, {0.05, 0.05, 0.05}, {-0.5, 0, 0}, {1, 0, 0, 1}));
  scene.instances.push_back(
      makeInstance("far", ShapeKind::kBox, {0.2, 0.2, 0.2}, {-1.0, 0, 0}, {0, 0, 1, 1}));
  Camera camera;
  camera.X_WorldCamera = lookForward();
  const std::size_t middle = 120 * 320 + 160;
  for (const bool swapped : {false, true}) {  // not a matter of order
    show(renderer, scene);
    const DepthImage depth = measured(renderer, camera);
    EXPECT_EQ(depth.instance[middle], swapped ? 2U : 1U);
    EXPECT_NEAR(depth.z_m[middle], 0.475, 1e-4);
    EXPECT_EQ(depth.instance[120 * 320 + 149], swapped ? 2U : 1U);
    EXPECT_EQ(depth.instance[120 * 320 + 140], swapped ? 1U : 2U);
    EXPECT_EQ(depth.instance[0], 0U) << "the room";
    EXPECT_NEAR(depth.z_m[0], 2.6, 0.01) << "its wall";
    const Image picture = drawn(renderer, camera);
    EXPECT_GT(picture.rgb[3 * middle], 100);
    EXPECT_LT(picture.rgb[3 * middle + 2], 60);
    std::swap(scene.instances[0], scene.instances[1]);
  }
}

TEST(Renderer, ShadowDarkensTheTableAndOnlyThere) {
  Renderer renderer = makeRenderer();
  SceneSnapshot scene;
  scene.instances.push_back(
      makeInstance("table", ShapeKind::kBox, {0.6, 0.8, 0.02}, {-0.4, 0, -0.1}, {0.5F, 0.5F, 0.5F, 1}));
  scene.instances.push_back(
      makeInstance("plate", ShapeKind::kBox, {0.1, 0.1, 0.01}, {-0.4, 0, 0.15}, {0.5F, 0.5F, 0.5F, 1}));
  show(renderer, scene);
  const Camera camera = lookAt({0.0, 0.0, 0.15}, {-0.4, 0, -0.09}, 320, 240, 1.2);
  Lighting light;
  light.key_direction_World = {0, 0, 1};
  ASSERT_TRUE(renderer.setLighting(light).ok());
  const Image with = drawn(renderer, camera);
  light.shadows = false;
  ASSERT_TRUE(renderer.setLighting(light).ok());
  const Image without = drawn(renderer, camera);
  const auto at = [&](const Image& picture, const Eigen::Vector3d& p_World_m) {
    const Eigen::Vector3d p = camera.X_WorldCamera.inverse() * p_World_m;
    return int{brightnessAt(picture, static_cast<int>(camera.fx_px * p.x() / p.z() + camera.cx_px),
                            static_cast<int>(camera.fy_px * p.y() / p.z() + camera.cy_px))};
  };
  EXPECT_LT(at(with, {-0.4, 0, -0.09}), at(without, {-0.4, 0, -0.09}) - 40) << "right under the plate";
  EXPECT_EQ(at(with, {-0.4, 0.15, -0.09}), at(without, {-0.4, 0.15, -0.09})) << "beside it";
  EXPECT_EQ(at(with, {-0.4, 0, 0.155}), at(without, {-0.4, 0, 0.155})) << "on it";
  EXPECT_LT(std::abs(at(with, {-0.3, 0.2, -0.09}) - at(with, {-0.5, -0.2, -0.09})), 3)
      << "no shade of its own";
}

TEST(Renderer, HalfTheLightGivesADarkerPictureOfTheSameThings) {
  Renderer renderer = makeRenderer();
  show(renderer, makeTableScene());
  Lighting light;
  const Image bright = drawn(renderer, tableCamera());
  light.brightness = 0.5;
  ASSERT_TRUE(renderer.setLighting(light).ok());
  const Image dim = drawn(renderer, tableCamera());
  const auto linear = [](std::uint8_t value) { return std::pow(value / 255.0, 2.2); };
  double bright_sum = 0;
  double dim_sum = 0;
  for (std::size_t i = 0; i < bright.rgb.size(); ++i) {
    if (bright.rgb[i] > 240 || bright.rgb[i] < 40) continue;  // clipped, or where the coding is coarse
    bright_sum += linear(bright.rgb[i]);
    dim_sum += linear(dim.rgb[i]);
  }
  EXPECT_NEAR(dim_sum / bright_sum, 0.5, 0.04);
  light.brightness = -1;
  EXPECT_FALSE(renderer.setLighting(light).ok());
  light.brightness = 1;
  light.key_direction_World.setZero();
  EXPECT_FALSE(renderer.setLighting(light).ok());
  EXPECT_EQ(hashOf(drawn(renderer, tableCamera())), hashOf(dim)) << "a refused light changes nothing";

  RenderOptions options;
  options.lighting.brightness = 0.5;
  Renderer dim_from_the_start = makeRenderer(options);
  show(dim_from_the_start, makeTableScene());
  EXPECT_EQ(hashOf(drawn(dim_from_the_start, tableCamera())), hashOf(dim));
  options.lighting.fill = std::nan("");
  EXPECT_FALSE(Renderer::create(options).ok());
}

TEST(Renderer, NewShapesShowEvenUnderAnOldRevision) {
  Renderer renderer = makeRenderer();
  SceneSnapshot scene = makeTableScene();
  show(renderer, scene);
  const std::uint64_t before = hashOf(drawn(renderer, tableCamera()));
  scene.instances[1].shape.rgba = {0, 1, 0, 1};
  show(renderer, scene);
  EXPECT_NE(before, hashOf(drawn(renderer, tableCamera())));
  scene = makeTableScene();
  scene.instances[1].shape.rgba[3] = 0;  // invisible
  show(renderer, scene);
  const DepthImage depth = measured(renderer, tableCamera());
  for (const std::uint32_t id : depth.instance) ASSERT_NE(id, 2U);
}

TEST(Renderer, RefusesABadSceneInWordsAndKeepsTheOldOne) {
  Renderer renderer = makeRenderer();
  const SceneSnapshot good = makeTableScene();
  show(renderer, good);
  const std::uint64_t before = hashOf(drawn(renderer, tableCamera()));
  const auto refused = [&](const VisualInstance& bad) {
    SceneSnapshot scene = good;
    scene.instances.push_back(bad);
    const Status status = renderer.setScene(scene);
    EXPECT_FALSE(status.ok());
    EXPECT_EQ(before, hashOf(drawn(renderer, tableCamera())));
    return status ? std::string() : status.error().message;
  };
  VisualInstance bad = makeInstance("helmet", ShapeKind::kMesh, {1, 1, 1}, {0, 0, 0}, {1, 1, 1, 1});
  bad.shape.mesh_path = "/nowhere/helmet.obj";
  std::string message = refused(bad);
  EXPECT_NE(message.find("'helmet'"), std::string::npos) << message;
  EXPECT_NE(message.find("/nowhere/helmet.obj does not exist"), std::string::npos) << message;

  bad = makeInstance("rug", ShapeKind::kBox, {1, 1, 1}, {0, 0, 0}, {1, 1, 1, 1}, "velvet");
  message = refused(bad);
  EXPECT_NE(message.find("'velvet'"), std::string::npos) << message;
  EXPECT_NE(message.find("wood"), std::string::npos) << message;

  bad = makeInstance("ghost", ShapeKind::kBox, {1, 1, 1}, {0, std::nan(""), 0}, {1, 1, 1, 1});
  EXPECT_NE(refused(bad).find("'ghost'"), std::string::npos);
  bad = makeInstance("flat", ShapeKind::kCylinder, {0.1, -1, 0}, {0, 0, 0}, {1, 1, 1, 1});
  EXPECT_NE(refused(bad).find("size[1] = -1"), std::string::npos);
}

TEST(Renderer, RefusesBadCamerasAndOptions) {
  Renderer renderer = makeRenderer();
  Image picture;
  const auto refused = [&](auto change) {
    Camera camera;
    change(camera);
    return !renderer.render(camera, picture).ok();
  };
  EXPECT_FALSE(refused([](Camera&) {}));
  EXPECT_TRUE(refused([](Camera& c) { c.width = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.height = 5000; }));
  EXPECT_TRUE(refused([](Camera& c) { c.fx_px = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.fy_px = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](Camera& c) { c.cx_px = std::nan(""); }));
  EXPECT_TRUE(refused([](Camera& c) { c.near_m = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.far_m = c.near_m; }));
  EXPECT_TRUE(refused([](Camera& c) { c.X_WorldCamera.translation().x() = std::nan(""); }));
  RenderOptions options;
  options.samples = 3;
  EXPECT_FALSE(Renderer::create(options).ok());
  options.samples = 1;
  options.shadow_map_size = 10;
  EXPECT_FALSE(Renderer::create(options).ok());
}

TEST(Renderer, TwoRenderersInTwoThreadsDoNotDisturbEachOther) {
  const SceneSnapshot first_scene = makeTableScene();
  SceneSnapshot second_scene = first_scene;
  second_scene.instances.resize(3);
  const auto hashes = [](const SceneSnapshot& scene, int size) {
    Renderer renderer = makeRenderer();
    std::vector<std::uint64_t> result;
    Camera camera = tableCamera();
    camera.width = size;
    for (int i = 0; i < 8; ++i) {
      SceneSnapshot moved = scene;
      moved.instances[1].X_WorldShape.translation().x() -= 0.01 * i;
      show(renderer, moved);
      result.push_back(hashOf(drawn(renderer, camera)));
    }
    return result;
  };
  const auto first = hashes(first_scene, 320);
  const auto second = hashes(second_scene, 200);
  EXPECT_NE(first[0], first[1]);
  std::vector<std::uint64_t> first_again;
  std::vector<std::uint64_t> second_again;
  std::thread a([&] { first_again = hashes(first_scene, 320); });
  std::thread b([&] { second_again = hashes(second_scene, 200); });
  a.join();
  b.join();
  EXPECT_EQ(first, first_again);
  EXPECT_EQ(second, second_again);
}

TEST(Renderer, MayMoveToAnotherThread) {
  Renderer renderer = makeRenderer();
  show(renderer, makeTableScene());
  const std::uint64_t here = hashOf(drawn(renderer, tableCamera()));
  std::uint64_t there = 0;
  std::thread other(
      [&, moved = std::move(renderer)]() mutable { there = hashOf(drawn(moved, tableCamera())); });
  other.join();
  EXPECT_EQ(here, there);
}

class MeshTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("nido_mesh_test_" + std::to_string(std::random_device{}()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::filesystem::path folder_;
};

TEST_F(MeshTest, MirroredAndOpenMeshesShow) {
  // a tetrahedron that stretches to positive y, and a single triangle, which has two sides
  const std::string solid =
      write("solid.obj", "v 0 0 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.1 0 0\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n");
  const std::string open = write("open.obj", "v 0 -0.1 -0.1\nv 0 0.1 -0.1\nv 0 0 0.1\nf 1 2 3\n");
  const std::string open_back = write("back.obj", "v 0 -0.1 -0.1\nv 0 0.1 -0.1\nv 0 0 0.1\nf 1 3 2\n");
  Renderer renderer = makeRenderer();
  Camera camera;
  camera.X_WorldCamera = lookForward();
  const auto pixels = [&](const std::string& path, const Eigen::Vector3d& scale, bool right) {
    SceneSnapshot scene;
    scene.instances.push_back(makeInstance("mesh", ShapeKind::kMesh, scale, {-0.5, 0, 0}, {1, 1, 1, 1}));
    scene.instances[0].shape.mesh_path = path;
    show(renderer, scene);
    const DepthImage depth = measured(renderer, camera);
    int count = 0;
    for (int row = 0; row < 240; ++row) {
      for (int column = right ? 160 : 0; column < (right ? 320 : 160); ++column) {
        count += depth.instance[static_cast<std::size_t>(row * 320 + column)] == 1U ? 1 : 0;
      }
    }
    return count;
  };
  EXPECT_GT(pixels(solid, {1, 1, 1}, true), 500);
  EXPECT_EQ(pixels(solid, {1, 1, 1}, false), 0);
  EXPECT_EQ(pixels(solid, {1, -1, 1}, true), 0);
  EXPECT_GT(pixels(solid, {1, -1, 1}, false), 500);
  EXPECT_GT(pixels(open, {1, 1, 1}, true), 500);
  EXPECT_GT(pixels(open_back, {1, 1, 1}, true), 500);
  EXPECT_GT(pixels("file://" + open, {1, 1, 1}, true), 500);
}

TEST_F(MeshTest, BrokenFilesAreRefusedInWords) {
  Renderer renderer = makeRenderer();
  const auto message = [&](const std::string& path) {
    SceneSnapshot scene;
    scene.instances.push_back(makeInstance("thing", ShapeKind::kMesh, {1, 1, 1}, {0, 0, 0}, {1, 1, 1, 1}));
    scene.instances[0].shape.mesh_path = path;
    const Status status = renderer.setScene(scene);
    return status ? std::string("accepted") : status.error().message;
  };
  EXPECT_NE(message(write("empty.obj", "")).find("empty.obj"), std::string::npos);
  EXPECT_NE(message(write("noise.dae", "this is not a mesh")).find("noise.dae"), std::string::npos);
  EXPECT_NE(message(write("points.obj", "v 0 0 0\nv 1 0 0\n")).find("points.obj"), std::string::npos);
  EXPECT_NE(message(folder_.string()).find("does not exist"), std::string::npos);
}

}  // namespace
}  // namespace nido::sim
