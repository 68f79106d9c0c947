#include "nido/judge/stage_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace nido {

namespace {

constexpr std::size_t kFramesKept = 12;
constexpr int kEnlarge = 2;  // eyes are small: twice the size makes room for names
constexpr std::array<const char*, 3> kCameraName = {"left", "right", "outside"};
constexpr std::array<const char*, 3> kCameraCaption = {"left eye", "right eye", "from outside"};

// a name that is safe in a file name
std::string plain(const std::string& name) {
  std::string result;
  for (const char c : name) result += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '-';
  return result;
}

void draw_box(cv::Mat& image, const std::array<double, 4>& box, const std::string& label,
              const cv::Scalar& colour) {
  if (!(box[2] > 0.0) || !(box[3] > 0.0) || !std::isfinite(box[0] + box[1] + box[2] + box[3])) return;
  const cv::Rect rect(
      static_cast<int>(std::lround(kEnlarge * box[0])), static_cast<int>(std::lround(kEnlarge * box[1])),
      static_cast<int>(std::lround(kEnlarge * box[2])), static_cast<int>(std::lround(kEnlarge * box[3])));
  cv::rectangle(image, rect, colour, 1, cv::LINE_AA);
  const int base = rect.y > 14 ? rect.y - 4 : rect.y + rect.height + 14;
  cv::putText(image, label, {rect.x, base}, cv::FONT_HERSHEY_SIMPLEX, 0.42, {0, 0, 0}, 3, cv::LINE_AA);
  cv::putText(image, label, {rect.x, base}, cv::FONT_HERSHEY_SIMPLEX, 0.42, colour, 1, cv::LINE_AA);
}

}  // namespace

void StagePictures::frame(Camera camera, CameraFrame frame) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.rgb.size() !=
          static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) * 3) {
    return;
  }
  auto& frames = frames_[static_cast<std::size_t>(camera)];
  frames.push_back(std::move(frame));
  if (frames.size() > kFramesKept) frames.pop_front();
}

void StagePictures::found(std::int64_t stamp_ns, std::vector<FoundBox> objects) {
  found_ns_ = stamp_ns;
  objects_ = std::move(objects);
}

void StagePictures::hand(const FoundBox& hand, bool visible) {
  hand_ = hand;
  hand_visible_ = visible;
}

const CameraFrame* StagePictures::choose(Camera camera) const {
  const auto& frames = frames_[static_cast<std::size_t>(camera)];
  if (frames.empty()) return nullptr;
  if (camera != Camera::kOutside) {
    const auto looked_at = std::find_if(frames.begin(), frames.end(), [this](const CameraFrame& frame) {
      return frame.stamp_ns == found_ns_;
    });
    if (looked_at != frames.end()) return &*looked_at;
  }
  return &frames.back();
}

std::vector<Picture> StagePictures::capture(const std::string& name, std::vector<std::string>& troubles) {
  ++number_;
  std::vector<Picture> pictures;
  for (const Camera camera : {Camera::kLeft, Camera::kRight, Camera::kOutside}) {
    const CameraFrame* frame = choose(camera);
    if (frame == nullptr) continue;
    const auto index = static_cast<std::size_t>(camera);
    const cv::Mat rgb(frame->height, frame->width, CV_8UC3,
                      const_cast<std::uint8_t*>(frame->rgb.data()));  // NOLINT
    cv::Mat image;
    cv::cvtColor(rgb, image, cv::COLOR_RGB2BGR);
    if (camera != Camera::kOutside) {
      cv::resize(image, image, {}, kEnlarge, kEnlarge, cv::INTER_CUBIC);
      const auto side = [camera](const FoundBox& box) {
        return camera == Camera::kLeft ? box.left : box.right;
      };
      for (const FoundBox& object : objects_) draw_box(image, side(object), object.label, {255, 255, 255});
      if (hand_visible_) draw_box(image, side(hand_), hand_.label, {80, 255, 255});
    }
    const std::string file = fmt::format("stage-{:02d}-{}-{}.png", number_, plain(name), kCameraName[index]);
    bool written = false;
    try {
      written = cv::imwrite(folder_ + "/" + file, image);
    } catch (const cv::Exception&) {
      written = false;
    }
    if (written) {
      pictures.push_back({file, kCameraCaption[index]});
    } else {
      troubles.push_back(fmt::format("cannot write the picture {}/{}", folder_, file));
    }
  }
  return pictures;
}

}  // namespace nido
