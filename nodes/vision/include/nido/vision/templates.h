#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"
#include "nido/vision/blob.h"
#include "nido/vision/body.h"

namespace nido::vision {

// A small grey picture of a thing cut out along its blob's box: brightness of its own pixels, 0 outside,
// scaled so that mean is 0 and length is 1. The product of two patches is their normalised correlation.
struct Patch {
  static constexpr int kSide = 16;
  std::array<float, kSide * kSide> values{};
};
[[nodiscard]] Patch cut_patch(const Image& image, const Blob& blob, const ColourTable& table);
// Normalised correlation, -1..1.
[[nodiscard]] double correlation(const Patch& a, const Patch& b);

// What vision knows of a thing by name.
struct ObjectTemplate {
  std::string name;    // "blue cube"
  std::string colour;  // name of one of the colours
  std::string shape;   // "cube"
  Body body;
  std::vector<Patch> patches;  // as it looked from several sides
};

// Everything that vision has learned about how things look (config/objects/templates.yaml).
struct TemplateSet {
  std::vector<ColourModel> colours;
  std::vector<ObjectTemplate> objects;
  std::string knuckle_colour;  // of the mark at the knuckles
  std::string wrist_colour;    // of the mark at the wrist

  // Index into colours; -1 if there is none.
  [[nodiscard]] int colour_index(const std::string& name) const;
  // Reads a file. kNotFound if it is not there; kInvalidArgument with file, line, what was found and what is
  // allowed.
  static Result<TemplateSet> load(const std::filesystem::path& path);
  // Takes in what the other one has: colours of new names, and all of its objects.
  void add(const TemplateSet& other);
  // The same colours, and of the objects those from number `first` on.
  [[nodiscard]] TemplateSet from(std::size_t first) const;
  // Writes such a file, whole or not at all. kFailed with the path.
  [[nodiscard]] Status save(const std::filesystem::path& path) const;
  // The text of such a file.
  [[nodiscard]] std::string to_yaml() const;
};

}  // namespace nido::vision
