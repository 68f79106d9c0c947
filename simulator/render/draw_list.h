#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "gl.h"
#include "scene_geometry.h"

namespace nido::sim {

// Which parts of the index buffer to draw for one view: the pieces that its frustum meets.
class DrawList {
 public:
  // Clip coordinates from world coordinates. `only_shadow` leaves out what casts no shadow.
  void build(std::span<const Piece> pieces, const Eigen::Matrix4d& clip_from_world, bool only_shadow);

  // Draws a batch with the program and state of the caller.
  void draw(Batch batch) const;
  [[nodiscard]] bool empty(Batch batch) const { return counts_[static_cast<std::size_t>(batch)].empty(); }

 private:
  std::array<std::vector<GLsizei>, kBatchCount> counts_;
  std::array<std::vector<const void*>, kBatchCount> offsets_;
};

}  // namespace nido::sim
