#pragma once

// What every node has that sees with the robot's eyes: the ports of pictures, cameras and the joints that
// carry the eyes. Heavy, as open_port.h: for .cpp files that open ports.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "nido/vision/head_history.h"

namespace nido::vision {

// Not thread-safe.
struct EyePorts {
  std::array<std::unique_ptr<Input<msgs::Image>>, 2> image;  // left, right
  std::array<std::unique_ptr<Input<msgs::CameraInfo>>, 2> info;
  std::unique_ptr<Input<msgs::JointState>> head;
  std::unique_ptr<Input<msgs::JointState>> torso;

  // PREFIX/left:i, right:i, left_info:i, right_info:i, head:i, torso:i.
  Status open(Node& node, const std::string& prefix) {
    if (Status s = open_into(node, image[0], prefix + "/left:i", Profile::kSensor, 4); !s) return s;
    if (Status s = open_into(node, image[1], prefix + "/right:i", Profile::kSensor, 4); !s) return s;
    if (Status s = open_into(node, info[0], prefix + "/left_info:i", Profile::kState, 4); !s) return s;
    if (Status s = open_into(node, info[1], prefix + "/right_info:i", Profile::kState, 4); !s) return s;
    if (Status s = open_into(node, head, prefix + "/head:i", Profile::kState, 64); !s) return s;
    return open_into(node, torso, prefix + "/torso:i", Profile::kState, 64);
  }

  // What arrived since the last time: all encoders, the newest pictures and cameras.
  template <class Inputs>
  void take_into(Inputs& in) {
    take_encoders(*head, in.head);
    take_encoders(*torso, in.torso);
    in.left = take_picture(*image[0]);
    in.right = take_picture(*image[1]);
    in.left_info = take_camera(*info[0]);
    in.right_info = take_camera(*info[1]);
  }

 private:
  static void take_encoders(Input<msgs::JointState>& port, std::vector<EncoderSample>& out) {
    while (auto message = port.take()) {
      out.push_back(
          {time_of(message->header()), std::move(message->position()), std::move(message->velocity())});
    }
  }
  static std::optional<Image> take_picture(Input<msgs::Image>& port) {
    auto message = port.take_latest();
    if (!message) return std::nullopt;
    Image image;
    image.stamp_ns = time_of(message->header()).ns;
    image.width = static_cast<int>(message->width());
    image.height = static_cast<int>(message->height());
    // other encodings are refused by those who expect three bytes a pixel
    if (message->encoding() == "rgb8") image.rgb = std::move(message->data());
    return image;
  }
  static std::optional<CameraInfo> take_camera(Input<msgs::CameraInfo>& port) {
    const auto message = port.take_latest();
    if (!message) return std::nullopt;
    CameraInfo camera;
    camera.width = static_cast<int>(message->width());
    camera.height = static_cast<int>(message->height());
    camera.fx_px = message->k()[0];
    camera.cx_px = message->k()[2];
    camera.fy_px = message->k()[4];
    camera.cy_px = message->k()[5];
    return camera;
  }
};

}  // namespace nido::vision
