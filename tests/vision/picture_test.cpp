// Colours, blobs, patches, templates and encoders: from drawn pictures and texts.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "nido/vision/head_history.h"
#include "nido/vision/picture_filter.h"
#include "nido/vision/templates.h"

namespace nido::vision {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

Image plain(int width, int height, Rgb colour) {
  Image image;
  image.width = width;
  image.height = height;
  for (int i = 0; i < width * height; ++i) image.rgb.insert(image.rgb.end(), colour.begin(), colour.end());
  return image;
}

template <class Inside>
void draw(Image& image, Rgb colour, Inside inside) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!inside(x + 0.5, y + 0.5)) continue;
      for (int k = 0; k < 3; ++k)
        image.rgb[static_cast<std::size_t>((y * image.width + x) * 3 + k)] = colour[k];
    }
  }
}

std::vector<ColourModel> two_colours() {
  return {{"red", 0, 12, 0.4, 1, 0.2}, {"blue", 240, 12, 0.4, 1, 0.2}};
}

TEST(PictureFilter, GrainIsMeasuredAndSmoothed) {
  std::mt19937_64 random(1);
  for (const double levels : {0.0, 3.0, 6.0, 12.0}) {
    std::normal_distribution<double> grain(0.0, std::max(levels, 1e-9));
    Image image = plain(120, 80, {120, 60, 200});
    draw(image, {40, 140, 90}, [](double x, double y) { return std::hypot(x - 60, y - 40) < 20; });
    for (auto& value : image.rgb)
      value = static_cast<std::uint8_t>(std::clamp(std::lround(value + grain(random)), 0L, 255L));
    const double measured = noise_levels(image);
    EXPECT_NEAR(measured, levels, 0.25 * levels + 0.5);
    smooth(image);
    EXPECT_LT(noise_levels(image), 0.5 * levels + 0.5);
    // the disc is where it was
    const auto at = [&](int x, int y) { return image.rgb[static_cast<std::size_t>((y * 120 + x) * 3 + 2)]; };
    EXPECT_NEAR(at(60, 40), 90, 2 * levels + 1);
    EXPECT_NEAR(at(10, 10), 200, 2 * levels + 1);
  }
}

TEST(PictureFilter, DoesNotMindTinyPictures) {
  Image image = plain(2, 2, {1, 2, 3});
  smooth(image);
  EXPECT_EQ(noise_levels(image), 0.0);
  EXPECT_EQ(image.rgb[0], 1);
}

TEST(Colour, HueSaturationValueOfKnownColours) {
  EXPECT_DOUBLE_EQ(to_hsv(1, 0, 0).hue_deg, 0);
  EXPECT_DOUBLE_EQ(to_hsv(0, 1, 0).hue_deg, 120);
  EXPECT_DOUBLE_EQ(to_hsv(0, 0, 1).hue_deg, 240);
  EXPECT_DOUBLE_EQ(to_hsv(1, 0, 1).hue_deg, 300);
  EXPECT_DOUBLE_EQ(to_hsv(0.5, 0.5, 0.5).saturation, 0);
  EXPECT_DOUBLE_EQ(to_hsv(0, 0, 0).value, 0);
  EXPECT_DOUBLE_EQ(hue_distance_deg(350, 10), 20);
}

TEST(Colour, TableTellsShadesFromOtherColours) {
  const ColourTable table(two_colours());
  EXPECT_EQ(table.classify(220, 10, 10), 0);
  EXPECT_EQ(table.classify(80, 10, 10), 0);  // in the shade
  EXPECT_EQ(table.classify(220, 0, 25), 0);  // hue just below 360
  EXPECT_EQ(table.classify(10, 10, 220), 1);
  EXPECT_EQ(table.classify(20, 2, 2), ColourTable::kNone);       // too dark to tell
  EXPECT_EQ(table.classify(220, 180, 180), ColourTable::kNone);  // too pale
  EXPECT_EQ(table.classify(10, 220, 10), ColourTable::kNone);
}

TEST(Blob, FindsDiscAndBoxWithTheirCentres) {
  Image image = plain(320, 240, {200, 190, 180});
  draw(image, {220, 10, 10}, [](double x, double y) { return std::hypot(x - 100.3, y - 80.7) < 20; });
  draw(image, {10, 10, 220}, [](double x, double y) { return x > 200 && x < 240 && y > 150 && y < 170; });
  draw(image, {220, 10, 10}, [](double x, double y) { return x < 3 && y < 3; });  // 9 pixels: too small
  BlobFinder finder(ColourTable(two_colours()), 12);
  const auto& blobs = finder.find(image);
  ASSERT_EQ(blobs.size(), 2U);
  EXPECT_EQ(blobs[0].colour, 0);
  EXPECT_LT((blobs[0].centroid_px - Eigen::Vector2d(100.3, 80.7)).norm(), 0.2);
  EXPECT_LT((centroid(blobs[0].hull) - Eigen::Vector2d(100.3, 80.7)).norm(), 0.3);
  EXPECT_NEAR(area(blobs[0].hull), M_PI * 400, 0.02 * M_PI * 400);
  EXPECT_EQ(blobs[1].area_px, 800);
  EXPECT_EQ(blobs[1].box(), (std::array<double, 4>{200, 150, 40, 20}));
  EXPECT_FALSE(blobs[1].touches_border);
}

TEST(Blob, JoinsBranchesAndKeepsColoursApart) {
  Image image = plain(64, 64, {0, 0, 0});
  // a U whose arms meet only in the last rows, and blue between the arms
  draw(image, {220, 10, 10}, [](double x, double y) {
    return (x > 10 && x < 14 && y > 10 && y < 50) || (x > 30 && x < 34 && y > 10 && y < 50) ||
           (y > 46 && y < 50 && x > 10 && x < 34);
  });
  draw(image, {10, 10, 220}, [](double x, double y) { return x > 14 && x < 30 && y > 20 && y < 40; });
  BlobFinder finder(ColourTable(two_colours()), 12);
  EXPECT_EQ(finder.find(image).size(), 2U);
  draw(image, {220, 10, 10}, [](double x, double) { return x > 60; });
  EXPECT_TRUE(finder.find(image).back().touches_border || finder.find(image)[1].touches_border);
  EXPECT_TRUE(finder.find(plain(64, 64, {0, 0, 0})).empty());
}

TEST(Patch, CorrelatesShapesNotSizes) {
  const ColourTable table(two_colours());
  const auto patch_of = [&](auto inside) {
    Image image = plain(160, 160, {200, 190, 180});
    draw(image, {220, 10, 10}, inside);
    BlobFinder finder(table, 12);
    return cut_patch(image, finder.find(image).front(), table);
  };
  const Patch disc = patch_of([](double x, double y) { return std::hypot(x - 60, y - 60) < 20; });
  const Patch big_disc = patch_of([](double x, double y) { return std::hypot(x - 80, y - 80) < 41; });
  const Patch diamond = patch_of([](double x, double y) { return std::abs(x - 60) + std::abs(y - 60) < 25; });
  EXPECT_NEAR(correlation(disc, disc), 1, 1e-5);
  EXPECT_GT(correlation(disc, big_disc), 0.95);
  EXPECT_LT(correlation(disc, diamond), 0.75);
}

class TemplateFile : public ::testing::Test {
 protected:
  // What loading a text says.
  std::string refusal(const std::string& text) {
    const auto path =
        std::filesystem::temp_directory_path() / ("nido_templates_" + std::to_string(::getpid()) + ".yaml");
    std::ofstream(path) << text;
    const auto loaded = TemplateSet::load(path);
    std::filesystem::remove(path);
    return loaded ? "" : loaded.error().message;
  }
  const std::string good =
      "colours:\n  - {name: red, hue_deg: 0, hue_tolerance_deg: 10, saturation_min: 0.4, saturation_max: 1, "
      "value_min: 0.2}\n"
      "marks: {knuckle: red, wrist: red}\nobjects:\n  - name: red ball\n    colour: red\n    shape: ball\n   "
      " symmetry_deg: 0\n"
      "    body:\n      - {sphere_m: 0.03}\n";
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  }
};

TEST_F(TemplateFile, GoodOnesComeBackAsWritten) {
  EXPECT_EQ(refusal(good), "");
  const auto set = TemplateSet::load(std::string(NIDO_CONFIG_DIR) + "/objects/templates.yaml");
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->objects.size(), 8U);
  EXPECT_EQ(refusal(set->to_yaml()), "");
}

TEST_F(TemplateFile, WhatIsTaughtIsKeptApartAndComesBack) {
  const auto shipped = TemplateSet::load(std::string(NIDO_CONFIG_DIR) + "/objects/templates.yaml");
  ASSERT_TRUE(shipped.ok()) << shipped.error().message;
  TemplateSet known = *shipped;
  known.colours.push_back({"hue 25", 25, 10, 0.5, 1, 0.3});
  ObjectTemplate lemon{"lemon", "hue 25", "ball", {}, {}};
  lemon.body.solids = {{Solid::Kind::kSphere, {0.03, 0, 0}, {0, 0, 0}}};
  known.objects.push_back(lemon);
  const auto path = std::filesystem::temp_directory_path() /
                    ("nido_templates_taught_" + std::to_string(::getpid()) + ".yaml");
  ASSERT_TRUE(known.from(shipped->objects.size()).save(path));
  const auto kept = TemplateSet::load(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  ASSERT_EQ(kept->objects.size(), 1U);
  EXPECT_EQ(kept->objects[0].name, "lemon");

  TemplateSet again = *shipped;
  again.add(*kept);
  EXPECT_EQ(again.colours.size(), shipped->colours.size() + 1);
  EXPECT_EQ(again.objects.size(), shipped->objects.size() + 1);
  EXPECT_NE(again.colour_index("hue 25"), -1);
  EXPECT_EQ(again.objects.back().name, "lemon");

  const Status refused = kept->save("/no/such/folder/taught.yaml");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("/no/such/folder/taught.yaml"), std::string::npos);
}

TEST_F(TemplateFile, BadOnesAreRefusedWithTheLine) {
  EXPECT_NE(refusal(replaced(good, "hue_deg: 0", "hue_deg: 400")).find("line 2"), std::string::npos);
  EXPECT_NE(refusal(replaced(good, "hue_deg: 0", "hue: 0")).find("hue_tolerance_deg"), std::string::npos);
  EXPECT_NE(refusal(replaced(good, "    colour: red", "    colour: pink")).find("pink"), std::string::npos);
  EXPECT_NE(refusal(replaced(good, "{sphere_m: 0.03}", "{sphere_m: -1}")).find("number"), std::string::npos);
  EXPECT_NE(refusal(replaced(good, "{sphere_m: 0.03}", "{at_m: [0, 0, 0]}")).find("one of"),
            std::string::npos);
  EXPECT_NE(
      refusal(replaced(good, "marks: {knuckle: red, wrist: red}", "marks: {knuckle: red}")).find("wrist"),
      std::string::npos);
  EXPECT_NE(refusal(good + "    patches: [abc]\n").find("letters"), std::string::npos);
  EXPECT_NE(refusal("colours: [").find("line"), std::string::npos);
  EXPECT_NE(refusal("7").find("map"), std::string::npos);
  const auto missing = TemplateSet::load("no/such/file.yaml");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
}

TEST(EncoderHistory, InterpolatesAndRefuses) {
  EncoderHistory history(2);
  EXPECT_TRUE(history.empty());
  EXPECT_TRUE(history.at(Time{0}).empty());
  EXPECT_TRUE(history.add({Time{0}, {0, 1}, {}}).ok());
  EXPECT_TRUE(history.add({Time{10'000'000}, {0.1, 1}, {}}).ok());
  EXPECT_NEAR(history.at(Time{5'000'000})[0], 0.05, 1e-12);
  EXPECT_EQ(history.at(Time{-5})[0], 0);
  EXPECT_EQ(history.at(Time{20'000'000})[0], 0.1);
  EXPECT_NEAR(history.speed_rad_s(), 10, 1e-9);
  EXPECT_FALSE(history.add({Time{20'000'000}, {0.1}, {}}).ok());
  EXPECT_FALSE(history.add({Time{20'000'000}, {0.1, NAN}, {}}).ok());
  EXPECT_FALSE(history.add({Time{5'000'000}, {0.1, 1}, {}}).ok());
  EXPECT_EQ(history.latest().stamp, Time{10'000'000});
  EXPECT_TRUE(history.add({Time{3'000'000'000}, {0.2, 1}, {}}).ok());
  EXPECT_EQ(history.at(Time{0})[0], 0.2);  // older ones are forgotten
}

}  // namespace
}  // namespace nido::vision
