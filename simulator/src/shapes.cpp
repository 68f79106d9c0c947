#include "shapes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ode_library.h"

namespace nido::sim {
namespace {

Eigen::Matrix3d diagonal(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

// second moments of a closed mesh by signed tetrahedra about the origin
MassProperties mesh_mass(const TriangleMesh& mesh, double mass_kg) {
  double volume = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices_m[t[0]];
    const Eigen::Vector3d& b = mesh.vertices_m[t[1]];
    const Eigen::Vector3d& c = mesh.vertices_m[t[2]];
    const double v = a.dot(b.cross(c)) / 6.0;
    const Eigen::Vector3d s = a + b + c;
    volume += v;
    moment += v * s / 4.0;
    covariance += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  MassProperties result;
  result.mass_kg = mass_kg;
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices_m) box.extend(v);
  if (volume > 1e-9) {
    result.center_m = moment / volume;
    const Eigen::Matrix3d central =
        (covariance / volume - result.center_m * result.center_m.transpose()) * mass_kg;
    result.inertia_kgm2 = central.trace() * Eigen::Matrix3d::Identity() - central;
    // a mesh with holes or of mixed sense gives numbers that no body can have
    const Eigen::Vector3d I =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(result.inertia_kgm2).eigenvalues();
    if (box.contains(result.center_m) && I[0] > 0 && I[0] + I[1] > I[2] * (1 - 1e-6)) return result;
  }
  // flat, open or inside-out: its box stands for it
  const Eigen::Vector3d e = box.sizes().cwiseMax(1e-3);
  result.center_m = box.center();
  result.inertia_kgm2 =
      mass_kg / 12.0 *
      diagonal(e.y() * e.y() + e.z() * e.z(), e.x() * e.x() + e.z() * e.z(), e.x() * e.x() + e.y() * e.y());
  return result;
}

}  // namespace

MassProperties mass_of(const PlacedShape& placed) {
  const double m = placed.mass_kg;
  const Eigen::Vector3d& s = placed.shape.size;
  MassProperties own;
  own.mass_kg = m;
  switch (placed.shape.kind) {
    case ShapeKind::kBox:
      own.inertia_kgm2 = m / 12.0 *
                         diagonal(s.y() * s.y() + s.z() * s.z(), s.x() * s.x() + s.z() * s.z(),
                                  s.x() * s.x() + s.y() * s.y());
      break;
    case ShapeKind::kSphere:
      own.inertia_kgm2 = 0.4 * m * s.x() * s.x() * Eigen::Matrix3d::Identity();
      break;
    case ShapeKind::kCylinder:
    case ShapeKind::kCapsule: {
      // a capsule counts as a cylinder with its caps' length added
      const double r2 = s.x() * s.x();
      const double length = placed.shape.kind == ShapeKind::kCapsule ? s.y() + 4.0 / 3.0 * s.x() : s.y();
      const double across = m * (3 * r2 + length * length) / 12.0;
      own.inertia_kgm2 = diagonal(across, across, m * r2 / 2.0);
      break;
    }
    case ShapeKind::kMesh:
      if (placed.mesh) own = mesh_mass(*placed.mesh, m);
      break;
  }
  const Eigen::Matrix3d R = placed.X_OwnerShape.linear();
  own.center_m = placed.X_OwnerShape * own.center_m;
  own.inertia_kgm2 = (R * own.inertia_kgm2 * R.transpose()).eval();
  return own;
}

MassProperties combine(const std::vector<MassProperties>& parts) {
  MassProperties sum;
  for (const auto& p : parts) {
    sum.mass_kg += p.mass_kg;
    sum.center_m += p.mass_kg * p.center_m;
  }
  if (sum.mass_kg <= 0) return sum;
  sum.center_m /= sum.mass_kg;
  for (const auto& p : parts) {
    const Eigen::Vector3d d = p.center_m - sum.center_m;
    sum.inertia_kgm2 +=
        p.inertia_kgm2 + p.mass_kg * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return sum;
}

void extend_bounds(const PlacedShape& placed, Eigen::AlignedBox3d& bounds) {
  const Eigen::Vector3d& s = placed.shape.size;
  if (placed.shape.kind == ShapeKind::kMesh) {
    if (placed.mesh) {
      for (const auto& v : placed.mesh->vertices_m) bounds.extend(placed.X_OwnerShape * v);
    }
    return;
  }
  if (placed.shape.kind == ShapeKind::kSphere) {
    const Eigen::Vector3d r = Eigen::Vector3d::Constant(s.x());
    bounds.extend(placed.X_OwnerShape.translation() - r);
    bounds.extend(placed.X_OwnerShape.translation() + r);
    return;
  }
  Eigen::Vector3d half = s / 2;
  if (placed.shape.kind == ShapeKind::kCylinder) half = {s.x(), s.x(), s.y() / 2};
  if (placed.shape.kind == ShapeKind::kCapsule) half = {s.x(), s.x(), s.y() / 2 + s.x()};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                               (corner & 4) != 0 ? 1 : -1);
    bounds.extend(placed.X_OwnerShape * half.cwiseProduct(sign));
  }
}

dGeomID make_geom(const PlacedShape& placed, std::vector<dTriMeshDataID>& mesh_data) {
  const Eigen::Vector3d& s = placed.shape.size;
  switch (placed.shape.kind) {
    case ShapeKind::kBox:
      return dCreateBox(nullptr, s.x(), s.y(), s.z());
    case ShapeKind::kSphere:
      return dCreateSphere(nullptr, s.x());
    case ShapeKind::kCylinder:
      return dCreateCylinder(nullptr, s.x(), s.y());
    case ShapeKind::kCapsule:
      return dCreateCapsule(nullptr, s.x(), std::max(s.y(), 1e-6));
    case ShapeKind::kMesh:
      break;
  }
  if (!placed.mesh || placed.mesh->triangles.empty()) return nullptr;
  // the arrays belong to the shared mesh, which its owner keeps
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildDouble(data, placed.mesh->vertices_m.data(), sizeof(Eigen::Vector3d),
                              static_cast<int>(placed.mesh->vertices_m.size()), placed.mesh->triangles.data(),
                              static_cast<int>(placed.mesh->triangles.size() * 3), 3 * sizeof(int));
  mesh_data.push_back(data);
  return dCreateTriMesh(nullptr, data, nullptr, nullptr, nullptr);
}

void place_geom(dGeomID geom, dBodyID body, const Eigen::Isometry3d& X) {
  const Eigen::Vector3d p = X.translation();
  dQuaternion q;
  to_ode(Eigen::Quaterniond(X.linear()).normalized(), q);
  if (body != nullptr) {
    dGeomSetBody(geom, body);
    dGeomSetOffsetPosition(geom, p.x(), p.y(), p.z());
    dGeomSetOffsetQuaternion(geom, q);
  } else {
    dGeomSetPosition(geom, p.x(), p.y(), p.z());
    dGeomSetQuaternion(geom, q);
  }
}

}  // namespace nido::sim
