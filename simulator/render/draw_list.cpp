#include "draw_list.h"

namespace nido::sim {

void DrawList::build(std::span<const Piece> pieces, const Eigen::Matrix4d& clip_from_world,
                     bool only_shadow) {
  // a point is inside where every row combination is >= 0; rows scaled so that the value is a distance in
  // metres
  std::array<Eigen::Vector4f, 6> planes;
  for (int i = 0; i < 3; ++i) {
    for (int side = 0; side < 2; ++side) {
      Eigen::Vector4d plane = clip_from_world.row(3) + (side ? -1.0 : 1.0) * clip_from_world.row(i);
      plane /= plane.head<3>().norm();
      planes[static_cast<std::size_t>(2 * i + side)] = plane.cast<float>();
    }
  }
  for (auto& counts : counts_) counts.clear();
  for (auto& offsets : offsets_) offsets.clear();
  std::uint32_t end_of_last = 0;
  std::size_t batch_of_last = kBatchCount;
  for (const Piece& piece : pieces) {
    if (only_shadow && !piece.casts_shadow) continue;
    bool visible = true;
    for (const Eigen::Vector4f& plane : planes) {
      visible = visible && plane.head<3>().dot(piece.ball_centre_World_m) + plane[3] > -piece.ball_radius_m;
    }
    if (!visible) continue;
    const auto batch = static_cast<std::size_t>(piece.batch);
    if (batch == batch_of_last && end_of_last == piece.first_index) {
      counts_[batch].back() += static_cast<GLsizei>(piece.index_count);
    } else {
      counts_[batch].push_back(static_cast<GLsizei>(piece.index_count));
      offsets_[batch].push_back(reinterpret_cast<const void*>(  // an offset into the bound index buffer
          static_cast<std::uintptr_t>(piece.first_index) * sizeof(std::uint32_t)));
    }
    end_of_last = piece.first_index + piece.index_count;
    batch_of_last = batch;
  }
}

void DrawList::draw(Batch batch) const {
  const auto b = static_cast<std::size_t>(batch);
  if (counts_[b].empty()) return;
  glMultiDrawElements(GL_TRIANGLES, counts_[b].data(), GL_UNSIGNED_INT, offsets_[b].data(),
                      static_cast<GLsizei>(counts_[b].size()));
}

}  // namespace nido::sim
