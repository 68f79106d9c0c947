#include "nido/attention/markov_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc/detail/gcgraph.hpp>

namespace nido::attention {
namespace {

float difference(const cv::Vec3b& a, const cv::Vec3b& b) {
  float sum = 0;
  for (int c = 0; c < 3; ++c) {
    const float d = static_cast<float>(a[c]) - static_cast<float>(b[c]);
    sum += d * d;
  }
  return sum;
}

// Squared differences to the neighbour on the right and below become couplings.
struct Couplings {
  cv::Mat right;
  cv::Mat below;
};

Couplings couplings(const cv::Mat& picture, const FieldSettings& settings) {
  Couplings w{cv::Mat::zeros(picture.size(), CV_32F), cv::Mat::zeros(picture.size(), CV_32F)};
  double sum = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto& here = picture.at<cv::Vec3b>(y, x);
      if (x + 1 < picture.cols)
        sum += w.right.at<float>(y, x) = difference(here, picture.at<cv::Vec3b>(y, x + 1));
      if (y + 1 < picture.rows)
        sum += w.below.at<float>(y, x) = difference(here, picture.at<cv::Vec3b>(y + 1, x));
    }
  }
  // what counts as an edge depends on how much contrast there is
  const double mean = std::max(sum / std::max<double>(2.0 * static_cast<double>(picture.total()), 1), 4.0);
  const auto scale = static_cast<float>(1 / (2 * mean));
  for (cv::Mat* m : {&w.right, &w.below}) {
    for (int y = 0; y < m->rows; ++y) {
      for (int x = 0; x < m->cols; ++x) {
        float& value = m->at<float>(y, x);
        value = static_cast<float>(settings.smooth_edge) +
                static_cast<float>(settings.smooth) * std::exp(-value * scale);
      }
    }
  }
  // no neighbour beyond the border
  w.right.col(picture.cols - 1).setTo(0);
  w.below.row(picture.rows - 1).setTo(0);
  return w;
}

}  // namespace

cv::Mat most_likely(const cv::Mat& evidence, const cv::Mat& picture, const FieldSettings& settings) {
  CV_Assert(evidence.type() == CV_32F && picture.type() == CV_8UC3 && evidence.size() == picture.size());
  const Couplings w = couplings(picture, settings);
  const int count = evidence.rows * evidence.cols;
  cv::detail::GCGraph<float> graph(static_cast<unsigned>(count), static_cast<unsigned>(2 * count));
  for (int y = 0; y < evidence.rows; ++y) {
    for (int x = 0; x < evidence.cols; ++x) {
      const int node = graph.addVtx();
      const float u = evidence.at<float>(y, x);
      graph.addTermWeights(node, std::max(u, 0.F), std::max(-u, 0.F));
      if (x > 0) {
        const float side = w.right.at<float>(y, x - 1);
        graph.addEdges(node - 1, node, side, side);
      }
      if (y > 0) {
        const float side = w.below.at<float>(y - 1, x);
        graph.addEdges(node - evidence.cols, node, side, side);
      }
    }
  }
  if (count > 0) graph.maxFlow();
  cv::Mat on(evidence.size(), CV_8U);
  for (int y = 0; y < on.rows; ++y) {
    for (int x = 0; x < on.cols; ++x)
      on.at<std::uint8_t>(y, x) = graph.inSourceSegment(y * on.cols + x) ? 255 : 0;
  }
  return on;
}

}  // namespace nido::attention
