#include "nido/vision/learner.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace nido::vision {
namespace {

constexpr int kWindow_px = 45;            // half the side of the picture's middle
constexpr double kColourful = 0.28;       // saturation that parts a thing from wood, stone and shade
constexpr double kSameColour = 0.7;       // share of its pixels that a known colour explains
constexpr double kDark = 0.12;            // value below which a hue says nothing
constexpr int kHueBins = 36;              //
constexpr double kPeak_deg = 15;          // pixels this near to the commonest hue are the thing's
constexpr std::size_t kFewest_px = 150;   // of them
constexpr int kSmallestBlob_px = 60;      //
constexpr double kFromMiddle_px = 60;     // of the left picture
constexpr double kGap_m = 0.010;          // between the lines of sight of both eyes
constexpr double kPlainEnough = 0.75;     // overlap of a body with what was seen
constexpr double kSimpler = 0.004;        // overlap by which a body with more numbers must be better
constexpr std::size_t kMostPatches = 16;  // kept of a thing

double quantile(std::vector<double> values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

// Hue, saturation and value of the colourful pixels in the middle of a picture.
std::vector<Hsv> colourful_middle(const Image& image) {
  std::vector<Hsv> pixels;
  for (int y = std::max(0, image.height / 2 - kWindow_px);
       y < std::min(image.height, image.height / 2 + kWindow_px); ++y) {
    for (int x = std::max(0, image.width / 2 - kWindow_px);
         x < std::min(image.width, image.width / 2 + kWindow_px); ++x) {
      const std::uint8_t* p = image.rgb.data() + (static_cast<std::size_t>(y) * image.width + x) * 3;
      const Hsv hsv = to_hsv(p[0] / 255.0, p[1] / 255.0, p[2] / 255.0);
      if (hsv.saturation > kColourful && hsv.value > kDark) pixels.push_back(hsv);
    }
  }
  return pixels;
}

double commonest_hue_deg(const std::vector<Hsv>& pixels) {
  std::array<int, kHueBins> bins{};
  for (const Hsv& p : pixels) ++bins[static_cast<std::size_t>(p.hue_deg / 360 * kHueBins) % kHueBins];
  const auto count = [&](std::size_t i) {
    return bins[(i + kHueBins - 1) % kHueBins] + 2 * bins[i] + bins[(i + 1) % kHueBins];
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < kHueBins; ++i) {
    if (count(i) > count(best)) best = i;
  }
  return (static_cast<double>(best) + 0.5) * 360 / kHueBins;
}

// As make_vision_templates does, from fewer pixels.
ColourModel colour_of(const std::string& name, const std::vector<Hsv>& pixels) {
  double c = 0;
  double s = 0;
  for (const Hsv& p : pixels) {
    c += p.saturation * std::cos(p.hue_deg * M_PI / 180);
    s += p.saturation * std::sin(p.hue_deg * M_PI / 180);
  }
  ColourModel colour;
  colour.name = name;
  colour.hue_deg = std::fmod(std::atan2(s, c) * 180 / M_PI + 360, 360);
  std::vector<double> off;
  std::vector<double> saturation;
  std::vector<double> value;
  for (const Hsv& p : pixels) {
    off.push_back(hue_distance_deg(p.hue_deg, colour.hue_deg));
    saturation.push_back(p.saturation);
    value.push_back(p.value);
  }
  colour.hue_tolerance_deg = std::clamp(quantile(off, 0.95) + 4.0, 8.0, 20.0);
  // half way between the thing and a colourless ground: a pixel half covered by its edge is at the limit
  colour.saturation_min = std::min(quantile(saturation, 0.05) - 0.05, 0.5 * quantile(saturation, 0.5) + 0.06);
  colour.saturation_max = std::min(1.0, quantile(saturation, 0.99) + 0.10);
  colour.value_min = 0.5 * quantile(value, 0.02);
  return colour;
}

// A kind of body with its measures as numbers.
struct Kind {
  const char* shape;
  int measures;
  double symmetry_rad;
  Solid::Kind solid;
};
constexpr std::array<Kind, 3> kKinds = {{{"ball", 1, 0.0, Solid::Kind::kSphere},
                                         {"cylinder", 2, 0.0, Solid::Kind::kCylinder},
                                         {"box", 3, M_PI, Solid::Kind::kBox}}};

Body body_of(const Kind& kind, const Eigen::Vector3d& measures_m) {
  Solid solid;
  solid.kind = kind.solid;
  solid.size_m = measures_m;
  if (kind.solid == Solid::Kind::kCylinder) solid.size_m = {measures_m[0], measures_m[1], 0};
  if (kind.solid == Solid::Kind::kSphere) solid.size_m = {measures_m[0], 0, 0};
  return Body{{solid}, kind.symmetry_rad};
}

// Changes one measure after the other in smaller and smaller steps to the best overlap, which is returned.
double refine(const Kind& kind, Eigen::Vector3d& measures_m,
              const std::function<double(const Body&)>& explains) {
  double overlap = explains(body_of(kind, measures_m));
  for (double step = 0.25; step > 0.012; step *= 0.6) {
    for (int i = 0; i < kind.measures; ++i) {
      for (const double factor : {1 + step, 1 / (1 + step)}) {
        Eigen::Vector3d other_m = measures_m;
        other_m[i] *= factor;
        const double now = explains(body_of(kind, other_m));
        if (now <= overlap) continue;
        overlap = now;
        measures_m = other_m;
      }
    }
  }
  return overlap;
}

}  // namespace

Learner::Learner(std::string name, const TemplateSet& known) : name_(std::move(name)), known_(known) {}

Status Learner::choose_colour(const Image& left) {
  std::vector<Hsv> pixels = colourful_middle(left);
  if (pixels.size() >= kFewest_px) {
    const double hue_deg = commonest_hue_deg(pixels);
    std::erase_if(pixels, [&](const Hsv& p) { return hue_distance_deg(p.hue_deg, hue_deg) > kPeak_deg; });
  }
  if (pixels.size() < kFewest_px) {
    return Error{ErrorCode::kFailed,
                 "I see nothing in the middle of my view that has a colour of its own; hold it there, or put "
                 "it on the table before me"};
  }
  ColourModel colour = colour_of(name_, pixels);
  // one of the known colours, if that is what most of it looks like
  for (std::size_t i = 0; i < known_.colours.size(); ++i) {
    const ColourModel& other = known_.colours[i];
    const auto like = std::count_if(pixels.begin(), pixels.end(), [&](const Hsv& p) {
      return hue_distance_deg(p.hue_deg, other.hue_deg) < other.hue_tolerance_deg &&
             p.saturation > other.saturation_min && p.saturation < other.saturation_max &&
             p.value > other.value_min;
    });
    if (static_cast<double>(like) < kSameColour * static_cast<double>(pixels.size())) continue;
    if (other.name == known_.knuckle_colour || other.name == known_.wrist_colour) {
      return Error{ErrorCode::kFailed,
                   fmt::format("the {} has the colour of the marks on my hands ({}): I could not tell it "
                               "from them",
                               name_, other.name)};
    }
    colour_ = static_cast<int>(i);
    return {};
  }
  // a paler or a stronger colour of a known hue leaves that one its share
  std::vector<double> saturations;
  for (const Hsv& p : pixels) saturations.push_back(p.saturation);
  const double saturation = quantile(saturations, 0.5);
  for (const ColourModel& other : known_.colours) {
    if (hue_distance_deg(colour.hue_deg, other.hue_deg) > colour.hue_tolerance_deg + other.hue_tolerance_deg)
      continue;
    if (saturation > other.saturation_max) {
      colour.saturation_min = std::max(colour.saturation_min, other.saturation_max);
    } else if (saturation < other.saturation_min) {
      colour.saturation_max = std::min(colour.saturation_max, other.saturation_min);
    }
  }
  known_.colours.push_back(colour);
  // two things may be taught in one word, so a colour's name is not the thing's
  known_.colours.back().name = fmt::format("hue {:.0f}", colour.hue_deg);
  if (known_.colour_index(known_.colours.back().name) + 1 != static_cast<int>(known_.colours.size()))
    known_.colours.back().name += fmt::format(" of {}", name_);
  colour_ = static_cast<int>(known_.colours.size()) - 1;
  new_colour_ = true;
  return {};
}

Status Learner::view(const StereoBlobs& pictures) {
  if (colour_ < 0) {
    if (const Status chosen = choose_colour(*pictures.images[0]); !chosen) return chosen;
  }
  const ColourTable table(known_.colours);
  std::array<std::vector<Blob>, 2> blobs;
  for (std::size_t e = 0; e < 2; ++e) {
    BlobFinder finder(table, kSmallestBlob_px);
    for (const Blob& blob : finder.find(*pictures.images[e])) {
      if (blob.colour == colour_ && !blob.touches_border) blobs[e].push_back(blob);
    }
  }
  const Image& left = *pictures.images[0];
  const Eigen::Vector2d middle(left.width / 2.0, left.height / 2.0);
  const Blob* mine = nullptr;
  for (const Blob& blob : blobs[0]) {
    const double off_px = (blob.centroid_px - middle).norm();
    if (off_px > kFromMiddle_px) continue;
    if (mine == nullptr || blob.area_px > mine->area_px) mine = &blob;
  }
  const Blob* other = nullptr;
  std::optional<Eigen::Vector3d> p_Root_m;
  for (const Blob& blob : blobs[1]) {
    if (mine == nullptr) break;
    const auto met = meet(pictures.eyes, mine->centroid_px, blob.centroid_px, kGap_m);
    const double likeness = static_cast<double>(blob.area_px) / mine->area_px;
    if (!met || likeness < 0.6 || likeness > 1.6) continue;
    if (other == nullptr ||
        std::abs(blob.area_px - mine->area_px) < std::abs(other->area_px - mine->area_px)) {
      other = &blob;
      p_Root_m = met;
    }
  }
  if (other == nullptr) {
    return Error{ErrorCode::kFailed,
                 fmt::format("I do not see the {} whole in the middle of both my eyes", name_)};
  }
  outlines_.push_back({pictures.eyes, {mine->hull, other->hull}, *p_Root_m});
  patches_.push_back(cut_patch(*pictures.images[0], *mine, table));
  patches_.push_back(cut_patch(*pictures.images[1], *other, table));
  return {};
}

Result<Learner::Learned> Learner::learned() const {
  if (outlines_.empty()) return Error{ErrorCode::kFailed, fmt::format("I have not seen the {} yet", name_)};
  const auto explains = [&](const Body& body) {
    double sum = 0;
    int count = 0;
    // every other view is enough to tell bodies apart
    for (std::size_t i = 0; i < outlines_.size(); i += 2, ++count) {
      const Outlines& view = outlines_[i];
      const auto fit =
          fit_body(body, view.eyes, view.seen, {view.p_Root_m, 0, 0, Eigen::Matrix3d::Identity()}, true);
      // a leaning body is no explanation of how a thing stands
      if (fit && fit->tilt.isIdentity(1e-6)) sum += fit->overlap;
    }
    return sum / count;
  };
  // from its width in the left picture
  const Outlines& first = outlines_.front();
  double low_px = 1e9;
  double high_px = -1e9;
  for (const Eigen::Vector2d& corner : first.seen[0]) {
    low_px = std::min(low_px, corner.x());
    high_px = std::max(high_px, corner.x());
  }
  const double depth_m = (first.eyes[0].X_RootCamera.inverse() * first.p_Root_m).z();
  const double width_m = std::clamp((high_px - low_px) * depth_m / first.eyes[0].camera.fx_px, 0.005, 0.4);

  Learned best;
  for (const Kind& kind : kKinds) {
    // a turned box is wider than its edge: from more than one beginning
    Eigen::Vector3d measures_m = Eigen::Vector3d::Zero();
    double overlap = 0;
    for (const double edge : {0.62, 0.72, 0.85}) {
      Eigen::Vector3d from_m(width_m / 2, edge * width_m, 0);
      if (kind.solid == Solid::Kind::kBox) from_m.setConstant(edge * width_m);
      if (const double now = refine(kind, from_m, explains); now > overlap) {
        overlap = now;
        measures_m = from_m;
      }
      if (kind.measures == 1) break;
    }
    if (overlap <= best.overlap + (best.overlap > 0 ? kSimpler : 0)) continue;
    best.overlap = overlap;
    best.object.shape = kind.shape;
    best.object.body = body_of(kind, measures_m);
  }
  if (best.overlap < kPlainEnough) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("no ball, cylinder or box looks like the {} (the best overlaps by {:.0f} of 100)", name_,
                    100 * best.overlap)};
  }
  best.object.name = name_;
  best.object.colour = known_.colours[static_cast<std::size_t>(colour_)].name;
  best.object.patches.assign(patches_.begin(), patches_.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                      patches_.size(), kMostPatches)));
  if (new_colour_) best.colour = known_.colours.back();
  return best;
}

}  // namespace nido::vision
