// Pictures and sound on YARP's wire.

#include "nido/yarp/image.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "nido/yarp/bottle.h"

namespace nido::yarp {
namespace {

Image picture(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  image.rgb.resize(static_cast<std::size_t>(width * height * 3));
  std::iota(image.rgb.begin(), image.rgb.end(), std::uint8_t{0});
  return image;
}

void set_word(std::string& bytes, std::size_t index, std::int32_t value) {
  std::memcpy(bytes.data() + index * 4, &value, 4);
}

TEST(YarpImage, RowsArePaddedToEightBytes) {
  for (const auto& [width, height] : {std::pair{64, 48}, {5, 3}, {1, 1}, {0, 0}}) {
    const Image image = picture(width, height);
    const std::string bytes = encode_image(image);
    const std::size_t step = (static_cast<std::size_t>(width) * 3 + 7) / 8 * 8;
    EXPECT_EQ(bytes.size(), 60 + step * static_cast<std::size_t>(height));
    Image again;
    const Status decoded = decode_image(bytes, again);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    EXPECT_EQ(again.rgb, image.rgb);
    EXPECT_EQ(again.width, width);
  }
}

TEST(YarpImage, IsABottleToo) {
  const Result<Bottle> bottle = decode(encode_image(picture(8, 2)), Dialect::k3);
  ASSERT_TRUE(bottle.ok());
  EXPECT_EQ(to_text(Bottle{(*bottle)[0], (*bottle)[1], (*bottle)[2]}), "[mat] [rgb] (3 48 8 8 2)");
}

TEST(YarpImage, OtherPixelsAreTurnedIntoColours) {
  std::string bytes = encode_image(picture(8, 1));
  std::memcpy(bytes.data() + 20, "bgr", 4);
  Image image;
  ASSERT_TRUE(decode_image(bytes, image).ok());
  EXPECT_EQ(image.rgb[0], 2);
  EXPECT_EQ(image.rgb[2], 0);
  // a flag of some versions stands in the upper half of the quantum
  bytes = encode_image(picture(8, 1));
  set_word(bytes, 10, 65'536 + 8);
  EXPECT_TRUE(decode_image(bytes, image).ok());
}

TEST(YarpImage, WhatDoesNotFitIsRefusedAndChangesNothing) {
  const std::string good = encode_image(picture(8, 4));
  Image image = picture(2, 2);
  const Image before = image;
  const auto refused = [&](std::size_t index, std::int32_t value) {
    std::string bytes = good;
    set_word(bytes, index, value);
    const Status decoded = decode_image(bytes, image);
    EXPECT_FALSE(decoded.ok()) << index << " " << value;
    EXPECT_EQ(image.rgb, before.rgb);
  };
  refused(11, -640);  // width
  refused(12, -480);  // height
  refused(11, 65'535);
  refused(12, 0x7fffffff);
  refused(10, 0);  // quantum
  refused(10, 0x7fff);
  refused(5, 0x21212121);  // pixels of no known kind
  refused(0, 255);
  refused(13, 4);
  EXPECT_FALSE(decode_image(good.substr(0, 59), image).ok());
  EXPECT_FALSE(decode_image(good.substr(0, good.size() - 1), image).ok());
  EXPECT_FALSE(decode_image("", image).ok());
}

TEST(YarpSound, ChannelsFollowEachOther) {
  const Sound sound{0, 16'000, 2, {1, -1, 2, -2, 3, -3}};
  const std::string bytes = encode_sound(sound);
  EXPECT_EQ(to_text(*decode(bytes, Dialect::k3)), "3 2 2 16000 (1 2 3 -1 -2 -3)");
  Sound again;
  ASSERT_TRUE(decode_sound(bytes, again).ok());
  EXPECT_EQ(again.samples, sound.samples);
  EXPECT_EQ(again.channels, 2);
  for (const auto& [index, value] :
       {std::pair<std::size_t, std::int32_t>{3, 4}, {5, 0}, {5, 1000}, {7, 4}, {9, -1}, {11, 7}}) {
    std::string wrong = bytes;
    set_word(wrong, index, value);
    EXPECT_FALSE(decode_sound(wrong, again).ok()) << index;
  }
}

}  // namespace
}  // namespace nido::yarp
