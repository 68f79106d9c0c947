#pragma once

#include <array>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/vision/colour.h"
#include "nido/vision/polygon.h"

namespace nido::vision {

// A connected patch of one colour. Image coordinates as in PinholeCamera.
struct Blob {
  int colour = -1;  // index into the colours
  int area_px = 0;  // pixels
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();
  int left = 0, top = 0, right = 0, bottom = 0;     // its pixels; right and bottom are inside
  bool touches_border = false;                      // of the image
  Polygon hull;                                     // convex, around the pixels
  [[nodiscard]] std::array<double, 4> box() const;  // x, y, width, height, px
};

// Finds the blobs of all colours with at least `min_area_px` pixels, largest first. Keeps its storage between
// pictures: one finder a thread.
class BlobFinder {
 public:
  BlobFinder(ColourTable table, int min_area_px) : table_(std::move(table)), min_area_px_(min_area_px) {}
  [[nodiscard]] const std::vector<Blob>& find(const Image& image);

 private:
  struct Run {
    int row, begin, end;  // end is outside
    std::uint8_t colour;
    int set;  // union-find parent
  };
  int root(int run);

  ColourTable table_;
  int min_area_px_;
  std::vector<Run> runs_;
  std::vector<int> blob_of_;
  std::vector<std::vector<Eigen::Vector2d>> outlines_;
  std::vector<Blob> blobs_;
};

}  // namespace nido::vision
