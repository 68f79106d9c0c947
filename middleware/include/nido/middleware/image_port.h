#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "nido/interfaces/result.h"
#include "nido/middleware/direct_port.h"

namespace nido {

// Images without a copy: what is painted into the place that ImageOutput gives is what an image input of this
// computer reads. On the wire it is sensor_msgs/msg/Image like any other: all inputs of that type can be
// connected, and ROS 2 sees it.

struct ImageFormat {
  std::uint32_t width = 0;   // px
  std::uint32_t height = 0;  // px
  std::uint32_t step = 0;    // bytes of a row
  std::string encoding = "rgb8";
  std::string frame_id;
};

// One thread uses it at a time.
class ImageOutput {
 public:
  static Result<std::unique_ptr<ImageOutput>> open(Node& node, const std::string& port_name,
                                                   Profile profile = Profile::kSensor);
  // The place for the height * step bytes of the next image, valid until send(); what was in it is not known.
  Result<std::span<std::uint8_t>> begin(const ImageFormat& format, Time time);
  Status send();
  [[nodiscard]] RawOutput& port() { return *port_; }

 private:
  std::unique_ptr<RawOutput> port_;
  std::size_t bytes_ = 0;
};

// An image that has arrived. Valid during the call.
struct ImageView {
  Time time;
  std::string_view frame_id;
  std::string_view encoding;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t step = 0;
  std::span<const std::uint8_t> pixels;
};

// kInvalidArgument for what is not a whole serialized sensor_msgs/msg/Image.
Result<ImageView> view_image(std::span<const std::uint8_t> payload);

// An input that hands over each image (hand_over in direct_port.h tells what the handler may do); it reads in
// place, so a handler that takes long keeps the output from using that place again.
Result<std::unique_ptr<RawInput>> open_image_input(
    Node& node, const std::string& port_name, Profile profile,
    std::function<void(const ImageView& image, const Arrival& arrival)> handler);

}  // namespace nido
