#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"

namespace nido::yarp {

// A colour picture as YARP's images travel: a header of 60 bytes, then rows from the top, each padded to a
// multiple of 8 bytes. The quantum is written as the plain number 8, which readers of every version take.
[[nodiscard]] std::string encode_image(const Image& image);
// The same of rows of rgb that are `step` bytes apart, into a string whose memory is used again.
void encode_image(int width, int height, std::span<const std::uint8_t> pixels, std::size_t step,
                  std::string& out);
// Reads rgb, bgr, rgba, bgra and mono; other pixels are refused, and so are sizes that do not fit the bytes.
// Rows are taken from the top: the flag beside the quantum, which some versions write, means different things
// in different versions. The stamp is left alone.
Status decode_image(std::string_view bytes, Image& image);

// A piece of sound: a list of samples of each channel, channels, bytes of a sample, samples a second, and the
// list of 16-bit samples, one channel after the other. The stamp is left alone.
[[nodiscard]] std::string encode_sound(const Sound& sound);
Status decode_sound(std::string_view bytes, Sound& sound);

}  // namespace nido::yarp
