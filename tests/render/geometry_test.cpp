#include "geometry.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "textures.h"

namespace nido::sim {
namespace {

// Volume inside, by the signed tetrahedra between the origin and the triangles: right only if all of them
// face outwards.
double volumeOf(const LocalMesh& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const Eigen::Vector3f& a = mesh.vertices[mesh.indices[i]].p_m;
    const Eigen::Vector3f& b = mesh.vertices[mesh.indices[i + 1]].p_m;
    const Eigen::Vector3f& c = mesh.vertices[mesh.indices[i + 2]].p_m;
    sum += a.cross(b).dot(c) / 6.0;
  }
  return sum;
}

void expectClosedAndOutward(const LocalMesh& mesh, const std::string& what) {
  std::map<std::array<std::array<float, 3>, 2>, int> edges;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    std::array<std::array<float, 3>, 3> corner;
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = mesh.vertices[mesh.indices[i + k]].p_m;
      middle += p / 3;
      for (int axis = 0; axis < 3; ++axis) corner[k][static_cast<std::size_t>(axis)] = p[axis] + 0.0F;
    }
    const Eigen::Vector3f& a = mesh.vertices[mesh.indices[i]].p_m;
    const Eigen::Vector3f normal =
        (mesh.vertices[mesh.indices[i + 1]].p_m - a).cross(mesh.vertices[mesh.indices[i + 2]].p_m - a);
    EXPECT_GT(normal.dot(middle), 0) << what << ": triangle " << i / 3 << " faces inwards";
    for (std::size_t k = 0; k < 3; ++k) {
      ++edges[{corner[k], corner[(k + 1) % 3]}];
      EXPECT_GT(mesh.vertices[mesh.indices[i + k]].normal.dot(normal), 0)
          << what << ": a normal of triangle " << i / 3;
    }
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1) << what;
    EXPECT_EQ((edges.count({edge[1], edge[0]})), 1U) << what << ": an edge has one side";
  }
}

TEST(Geometry, ShapesAreClosedAndFaceOutwards) {
  expectClosedAndOutward(makeBox({0.05, 0.2, 0.1}), "box");
  expectClosedAndOutward(makeSphere(0.03), "sphere");
  expectClosedAndOutward(makeCylinder(0.03, 0.1), "cylinder");
  expectClosedAndOutward(makeCapsule(0.03, 0.1), "capsule");
  expectClosedAndOutward(makeCapsule(0.005, 0.02), "small capsule");
}

TEST(Geometry, ShapesHaveTheirSize) {
  EXPECT_NEAR(volumeOf(makeBox({0.05, 0.2, 0.1})) / (0.05 * 0.2 * 0.1), 1, 0.01);
  EXPECT_NEAR(volumeOf(makeSphere(0.03)) / (4.0 / 3 * M_PI * std::pow(0.03, 3)), 1, 0.03);
  EXPECT_NEAR(volumeOf(makeCylinder(0.03, 0.1)) / (M_PI * 0.03 * 0.03 * 0.1), 1, 0.01);
  EXPECT_NEAR(volumeOf(makeCapsule(0.03, 0.1)) / (M_PI * 0.03 * 0.03 * (0.1 + 4.0 / 3 * 0.03)), 1, 0.03);
  EXPECT_NEAR(makeSphere(0.08).radius_m, 0.08, 0.001);
  EXPECT_NEAR(makeCapsule(0.01, 0.1).radius_m, 0.06, 0.002);
}

TEST(Textures, AreKnownByNameAndHaveContrast) {
  EXPECT_EQ(textureLayer(""), kNoTexture);
  EXPECT_EQ(textureLayer("marble"), kUnknownTexture);
  for (const TexturePattern& pattern : texturePatterns()) {
    const std::vector<std::uint8_t> texels = pattern.make();
    ASSERT_EQ(texels.size(), static_cast<std::size_t>(kTextureSize * kTextureSize)) << pattern.name;
    const auto [low, high] = std::minmax_element(texels.begin(), texels.end());
    EXPECT_GT(*high - *low, 8) << pattern.name;
    EXPECT_EQ(textureLayer(pattern.name), &pattern - texturePatterns().data());
    EXPECT_EQ(texels, pattern.make()) << pattern.name;
  }
}

}  // namespace
}  // namespace nido::sim
