#include "jpeg.h"

#include <gtest/gtest.h>

#include <cstdio>
// after cstdio, which it needs
#include <jpeglib.h>

#include <cmath>
#include <cstdlib>
#include <vector>

namespace nido {
namespace {

// The picture that a reader sees.
std::vector<std::uint8_t> read_back(const std::string& bytes, std::uint32_t& width, std::uint32_t& height) {
  jpeg_decompress_struct job{};
  jpeg_error_mgr handler{};
  job.err = jpeg_std_error(&handler);
  jpeg_create_decompress(&job);
  jpeg_mem_src(&job, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&job, TRUE);
  job.out_color_space = JCS_RGB;
  jpeg_start_decompress(&job);
  width = job.output_width;
  height = job.output_height;
  std::vector<std::uint8_t> pixels(std::size_t{3} * width * height);
  while (job.output_scanline < job.output_height) {
    auto* row = pixels.data() + std::size_t{3} * width * job.output_scanline;
    jpeg_read_scanlines(&job, &row, 1);
  }
  jpeg_finish_decompress(&job);
  jpeg_destroy_decompress(&job);
  return pixels;
}

TEST(Jpeg, ShowsTheColoursOfThePicture) {
  constexpr std::uint32_t kWidth = 64;
  constexpr std::uint32_t kHeight = 48;
  constexpr std::uint32_t kStep = 3 * kWidth + 5;
  for (const std::string& encoding : {std::string("rgb8"), std::string("bgr8")}) {
    std::vector<std::uint8_t> picture(std::size_t{kStep} * kHeight);
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        std::uint8_t* pixel = &picture[std::size_t{y} * kStep + std::size_t{3} * x];
        pixel[encoding == "rgb8" ? 0 : 2] = static_cast<std::uint8_t>(4 * x);
        pixel[1] = static_cast<std::uint8_t>(5 * y);
        pixel[encoding == "rgb8" ? 2 : 0] = 30;
      }
    }
    const auto jpeg = jpeg_of({picture.data(), picture.size(), kWidth, kHeight, kStep, encoding}, 95);
    ASSERT_TRUE(jpeg) << jpeg.error().message;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    const auto seen = read_back(*jpeg, width, height);
    ASSERT_EQ(width, kWidth);
    ASSERT_EQ(height, kHeight);
    double worst = 0;
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const std::uint8_t* pixel = &seen[(std::size_t{y} * kWidth + x) * 3];
        for (const double difference : {pixel[0] - 4.0 * x, pixel[1] - 5.0 * y, pixel[2] - 30.0}) {
          worst = std::max(worst, std::abs(difference));
        }
      }
    }
    EXPECT_LT(worst, 25) << encoding;
  }
}

TEST(Jpeg, RefusesWhatDoesNotFit) {
  const std::vector<std::uint8_t> bytes(300);
  EXPECT_TRUE(jpeg_of({bytes.data(), bytes.size(), 10, 10, 30, "rgb8"}, 80));
  EXPECT_FALSE(jpeg_of({bytes.data(), bytes.size() - 1, 10, 10, 30, "rgb8"}, 80));
  EXPECT_FALSE(jpeg_of({bytes.data(), bytes.size(), 10, 10, 29, "rgb8"}, 80));
  EXPECT_FALSE(jpeg_of({bytes.data(), bytes.size(), 0, 10, 30, "rgb8"}, 80));
  EXPECT_FALSE(jpeg_of({bytes.data(), bytes.size(), 0x80000000U, 2, 30, "rgb8"}, 80));
  EXPECT_FALSE(jpeg_of({bytes.data(), bytes.size(), 10, 10, 30, "16UC1"}, 80));
}

}  // namespace
}  // namespace nido
