#include "nido/vision/blob.h"

#include <algorithm>

namespace nido::vision {

std::array<double, 4> Blob::box() const {
  return {static_cast<double>(left), static_cast<double>(top), static_cast<double>(right - left + 1),
          static_cast<double>(bottom - top + 1)};
}

int BlobFinder::root(int run) {
  while (runs_[run].set != run) {
    runs_[run].set = runs_[runs_[run].set].set;
    run = runs_[run].set;
  }
  return run;
}

const std::vector<Blob>& BlobFinder::find(const Image& image) {
  runs_.clear();
  blobs_.clear();
  // runs of equal colour, joined with touching runs (diagonals too) of the row above
  std::size_t above_begin = 0;
  std::size_t above_end = 0;
  for (int row = 0; row < image.height; ++row) {
    const std::uint8_t* p = image.rgb.data() + static_cast<std::size_t>(row) * image.width * 3;
    const std::size_t row_begin = runs_.size();
    std::uint8_t colour = ColourTable::kNone;
    int begin = 0;
    for (int column = 0; column <= image.width; ++column) {
      std::uint8_t next = ColourTable::kNone;
      if (column < image.width) next = table_.classify(p[0], p[1], p[2]);
      p += 3;
      if (next == colour && column < image.width) continue;
      if (colour != ColourTable::kNone) {
        runs_.push_back({row, begin, column, colour, static_cast<int>(runs_.size())});
      }
      colour = next;
      begin = column;
    }
    std::size_t a = above_begin;
    for (std::size_t r = row_begin; r < runs_.size(); ++r) {
      while (a < above_end && runs_[a].end < runs_[r].begin) ++a;
      for (std::size_t b = a; b < above_end && runs_[b].begin <= runs_[r].end; ++b) {
        if (runs_[b].colour != runs_[r].colour) continue;
        const int top = root(static_cast<int>(b));
        const int mine = root(static_cast<int>(r));
        if (top != mine) runs_[std::max(top, mine)].set = std::min(top, mine);
      }
    }
    above_begin = row_begin;
    above_end = runs_.size();
  }

  blob_of_.assign(runs_.size(), -1);
  std::size_t used = 0;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    const int first = root(static_cast<int>(r));
    if (blob_of_[first] < 0) {
      blob_of_[first] = static_cast<int>(used++);
      Blob blob;
      blob.colour = run.colour;
      blob.left = run.begin;
      blob.right = run.end - 1;
      blob.top = run.row;
      blobs_.push_back(blob);
      if (outlines_.size() < used) outlines_.emplace_back();
      outlines_[used - 1].clear();
    }
    Blob& blob = blobs_[blob_of_[first]];
    const int length = run.end - run.begin;
    blob.area_px += length;
    blob.centroid_px += Eigen::Vector2d(0.5 * (run.begin + run.end), run.row + 0.5) * length;
    blob.left = std::min(blob.left, run.begin);
    blob.right = std::max(blob.right, run.end - 1);
    blob.bottom = run.row;
    // the middles of the border pixels' outer edges: neither a pixel too wide nor one too narrow
    auto& outline = outlines_[blob_of_[first]];
    const double y = run.row + 0.5;
    outline.emplace_back(run.begin, y);
    outline.emplace_back(run.end, y);
    for (const double edge : {run.row + 0.0, run.row + 1.0}) {
      outline.emplace_back(run.begin + 0.5, edge);
      outline.emplace_back(run.end - 0.5, edge);
    }
  }

  std::size_t kept = 0;
  for (std::size_t b = 0; b < blobs_.size(); ++b) {
    Blob& blob = blobs_[b];
    if (blob.area_px < min_area_px_) continue;
    blob.centroid_px /= blob.area_px;
    blob.touches_border =
        blob.left == 0 || blob.top == 0 || blob.right == image.width - 1 || blob.bottom == image.height - 1;
    blob.hull = convex_hull(outlines_[b]);
    if (kept != b) blobs_[kept] = std::move(blob);
    ++kept;
  }
  blobs_.resize(kept);
  std::stable_sort(blobs_.begin(), blobs_.end(),
                   [](const Blob& a, const Blob& b) { return a.area_px > b.area_px; });
  return blobs_;
}

}  // namespace nido::vision
