#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido::bench {

constexpr std::uint32_t kWidth = 640;
constexpr std::uint32_t kHeight = 480;
constexpr std::size_t kImage_bytes = std::size_t{kWidth} * kHeight * 3;

// The sending side of one way that images go.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  [[nodiscard]] virtual std::string address() const { return ""; }
  // Waits until the other side is there.
  virtual Status connect() = 0;
  // Sends one image: `fill` writes its kImage_bytes into the place that it is given.
  virtual void send(const std::function<void(std::uint8_t* pixels)>& fill) = 0;
};

// Called when an image has arrived.
using ImageSink = std::function<void(std::span<const std::uint8_t> pixels)>;

struct ImageWay {
  std::string who;
  std::string absent;  // why this build does not have it
  std::function<Result<std::unique_ptr<ImageSource>>(int domain)> send;
  // Gives `sink` what comes, on any thread, until the parent process closes its end. `wait` returns then.
  std::function<Status(int domain, const std::string& address, const ImageSink& sink,
                       const std::function<void()>& wait)>
      receive;
};

ImageWay nido_image();         // painted and read in place
ImageWay nido_image_copied();  // by ports like any other
ImageWay plain_fast_dds_image();
ImageWay bare_ring_image();
ImageWay unix_socket_image();

}  // namespace nido::bench
