#include "nido/vision/object_tracker.h"

#include <algorithm>
#include <cmath>

namespace nido::vision {
namespace {

constexpr double kScoreGain = 0.15;    // share of a new view in the running score of a shape
constexpr double kScoreMargin = 0.04;  // by which another shape must be better to take over
constexpr int kViewsJudgedFully = 5;   // first views of a thing are compared with every shape of its colour
constexpr int kJudgeEvery = 15;        // later ones only now and then
constexpr double kExplained = 0.93;    // overlap of a template that explains what is seen well
constexpr double kWithin = 0.5;        // of a blob that lies where a thing is expected: it belongs to it
constexpr double kWhole = 0.9;  // of what is expected is covered by those blobs: nothing of it is missing
constexpr double kStillThere = 0.97;  // of what is expected is covered by what is seen
constexpr double kGrown = 1.1;        // and what is seen is so much larger
constexpr double kClearlyBetter = 0.03;
constexpr int kDoubtEvery = 3;  // views that a thing explains poorly
constexpr int kDoubts = 4;  // looks one after the other in which another thing explains them: that one it is

std::array<double, 4> joined(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  const double left = std::min(a[0], b[0]);
  const double top = std::min(a[1], b[1]);
  const double right = std::max(a[0] + a[2], b[0] + b[2]);
  const double bottom = std::max(a[1] + a[3], b[1] + b[3]);
  return {left, top, right - left, bottom - top};
}

// How far the outline of a thing that is not moved may be missed by what is seen of it.
double inside_fraction(const Polygon& seen, const Polygon& expected) {
  const double whole = area(seen);
  return whole > 0 ? area(intersection(seen, grown(expected, 2.0))) / whole : 0;
}

// A measure of agreement from overlap (0.6 is poor, 0.95 as good as it gets) and correlation of looks.
double quality(double overlap_of_outlines, double correlation_of_looks) {
  return 0.7 * overlap_of_outlines + 0.3 * std::max(0.0, correlation_of_looks);
}

double confidence_of(double score) { return std::clamp((score - 0.45) / 0.4, 0.0, 1.0); }

}  // namespace

ObjectTracker::ObjectTracker(const TemplateSet& templates, TrackerSettings settings)
    : templates_(templates),
      settings_(settings),
      table_(templates.colours),
      objects_of_colour_(templates.colours.size()) {
  for (std::size_t i = 0; i < templates_.objects.size(); ++i) {
    objects_of_colour_[templates_.colour_index(templates_.objects[i].colour)].push_back(i);
  }
}

double ObjectTracker::look(std::size_t object, const StereoBlobs& input,
                           const std::array<int, 2>& blobs) const {
  const auto& patches = templates_.objects[object].patches;
  if (patches.empty()) return 1.0;
  double sum = 0;
  for (std::size_t e = 0; e < 2; ++e) {
    const Patch patch = cut_patch(*input.images[e], (*input.blobs[e])[blobs[e]], table_);
    double best = -1;
    for (const Patch& known : patches) best = std::max(best, correlation(patch, known));
    sum += best;
  }
  return sum / 2;
}

std::optional<ObjectTracker::Claim> ObjectTracker::claim(const Track& track, const StereoBlobs& input) {
  const ObjectTemplate& object = templates_.objects[track.object];
  const int colour = templates_.colour_index(object.colour);
  Claim result;
  std::array<std::vector<std::size_t>, 2> mine;
  for (std::size_t e = 0; e < 2; ++e) {
    const Polygon expected = object.body.outline(input.eyes[e], track.p_Root_m, track.pose().R_RootBody());
    if (expected.size() < 3) return std::nullopt;
    const double reach_px = 6.0 + 0.35 * std::sqrt(area(expected));
    const Polygon wide = grown(expected, reach_px);
    std::vector<Eigen::Vector2d> points;
    const auto& blobs = *input.blobs[e];
    std::vector<std::size_t> near;
    std::vector<std::size_t> within;  // most of them where the thing is expected
    for (std::size_t b = 0; b < blobs.size(); ++b) {
      if (blobs[b].colour != colour || taken_[e][b] || !contains(wide, blobs[b].centroid_px)) continue;
      near.push_back(b);
      if (inside_fraction(blobs[b].hull, expected) > kWithin) within.push_back(b);
    }
    // what lies beside a thing that is whole, and where it was, is another thing, of whatever colour
    std::vector<Eigen::Vector2d> corners;
    for (const std::size_t b : within)
      corners.insert(corners.end(), blobs[b].hull.begin(), blobs[b].hull.end());
    const bool whole = !within.empty() && inside_fraction(expected, convex_hull(std::move(corners))) > kWhole;
    for (const std::size_t b : whole ? within : near) {
      mine[e].push_back(b);
      if (points.empty()) {
        result.biggest[e] = static_cast<int>(b);
        result.box[e] = blobs[b].box();
      } else {
        result.box[e] = joined(result.box[e], blobs[b].box());
      }
      points.insert(points.end(), blobs[b].hull.begin(), blobs[b].hull.end());
      result.area_px += blobs[b].area_px;
    }
    if (points.empty()) return std::nullopt;
    result.outlines[e] = convex_hull(std::move(points));
  }
  for (std::size_t e = 0; e < 2; ++e) {
    for (const std::size_t b : mine[e]) taken_[e][b] = true;
  }
  return result;
}

// Compares what is seen with every template of its colour and lets the best explanation so far name it.
void ObjectTracker::judge_shape(Track& track, const Claim& seen, const StereoBlobs& input, bool search_yaw) {
  const int colour = templates_.colour_index(templates_.objects[track.object].colour);
  for (const std::size_t candidate : objects_of_colour_[colour]) {
    const bool own = candidate == track.object;
    const auto fit = fit_body(templates_.objects[candidate].body, input.eyes, seen.outlines,
                              own ? track.pose() : Fit{track.p_Root_m, 0, 0, Eigen::Matrix3d::Identity()},
                              search_yaw || !own);
    const double now = fit ? quality(fit->overlap, look(candidate, input, seen.biggest)) : 0;
    double& score = track.score[candidate];
    score += (track.views == 0 ? 1.0 : kScoreGain) * (now - score);
  }
  std::size_t best = track.object;
  for (const std::size_t candidate : objects_of_colour_[colour]) {
    if (track.score[candidate] > track.score[best] + (best == track.object ? kScoreMargin : 0))
      best = candidate;
  }
  if (best != track.object) {
    const auto fit =
        fit_body(templates_.objects[best].body, input.eyes, seen.outlines, {track.p_Root_m, 0, 0}, true);
    if (fit) {
      track.object = best;
      track.p_Root_m = fit->p_Root_m;
      track.yaw_rad = fit->yaw_rad;
      track.tilt = fit->tilt;
    }
  }
}

// What seems to be half hidden, or no longer looks as it did, may be another thing that was put there: then
// one of the others of its colour explains all that is seen, view after view.
bool ObjectTracker::is_replaced(Track& track, const Claim& seen, const StereoBlobs& input) {
  if (++track.poor % kDoubtEvery != 0) return false;
  const auto own =
      fit_body(templates_.objects[track.object].body, input.eyes, seen.outlines, track.pose(), true);
  const double least = std::max(kExplained, own ? own->overlap + kClearlyBetter : 0.0);
  std::optional<Fit> better;
  std::size_t other = track.object;
  for (const std::size_t candidate :
       objects_of_colour_[templates_.colour_index(templates_.objects[track.object].colour)]) {
    if (candidate == track.object) continue;
    const auto fit = fit_body(templates_.objects[candidate].body, input.eyes, seen.outlines,
                              Fit{track.p_Root_m, 0, 0, Eigen::Matrix3d::Identity()}, true);
    if (!fit || fit->overlap < least || (better && fit->overlap <= better->overlap)) continue;
    better = fit;
    other = candidate;
  }
  track.doubts = better ? track.doubts + 1 : 0;
  if (track.doubts < kDoubts) return false;
  track.score.assign(templates_.objects.size(), 0.0);
  track.score[other] = quality(better->overlap, look(other, input, seen.biggest));
  track.object = other;
  track.p_Root_m = better->p_Root_m;
  track.yaw_rad = better->yaw_rad;
  track.tilt = better->tilt;
  track.views = settings_.frames_to_confirm;
  track.confidence = confidence_of(track.score[other]);
  track.poor = track.doubts = 0;
  track.occluded = false;
  return true;
}

void ObjectTracker::update(Track& track, const Claim& seen, const StereoBlobs& input) {
  const bool confirmed = track.views >= settings_.frames_to_confirm;
  const Body* body = &templates_.objects[track.object].body;
  double visible = 1;
  double inside = 1;
  double larger = 1;
  double covered = 1;  // of what is expected, by what is seen
  for (std::size_t e = 0; e < 2; ++e) {
    const Polygon expected = body->outline(input.eyes[e], track.p_Root_m, track.pose().R_RootBody());
    if (expected.size() < 3) continue;
    visible = std::min(visible, area(seen.outlines[e]) / area(expected));
    inside = std::min(inside, inside_fraction(seen.outlines[e], expected));
    larger = std::max(larger, area(seen.outlines[e]) / area(expected));
    covered = std::min(covered, inside_fraction(expected, seen.outlines[e]));
  }
  const auto fit = fit_body(*body, input.eyes, seen.outlines, track.pose(), !confirmed);
  // a first glimpse that later views do not bear out (a thing that fell just then) is forgotten and taken up
  // anew
  if (!confirmed && (!fit || fit->overlap < settings_.least_overlap)) return;
  track.box = seen.box;
  track.seen = input.stamp;
  track.seen_now = true;
  const bool explained = fit && fit->overlap > kExplained;
  if (explained) track.poor = track.doubts = 0;
  // something of its colour before or beside it has grown together with it: all of it is still where it was
  if (confirmed && !explained && larger > kGrown && covered > kStillThere) return;
  if (confirmed && !explained && is_replaced(track, seen, input)) return;
  // a thing that is explained as a whole where it is now is not hidden, whatever was expected
  const bool whole = visible >= settings_.whole_fraction || (fit && fit->overlap > settings_.whole_overlap);
  track.occluded = confirmed && !whole;
  if (track.occluded && inside > 0.93) {
    // what is left of it lies where it should if it had not moved: believe that
    track.confidence +=
        0.3 * (confidence_of(track.score[track.object]) * std::max(0.4, visible) - track.confidence);
    return;
  }
  if (!fit) {
    track.confidence *= 0.8;
    return;
  }
  if (!track.occluded) {
    const bool judge = track.views < kViewsJudgedFully || track.views % kJudgeEvery == 0;
    if (judge) judge_shape(track, seen, input, track.views < kViewsJudgedFully);
    ++track.views;
  }
  const double distance_m = (fit->p_Root_m - track.p_Root_m).norm();
  const double gain = distance_m > settings_.moving_m ? settings_.moving_gain : settings_.still_gain;
  track.p_Root_m += gain * (fit->p_Root_m - track.p_Root_m);
  const double period = templates_.objects[track.object].body.symmetry_rad;
  if (period > 0 && !track.occluded) {
    const double turn = std::remainder(fit->yaw_rad - track.yaw_rad, period);
    // what leans moves as a whole: its turn is taken as seen
    const bool leans = !fit->tilt.isIdentity(1e-6) || !track.tilt.isIdentity(1e-6);
    track.yaw_rad = leans ? fit->yaw_rad : std::remainder(track.yaw_rad + gain * turn, period);
    track.tilt = fit->tilt;
  }
  const double now = track.occluded ? confidence_of(fit->overlap) * std::max(0.3, visible)
                                    : confidence_of(track.score[track.object]);
  track.confidence += 0.4 * (now - track.confidence);
}

// Takes up what was seen as a new thing if a template of its colour explains it.
bool ObjectTracker::take_up(const Claim& seen, const Eigen::Vector3d& p_Root_m, int colour, bool in_pieces,
                            double least_overlap, const StereoBlobs& input) {
  Track track;
  track.score.assign(templates_.objects.size(), 0.0);
  double best_overlap = 0;
  double best_look = 0;
  double best_quality = 0;
  for (const std::size_t candidate : objects_of_colour_[colour]) {
    const auto fit =
        fit_body(templates_.objects[candidate].body, input.eyes, seen.outlines, {p_Root_m, 0, 0}, true);
    if (!fit) continue;
    // pieces have no look of the whole
    const double correlation_of_looks = in_pieces ? 0.5 : look(candidate, input, seen.biggest);
    const double now = quality(fit->overlap, correlation_of_looks);
    track.score[candidate] = now;
    if (now > best_quality) {
      best_quality = now;
      best_overlap = fit->overlap;
      best_look = correlation_of_looks;
      track.object = candidate;
      track.p_Root_m = fit->p_Root_m;
      track.yaw_rad = fit->yaw_rad;
      track.tilt = fit->tilt;
    }
  }
  if (best_overlap < least_overlap || best_look < settings_.least_correlation) return false;
  track.confidence = confidence_of(best_quality);
  track.views = 1;
  track.seen = input.stamp;
  track.seen_now = true;
  track.box = seen.box;
  tracks_.push_back(track);
  return true;
}

bool ObjectTracker::in_reach_of_eyes(const Eigen::Vector3d& p_Root_m, const StereoBlobs& input) const {
  const double distance_m = (p_Root_m - input.eyes[0].X_RootCamera.translation()).norm();
  return distance_m > settings_.min_distance_m && distance_m < settings_.max_distance_m;
}

// A colour that only one thing has: all its blobs together may be that thing with an arm across it.
void ObjectTracker::find_in_pieces(int colour, double least_overlap, const StereoBlobs& input) {
  Claim seen;
  std::array<std::vector<std::size_t>, 2> mine;
  for (std::size_t e = 0; e < 2; ++e) {
    std::vector<Eigen::Vector2d> points;
    const auto& blobs = *input.blobs[e];
    for (std::size_t b = 0; b < blobs.size(); ++b) {
      if (blobs[b].colour != colour) continue;
      if (taken_[e][b]) return;
      seen.box[e] = mine[e].empty() ? blobs[b].box() : joined(seen.box[e], blobs[b].box());
      mine[e].push_back(b);
      points.insert(points.end(), blobs[b].hull.begin(), blobs[b].hull.end());
    }
    if (mine[e].empty()) return;
    seen.outlines[e] = convex_hull(std::move(points));
  }
  if (mine[0].size() + mine[1].size() < 3) return;
  const auto p =
      meet(input.eyes, centroid(seen.outlines[0]), centroid(seen.outlines[1]), 3 * settings_.max_gap_m);
  if (!p || !in_reach_of_eyes(*p, input) || !take_up(seen, *p, colour, true, least_overlap, input)) return;
  for (std::size_t e = 0; e < 2; ++e) {
    for (const std::size_t b : mine[e]) taken_[e][b] = true;
  }
}

void ObjectTracker::find_new(const StereoBlobs& input) {
  constexpr double kWellExplained = 0.85;
  const auto pieces = [&](double least_overlap) {
    for (std::size_t c = 0; c < objects_of_colour_.size(); ++c) {
      if (objects_of_colour_[c].size() == 1) find_in_pieces(static_cast<int>(c), least_overlap, input);
    }
  };
  pieces(kWellExplained);

  struct Pair {
    std::size_t left, right;
    double cost;
    Eigen::Vector3d p_Root_m;
  };
  std::vector<Pair> pairs;
  const auto& lefts = *input.blobs[0];
  const auto& rights = *input.blobs[1];
  for (std::size_t l = 0; l < lefts.size(); ++l) {
    if (taken_[0][l] || objects_of_colour_[lefts[l].colour].empty()) continue;
    for (std::size_t r = 0; r < rights.size(); ++r) {
      if (taken_[1][r] || rights[r].colour != lefts[l].colour) continue;
      const double ratio = static_cast<double>(lefts[l].area_px) / rights[r].area_px;
      if (ratio < 0.6 || ratio > 1.67) continue;
      const auto p = meet(input.eyes, lefts[l].centroid_px, rights[r].centroid_px, settings_.max_gap_m);
      if (p && in_reach_of_eyes(*p, input)) pairs.push_back({l, r, std::abs(std::log(ratio)), *p});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.cost < b.cost; });
  for (const Pair& pair : pairs) {
    if (taken_[0][pair.left] || taken_[1][pair.right]) continue;
    const Blob& left = lefts[pair.left];
    const Blob& right = rights[pair.right];
    Claim seen;
    seen.outlines = {left.hull, right.hull};
    seen.box = {left.box(), right.box()};
    seen.biggest = {static_cast<int>(pair.left), static_cast<int>(pair.right)};
    if (!take_up(seen, pair.p_Root_m, left.colour, false, settings_.least_overlap, input)) continue;
    taken_[0][pair.left] = true;
    taken_[1][pair.right] = true;
  }
  pieces(settings_.least_overlap);
}

const std::vector<SeenObject>& ObjectTracker::step(const StereoBlobs& input) {
  for (std::size_t e = 0; e < 2; ++e) taken_[e].assign(input.blobs[e]->size(), false);
  std::erase_if(tracks_, [&](const Track& track) {
    const double age_s = Time{input.stamp.ns - track.seen.ns}.seconds();
    return age_s > (track.views < settings_.frames_to_confirm ? 0.2 : settings_.memory_s);
  });
  // those known longest choose first
  std::stable_sort(tracks_.begin(), tracks_.end(),
                   [](const Track& a, const Track& b) { return a.views > b.views; });
  for (Track& track : tracks_) {
    track.seen_now = false;
    if (const auto seen = claim(track, input)) {
      update(track, *seen, input);
    } else {
      track.confidence *= 0.9;
    }
  }
  if (!input.eyes_fast) find_new(input);

  seen_.clear();
  for (const Track& track : tracks_) {
    if (!track.seen_now || track.views < settings_.frames_to_confirm) continue;
    const ObjectTemplate& object = templates_.objects[track.object];
    SeenObject out;
    out.name = object.name;
    out.colour = object.colour;
    out.shape = object.shape;
    out.confidence = track.confidence;
    out.p_RootObject_m = track.p_Root_m;
    const Eigen::Vector3d edges = object.body.extents_m();
    const double c = std::abs(std::cos(track.yaw_rad));
    const double s = std::abs(std::sin(track.yaw_rad));
    out.size_m = object.body.symmetry_rad > 0 ? Eigen::Vector3d(c * edges.x() + s * edges.y(),
                                                                s * edges.x() + c * edges.y(), edges.z())
                                              : edges;
    out.yaw_rad = object.body.symmetry_rad > 0 ? track.yaw_rad : 0;
    out.box = track.box;
    out.occluded = track.occluded;
    seen_.push_back(out);
  }
  std::stable_sort(seen_.begin(), seen_.end(),
                   [](const SeenObject& a, const SeenObject& b) { return a.confidence > b.confidence; });
  return seen_;
}

std::optional<ObjectTracker::Memory> ObjectTracker::remember(const std::string& name, Time now) const {
  std::optional<Memory> best;
  for (const Track& track : tracks_) {
    if (templates_.objects[track.object].name != name || track.views < settings_.frames_to_confirm) continue;
    if (best && best->confidence >= track.confidence) continue;
    best = Memory{track.p_Root_m, Time{now.ns - track.seen.ns}.seconds(), track.confidence};
  }
  return best;
}

}  // namespace nido::vision
