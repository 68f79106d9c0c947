// attention_lab: not a test; plays scenes in one process, prints what the judge says, and writes pictures.
//   attention_lab [field|threshold|colour] [first] [count] [folder]
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "lab.h"

namespace {
double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}
}  // namespace

int main(int argc, char** argv) {
  using namespace nido;  // NOLINT
  const std::string method = argc > 1 ? argv[1] : "field";
  const int first = argc > 2 ? std::atoi(argv[2]) : 0;
  const int count = argc > 3 ? std::atoi(argv[3]) : 8;
  const std::string folder = argc > 4 ? argv[4] : "";
  attention::AttentionSettings settings;
  if (method == "colour") settings.surface.method = attention::Method::kColour;
  if (method == "threshold") settings.surface.method = attention::Method::kThreshold;
  test::AttentionLab lab(settings);
  for (int n = first; n < first + count; ++n) {
    const auto scene = attention::make_scene(1, n);
    std::vector<double> fixation;
    std::vector<double> overlap;
    std::vector<double> threshold;
    std::vector<double> work;
    int frame = 0;
    lab.play(scene, 4.0,
             [&](const test::Judged& row, const Image& left, const attention::Surface* surface,
                 const std::vector<std::uint8_t>& truth) {
               ++frame;
               if (row.time_s > 1.5) {
                 fixation.push_back(row.fixation_px);
                 overlap.push_back(row.overlap);
                 threshold.push_back(row.overlap_threshold);
               }
               if (row.work_s > 0) work.push_back(row.work_s);
               if (folder.empty() || frame % 33 != 0) return;
               cv::Mat rgb(left.height, left.width, CV_8UC3, const_cast<std::uint8_t*>(left.rgb.data()));
               cv::Mat picture;
               cv::cvtColor(rgb, picture, cv::COLOR_RGB2BGR);
               const auto draw = [&](cv::Mat mask, const cv::Scalar& colour) {
                 std::vector<std::vector<cv::Point>> outlines;
                 cv::findContours(mask.clone(), outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
                 cv::drawContours(picture, outlines, -1, colour, 1);
               };
               draw(cv::Mat(left.height, left.width, CV_8U, const_cast<std::uint8_t*>(truth.data())),
                    {255, 255, 255});
               if (surface != nullptr) draw(surface->mask, {255, 0, 255});
               cv::imwrite(folder + "/" + std::to_string(n) + "-" + std::to_string(frame) + ".png", picture);
             });
    std::printf("%2d %-8s %-8s %-14s fixation %5.1f px  overlap %.3f  threshold %.3f  %4.1f ms\n", n,
                scene.moving ? "moving" : "static", scene.clutter ? "clutter" : "alone",
                attention::things()[static_cast<std::size_t>(scene.target.thing)].name.c_str(),
                mean(fixation), mean(overlap), mean(threshold), 1000 * mean(work));
    std::fflush(stdout);
  }
}
