#include "nido/yarp/image.h"

#include <fmt/format.h>

#include <cstring>

#include "nido/value/bytes.h"

namespace nido::yarp {
namespace {

constexpr std::size_t kHeaderBytes = 60;
constexpr std::int32_t kQuantum = 8;  // bytes that rows are padded to
constexpr std::int32_t kLargestSide = 16384;

constexpr std::int32_t code(const char (&letters)[5]) {
  return letters[0] | letters[1] << 8 | letters[2] << 16 | letters[3] << 24;
}
constexpr std::int32_t kRgb = code("rgb\0");

// where red, green and blue are within a pixel
struct Pixel {
  std::int32_t code;
  int bytes;
  int red;
  int green;
  int blue;
};
constexpr Pixel kPixels[] = {{kRgb, 3, 0, 1, 2},
                             {code("bgr\0"), 3, 2, 1, 0},
                             {code("rgba"), 4, 0, 1, 2},
                             {code("bgra"), 4, 2, 1, 0},
                             {code("mono"), 1, 0, 0, 0}};

std::size_t padded(std::size_t row, std::size_t quantum) { return (row + quantum - 1) / quantum * quantum; }

Error wrong(std::string what) { return {ErrorCode::kInvalidArgument, std::move(what)}; }

}  // namespace

std::string encode_image(const Image& image) {
  std::string out;
  encode_image(image.width, image.height, image.rgb, static_cast<std::size_t>(image.width) * 3, out);
  return out;
}

void encode_image(int width, int height, std::span<const std::uint8_t> pixels, std::size_t step,
                  std::string& out) {
  const std::size_t row = static_cast<std::size_t>(width) * 3;
  const std::size_t padding = padded(row, kQuantum) - row;
  const auto size = static_cast<std::int32_t>((row + padding) * static_cast<std::size_t>(height));
  out.clear();
  out.reserve(kHeaderBytes + static_cast<std::size_t>(size));
  for (const std::int32_t word :
       {256, 4, 9, code("mat\0"), 9, kRgb, 257, 5, 3, size, kQuantum, static_cast<std::int32_t>(width),
        static_cast<std::int32_t>(height), 12, size}) {
    put(out, word);
  }
  const char* from = reinterpret_cast<const char*>(pixels.data());
  if (padding == 0 && step == row) {
    out.append(from, static_cast<std::size_t>(size));
    return;
  }
  for (int i = 0; i < height; ++i, from += step) {
    out.append(from, row);
    out.append(padding, '\0');
  }
}

Status decode_image(std::string_view bytes, Image& image) {
  if (bytes.size() < kHeaderBytes) return wrong("an image of fewer than 60 bytes");
  const auto word = [&](std::size_t index) { return get_at<std::int32_t>(bytes, index * 4); };
  if (word(0) != 256 || word(1) != 4 || word(2) != 9 || word(3) != code("mat\0") || word(4) != 9 ||
      word(6) != 257 || word(7) != 5 || word(13) != 12) {
    return wrong("this is no image: its header is another one's");
  }
  const Pixel* pixel = nullptr;
  for (const Pixel& known : kPixels) {
    if (known.code == word(5)) pixel = &known;
  }
  if (pixel == nullptr) {
    return wrong(
        fmt::format("pixels of code {} cannot be had as colours: rgb, bgr, rgba, bgra, mono can", word(5)));
  }
  const std::int32_t width = word(11);
  const std::int32_t height = word(12);
  if (width < 0 || height < 0 || width > kLargestSide || height > kLargestSide) {
    return wrong(fmt::format("an image of {} x {} pixels: 0 to {} are allowed", width, height, kLargestSide));
  }
  // the upper half of this word is a flag of some versions
  const std::int32_t quantum = word(10) & 0xffff;
  if (quantum < 1 || quantum > 4096) return wrong(fmt::format("rows padded to {} bytes", quantum));
  const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(pixel->bytes);
  const std::size_t step = padded(row, static_cast<std::size_t>(quantum));
  if (bytes.size() - kHeaderBytes != step * static_cast<std::size_t>(height)) {
    return wrong(fmt::format("{} bytes of pixels for {} x {} pixels: {} are expected",
                             bytes.size() - kHeaderBytes, width, height,
                             step * static_cast<std::size_t>(height)));
  }
  image.width = width;
  image.height = height;
  image.rgb.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  std::uint8_t* out = image.rgb.data();
  for (int y = 0; y < height; ++y) {
    const auto* in = reinterpret_cast<const std::uint8_t*>(bytes.data() + kHeaderBytes) +
                     static_cast<std::size_t>(y) * step;
    if (pixel->code == kRgb) {
      std::memcpy(out, in, row);
      out += row;
      continue;
    }
    for (int x = 0; x < width; ++x, in += pixel->bytes) {
      *out++ = in[pixel->red];
      *out++ = in[pixel->green];
      *out++ = in[pixel->blue];
    }
  }
  return {};
}

}  // namespace nido::yarp
