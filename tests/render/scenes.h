#pragma once

#include <string>
#include <utility>

#include "nido/simulator/render/camera.h"
#include "nido/simulator/scene.h"

namespace nido::sim {

inline VisualInstance makeInstance(std::string name, ShapeKind kind, const Eigen::Vector3d& size,
                                   const Eigen::Vector3d& p_World_m, std::array<float, 4> rgba,
                                   std::string texture = "") {
  VisualInstance instance;
  instance.name = std::move(name);
  instance.shape.kind = kind;
  instance.shape.size = size;
  instance.shape.rgba = rgba;
  instance.shape.texture = std::move(texture);
  instance.X_WorldShape.translation() = p_World_m;
  return instance;
}

// A camera at the origin of the world that looks forward (negative x), with the world's z up in its pictures.
inline Eigen::Isometry3d lookForward() {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear().col(0) = Eigen::Vector3d::UnitY();   // the robot's right
  X.linear().col(1) = -Eigen::Vector3d::UnitZ();  // down
  X.linear().col(2) = -Eigen::Vector3d::UnitX();
  return X;
}

// A table with things on it, seen by tests and benchmarks.
inline SceneSnapshot makeTableScene() {
  SceneSnapshot scene;
  scene.revision = 1;
  auto& list = scene.instances;
  list.push_back(makeInstance("table", ShapeKind::kBox, {0.4, 0.7, 0.03}, {-0.40, 0, -0.0976},
                              {0.55F, 0.45F, 0.34F, 1}, "wood"));
  list.push_back(makeInstance("blue cube", ShapeKind::kBox, {0.05, 0.05, 0.05}, {-0.30, 0.05, -0.0576},
                              {0.02F, 0.05F, 0.8F, 1}));
  list.push_back(makeInstance("red ball", ShapeKind::kSphere, {0.03, 0, 0}, {-0.32, -0.08, -0.0526},
                              {0.8F, 0.02F, 0.02F, 1}));
  list.push_back(makeInstance("green cylinder", ShapeKind::kCylinder, {0.025, 0.06, 0},
                              {-0.28, 0.15, -0.0526}, {0.02F, 0.6F, 0.05F, 1}));
  list.push_back(makeInstance("capsule", ShapeKind::kCapsule, {0.015, 0.08, 0}, {-0.38, 0.02, -0.0276},
                              {0.8F, 0.5F, 0.05F, 1}));
  list.push_back(makeInstance("basket", ShapeKind::kBox, {0.18, 0.18, 0.06}, {-0.45, 0.2, -0.0526},
                              {0.80F, 0.45F, 0.08F, 1}, "weave"));
  list.push_back(makeInstance("bear", ShapeKind::kSphere, {0.03, 0, 0}, {-0.4, -0.2, -0.0526},
                              {0.30F, 0.15F, 0.06F, 1}, "fabric"));
  return scene;
}

// What a robot's eye would see of it.
inline Camera tableCamera() { return lookAt({0, 0.03, 0.35}, {-0.35, 0, -0.08}, 320, 240, 0.8727); }

}  // namespace nido::sim
