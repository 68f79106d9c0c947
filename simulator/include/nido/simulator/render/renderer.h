#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"
#include "nido/simulator/render/camera.h"
#include "nido/simulator/render/depth_image.h"
#include "nido/simulator/scene.h"

namespace nido::sim {

struct RenderOptions {
  int samples = 4;   // antialiasing of edges: 1 (none) or 4 samples a pixel
  bool room = true;  // floor (at z = -0.5976 m) and walls around the robot; else only a plain background
  int shadow_map_size = 512;  // texels along an edge, 64..4096
  Lighting lighting = {};     // to begin with
};

// Draws scenes on the CPU, without a display. The same scene, camera and light give the same bytes on one
// machine. A Renderer is used by one thread at a time, by any; different Renderers are independent, also in
// different threads.
//
// Names of textures that a shape may ask for: "", "checker", "wood", "fabric", "weave", "tiles", "plaster".
// Instances with an alpha below 0.01 are left out; others are opaque.
class Renderer {
 public:
  // Fails when there is no off-screen OpenGL 3.3, or when an option is out of range.
  static Result<Renderer> create(const RenderOptions& options = {});

  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  ~Renderer();

  // Takes over what is to be seen from now on. Cheap when only poses changed since the last call. Draws the
  // shadow map, which all pictures of this scene share. Fails, and keeps the scene before, when a mesh cannot
  // be read, a texture is unknown, or a size or pose is not finite; the message names the instance.
  Status setScene(const SceneSnapshot& scene);

  // Takes over the light. Fails, and keeps the light before, when a value is negative or not finite.
  Status setLighting(const Lighting& lighting);

  // A picture of the scene, sRGB-encoded. `picture` is resized and overwritten but for its stamp; its storage
  // is reused.
  Status render(const Camera& camera, Image& picture);

  // Depth and instances of the scene behind the centres of the pixels (no antialiasing).
  Status renderDepth(const Camera& camera, DepthImage& picture);

 private:
  class Impl;
  explicit Renderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace nido::sim
