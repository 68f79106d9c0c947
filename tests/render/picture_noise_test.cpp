#include "nido/simulator/render/picture_noise.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nido::sim {
namespace {

Image flatPicture(int width, int height, std::uint8_t value) {
  Image picture;
  picture.width = width;
  picture.height = height;
  picture.rgb.assign(static_cast<std::size_t>(3 * width * height), value);
  return picture;
}

PictureNoise makeNoise(const NoiseOptions& options) {
  Result<PictureNoise> made = PictureNoise::create(options);
  EXPECT_TRUE(made.ok());
  return std::move(made).value();
}

TEST(PictureNoise, HasTheDeviationThatWasAskedFor) {
  for (const double sigma : {1.0, 5.0, 20.0}) {
    PictureNoise noise = makeNoise({.noise_levels = sigma});
    Image picture = flatPicture(320, 240, 128);
    noise.apply(picture, 1);
    double sum = 0;
    double squares = 0;
    for (const std::uint8_t value : picture.rgb) {
      sum += value - 128.0;
      squares += (value - 128.0) * (value - 128.0);
    }
    const double n = static_cast<double>(picture.rgb.size());
    EXPECT_NEAR(sum / n, 0, 0.05 * sigma);
    EXPECT_NEAR(std::sqrt(squares / n), sigma, 0.06 * sigma);
  }
}

TEST(PictureNoise, RepeatsForTheSameSeedAndMomentOnly) {
  const auto taken = [](std::uint64_t seed, std::initializer_list<std::uint64_t> moments) {
    PictureNoise noise = makeNoise({.noise_levels = 4, .seed = seed});
    Image picture;
    for (const std::uint64_t moment : moments) {
      picture = flatPicture(64, 48, 100);
      noise.apply(picture, moment);
    }
    return picture.rgb;
  };
  EXPECT_EQ(taken(3, {7}), taken(3, {7}));
  EXPECT_EQ(taken(3, {7}), taken(3, {2, 9, 7})) << "whatever was taken before";
  EXPECT_NE(taken(3, {7}), taken(3, {8})) << "every picture has its own noise";
  EXPECT_NE(taken(3, {7}), taken(4, {7}));
  EXPECT_NE(taken(3, {7}), taken(4, {6})) << "and is not one of another camera's";
}

TEST(PictureNoise, BlurSpreadsAPointAndKeepsItsLightAndPlace) {
  PictureNoise noise = makeNoise({.blur_px = 1.0});
  Image picture = flatPicture(31, 31, 0);
  for (int row = 14; row <= 16; ++row) {
    for (int column = 14; column <= 16; ++column)
      picture.rgb[static_cast<std::size_t>(3 * (row * 31 + column))] = 250;
  }
  noise.apply(picture, 1);
  double sum = 0;
  double x = 0;
  double spread = 0;
  for (int row = 0; row < 31; ++row) {
    for (int column = 0; column < 31; ++column) {
      const double value = picture.rgb[static_cast<std::size_t>(3 * (row * 31 + column))];
      sum += value;
      x += value * column;
      spread += value * (column - 15) * (column - 15);
    }
  }
  EXPECT_NEAR(sum / (9 * 250), 1, 0.02);
  EXPECT_NEAR(x / sum, 15, 1e-9);
  EXPECT_NEAR(spread / sum, 2.0 / 3 + 1.0, 0.1) << "variance of the square plus that of the lens";
  EXPECT_EQ(picture.rgb[3 * (15 * 31 + 15) + 1], 0) << "channels do not mix";
  Image flat = flatPicture(20, 10, 77);
  noise.apply(flat, 1);
  EXPECT_EQ(flat.rgb, flatPicture(20, 10, 77).rgb) << "no dark rim";
}

TEST(PictureNoise, RefusesBadValues) {
  EXPECT_FALSE(PictureNoise::create({.blur_px = -1}).ok());
  EXPECT_FALSE(PictureNoise::create({.blur_px = 6}).ok());
  EXPECT_FALSE(PictureNoise::create({.blur_px = std::nan("")}).ok());
  EXPECT_FALSE(PictureNoise::create({.noise_levels = 100}).ok());
}

}  // namespace
}  // namespace nido::sim
