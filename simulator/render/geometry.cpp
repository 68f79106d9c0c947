#include "geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace nido::sim {
namespace {

constexpr double kPi = std::numbers::pi;

// Corners of the polygon that stands for a circle: its deviation stays below a third of a pixel for what the
// eyes see at arm's length.
int segmentsFor(double radius_m) {
  if (radius_m < 0.010) return 8;
  if (radius_m < 0.020) return 12;
  if (radius_m < 0.028) return 16;
  return radius_m < 0.06 ? 24 : 32;
}

// Radius of a regular polygon's corners when its area is that of a circle of radius 1.
double cornerRadius(int segments) {
  const double step = 2 * kPi / segments;
  return std::sqrt(step / std::sin(step));
}

void addQuad(LocalMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
}

// One ring of a body of revolution about z.
struct Ring {
  double radius_m;
  double z_m;
  double normal_radial;
  double normal_z;
  double v_m;  // arc length along the profile
};

// Turns rings, from the bottom to the top, into a surface. The rings at both ends may have radius 0.
LocalMesh revolve(const std::vector<Ring>& rings, int segments, double uv_radius_m) {
  LocalMesh mesh;
  const double stretch = cornerRadius(segments);
  const auto columns = static_cast<std::uint32_t>(segments + 1);
  for (const Ring& ring : rings) {
    for (int s = 0; s <= segments; ++s) {
      const double angle = 2 * kPi * (s % segments) / segments;
      const double c = std::cos(angle);
      const double d = std::sin(angle);
      const double r = ring.radius_m * stretch;
      mesh.vertices.push_back(
          {Eigen::Vector3d(r * c, r * d, ring.z_m).cast<float>(),
           Eigen::Vector3d(ring.normal_radial * c, ring.normal_radial * d, ring.normal_z).cast<float>(),
           Eigen::Vector2d(2 * kPi * s / segments * uv_radius_m, ring.v_m).cast<float>()});
    }
  }
  for (std::uint32_t i = 0; i + 1 < rings.size(); ++i) {
    const bool tip_below = rings[i].radius_m == 0;
    const bool tip_above = rings[i + 1].radius_m == 0;
    for (std::uint32_t s = 0; s + 1 < columns; ++s) {
      const std::uint32_t a = i * columns + s;
      const std::uint32_t b = a + 1;
      const std::uint32_t c = b + columns;
      const std::uint32_t d = a + columns;
      if (tip_below) {
        mesh.indices.insert(mesh.indices.end(), {a, c, d});
      } else if (tip_above) {
        mesh.indices.insert(mesh.indices.end(), {a, b, c});
      } else {
        addQuad(mesh, a, b, c, d);
      }
    }
  }
  mesh.fitBall();
  return mesh;
}

// Latitudes of a ball from `from` to `to` (radians), both included, about the height z.
void addArc(std::vector<Ring>& rings, double radius_m, double z_m, double from, double to, int steps,
            double stretch) {
  for (int i = 0; i <= steps; ++i) {
    const double latitude = from + (to - from) * i / steps;
    const bool tip = std::abs(std::abs(latitude) - kPi / 2) < 1e-9;
    rings.push_back({tip ? 0 : radius_m * std::cos(latitude), z_m + radius_m * stretch * std::sin(latitude),
                     std::cos(latitude), std::sin(latitude), z_m + radius_m * latitude});
  }
}

}  // namespace

void LocalMesh::fitBall() {
  if (vertices.empty()) return;
  Eigen::Vector3f low = vertices.front().p_m;
  Eigen::Vector3f high = low;
  for (const LocalVertex& vertex : vertices) {
    low = low.cwiseMin(vertex.p_m);
    high = high.cwiseMax(vertex.p_m);
  }
  centre_m = 0.5F * (low + high);
  radius_m = 0;
  for (const LocalVertex& vertex : vertices) radius_m = std::max(radius_m, (vertex.p_m - centre_m).norm());
}

LocalMesh makeBox(const Eigen::Vector3d& size_m) {
  LocalMesh mesh;
  const Eigen::Vector3d half = 0.5 * size_m;
  const double bevel = std::min(0.06 * size_m.minCoeff(), 0.0025);
  // axes by falling length, for the texture: u runs along the longest edge of a face
  std::array<int, 3> rank = {0, 1, 2};
  std::stable_sort(rank.begin(), rank.end(), [&](int a, int b) { return size_m[a] > size_m[b]; });
  std::array<int, 3> place{};
  for (int i = 0; i < 3; ++i) place[rank[i]] = i;

  // the faces, drawn in by the bevel; corner[axis][side][u][v] for the seams between them
  std::uint32_t corner[3][2][2][2];
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (int side = 0; side < 2; ++side) {
      for (int iu = 0; iu < 2; ++iu) {
        for (int iv = 0; iv < 2; ++iv) {
          Eigen::Vector3d p;
          p[axis] = side ? half[axis] : -half[axis];
          p[u] = (iu ? 1 : -1) * (half[u] - bevel);
          p[v] = (iv ? 1 : -1) * (half[v] - bevel);
          Eigen::Vector3d normal = Eigen::Vector3d::Zero();
          normal[axis] = side ? 1 : -1;
          const int along = place[u] < place[v] ? u : v;
          const int across = along == u ? v : u;
          corner[axis][side][iu][iv] = static_cast<std::uint32_t>(mesh.vertices.size());
          mesh.vertices.push_back(
              {p.cast<float>(), normal.cast<float>(),
               Eigen::Vector2d(p[along] + half[along], p[across] + half[across]).cast<float>()});
        }
      }
      auto& c = corner[axis][side];
      if (side) {
        addQuad(mesh, c[0][0], c[1][0], c[1][1], c[0][1]);
      } else {
        addQuad(mesh, c[0][0], c[0][1], c[1][1], c[1][0]);
      }
    }
  }
  // strips along the edges share the faces' vertices, so that their shading runs from one face's normal to
  // the other's
  const auto vertexAt = [&](int axis, std::array<int, 3> sides) {
    return corner[axis][sides[axis]][sides[(axis + 1) % 3]][sides[(axis + 2) % 3]];
  };
  for (int along = 0; along < 3; ++along) {
    const int u = (along + 1) % 3;
    const int v = (along + 2) % 3;
    for (int su = 0; su < 2; ++su) {
      for (int sv = 0; sv < 2; ++sv) {
        std::array<int, 3> low{};
        low[u] = su;
        low[v] = sv;
        std::array<int, 3> high = low;
        high[along] = 1;
        std::uint32_t a = vertexAt(u, low);
        std::uint32_t b = vertexAt(v, low);
        std::uint32_t c = vertexAt(v, high);
        std::uint32_t d = vertexAt(u, high);
        if (su == sv) {
          addQuad(mesh, a, b, c, d);
        } else {
          addQuad(mesh, b, a, d, c);
        }
      }
    }
  }
  for (int x = 0; x < 2; ++x) {
    for (int y = 0; y < 2; ++y) {
      for (int z = 0; z < 2; ++z) {
        std::uint32_t a = vertexAt(0, {x, y, z});
        std::uint32_t b = vertexAt(1, {x, y, z});
        std::uint32_t c = vertexAt(2, {x, y, z});
        if ((x + y + z) % 2 == 0) std::swap(b, c);
        mesh.indices.insert(mesh.indices.end(), {a, b, c});
      }
    }
  }
  mesh.fitBall();
  return mesh;
}

LocalMesh makeSphere(double radius_m) {
  const int segments = segmentsFor(radius_m);
  std::vector<Ring> rings;
  addArc(rings, radius_m, 0, -kPi / 2, kPi / 2, segments / 2, cornerRadius(segments));
  return revolve(rings, segments, radius_m);
}

LocalMesh makeCylinder(double radius_m, double length_m) {
  const double h = 0.5 * length_m;
  const double bevel = std::min(0.15 * radius_m, std::min(0.1 * length_m, 0.002));
  const std::vector<Ring> rings = {
      {0, -h, 0, -1, -radius_m - h},          {radius_m - bevel, -h, 0, -1, -h - bevel},
      {radius_m, -h + bevel, 1, 0, -h},       {radius_m, h - bevel, 1, 0, h},
      {radius_m - bevel, h, 0, 1, h + bevel}, {0, h, 0, 1, radius_m + h},
  };
  return revolve(rings, segmentsFor(radius_m), radius_m);
}

LocalMesh makeCapsule(double radius_m, double length_m) {
  const int segments = segmentsFor(radius_m);
  const int steps = std::max(2, segments / 4);
  const double stretch = cornerRadius(segments);
  std::vector<Ring> rings;
  addArc(rings, radius_m, -0.5 * length_m, -kPi / 2, 0, steps, stretch);
  if (length_m > 0) {
    addArc(rings, radius_m, 0.5 * length_m, 0, kPi / 2, steps, stretch);
  } else {
    rings.pop_back();
    addArc(rings, radius_m, 0, 0, kPi / 2, steps, stretch);
  }
  return revolve(rings, segments, radius_m);
}

}  // namespace nido::sim
