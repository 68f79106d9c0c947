#include "textures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nido::sim {
namespace {

constexpr int kN = kTextureSize;
constexpr double kPi = std::numbers::pi;

// A value in 0..1 for a cell of a grid; the same on every machine.
double cellValue(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x8da6b343U + y * 0xd8163841U + seed * 0xcb1ab31fU;
  h ^= h >> 15;
  h *= 0x2c1b3c6dU;
  h ^= h >> 12;
  h *= 0x297a2d39U;
  h ^= h >> 15;
  return h / 4294967295.0;
}

// Smooth noise in 0..1 with cells_u x cells_v cells over the pattern; repeats. u and v in 0..1.
double noise(double u, double v, int cells_u, int cells_v, std::uint32_t seed) {
  const double x = (u - std::floor(u)) * cells_u;
  const double y = (v - std::floor(v)) * cells_v;
  const int x0 = static_cast<int>(x) % cells_u;
  const int y0 = static_cast<int>(y) % cells_v;
  const int x1 = (x0 + 1) % cells_u;
  const int y1 = (y0 + 1) % cells_v;
  const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
  const double a = smooth(x - std::floor(x));
  const double b = smooth(y - std::floor(y));
  const auto at = [&](int i, int j) {
    return cellValue(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), seed);
  };
  return std::lerp(std::lerp(at(x0, y0), at(x1, y0), a), std::lerp(at(x0, y1), at(x1, y1), a), b);
}

// Fills a pattern from a function of (u, v) in 0..1 with values in 0..1.
template <class F>
std::vector<std::uint8_t> fill(F value) {
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(kN) * kN);
  for (int j = 0; j < kN; ++j) {
    for (int i = 0; i < kN; ++i) {
      const double x = std::clamp(value((i + 0.5) / kN, (j + 0.5) / kN), 0.0, 1.0);
      texels[static_cast<std::size_t>(j) * kN + i] = static_cast<std::uint8_t>(std::lround(255 * x));
    }
  }
  return texels;
}

std::vector<std::uint8_t> makeChecker() {
  return fill([](double u, double v) { return (u < 0.5) == (v < 0.5) ? 1.0 : 0.35; });
}

// Four boards along u, each with its own grain and tone, with thin joints.
std::vector<std::uint8_t> makeWood() {
  return fill([](double u, double v) {
    const int board = static_cast<int>(v * 4);
    const double across = v * 4 - board;
    const auto seed = static_cast<std::uint32_t>(board + 11);
    const double bend = 0.10 * noise(u + 0.37 * board, across, 3, 2, seed);
    const double rings =
        0.5 + 0.5 * std::sin(2 * kPi * (5 * across + 9 * bend + noise(u, across, 2, 3, seed + 20)));
    const double fibres = noise(u + 0.2 * board, v, 8, 128, 5);
    const double tone = cellValue(static_cast<std::uint32_t>(board), 3, 77);
    const double joint = std::min(across, 1 - across) < 0.012 ? 0.72 : 1.0;
    return (0.78 + 0.10 * tone + 0.07 * rings + 0.09 * (fibres - 0.5)) * joint;
  });
}

// Threads over and under each other, a little uneven.
std::vector<std::uint8_t> makeFabric() {
  return fill([](double u, double v) {
    const int cells = 32;
    const double weft = std::sin(kPi * u * cells) * std::sin(kPi * v * cells);
    return 0.80 + 0.12 * weft + 0.16 * (noise(u, v, 48, 48, 3) - 0.5);
  });
}

// Broad strips over and under each other, as in a basket.
std::vector<std::uint8_t> makeWeave() {
  return fill([](double u, double v) {
    const int cells = 8;
    const double x = u * cells;
    const double y = v * cells;
    const bool along = (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0;
    const double a = x - std::floor(x);
    const double b = y - std::floor(y);
    const double across = along ? b : a;
    const double length = along ? a : b;
    const double round = std::sqrt(std::max(0.0, 1 - std::pow(2 * across - 1, 2)));
    const double dive = std::sin(kPi * length);
    return 0.42 + 0.30 * round + 0.22 * dive + 0.08 * (noise(u, v, 64, 64, 9) - 0.5);
  });
}

// Floor tiles of slightly different tone.
std::vector<std::uint8_t> makeTiles() {
  return fill([](double u, double v) {
    const int cells = 4;
    const int i = static_cast<int>(u * cells);
    const int j = static_cast<int>(v * cells);
    const double a = u * cells - i;
    const double b = v * cells - j;
    const double edge = std::min(std::min(a, 1 - a), std::min(b, 1 - b));
    const double tone = cellValue(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), 5);
    const double grain = noise(u, v, 32, 32, 6);
    return edge < 0.012 ? 0.66 : 0.86 + 0.05 * tone + 0.05 * (grain - 0.5);
  });
}

std::vector<std::uint8_t> makePlaster() {
  return fill([](double u, double v) {
    return 0.90 + 0.05 * (noise(u, v, 7, 7, 1) - 0.5) + 0.04 * (noise(u, v, 40, 40, 2) - 0.5);
  });
}

}  // namespace

const std::vector<TexturePattern>& texturePatterns() {
  static const std::vector<TexturePattern> patterns = {
      {"checker", 0.05F, 1.0F, makeChecker}, {"wood", 0.40F, 1.15F, makeWood},
      {"fabric", 0.06F, 1.15F, makeFabric},  {"weave", 0.12F, 1.2F, makeWeave},
      {"tiles", 1.20F, 1.1F, makeTiles},     {"plaster", 1.50F, 1.05F, makePlaster},
  };
  return patterns;
}

int textureLayer(std::string_view name) {
  if (name.empty()) return kNoTexture;
  const std::vector<TexturePattern>& patterns = texturePatterns();
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].name == name) return static_cast<int>(i);
  }
  return kUnknownTexture;
}

std::string textureNames() {
  std::string names;
  for (const TexturePattern& pattern : texturePatterns()) {
    if (!names.empty()) names += ", ";
    names += pattern.name;
  }
  return names;
}

}  // namespace nido::sim
