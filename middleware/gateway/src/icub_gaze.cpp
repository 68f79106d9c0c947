// The gaze, as gazecontrollerclient asks it.
#include <fmt/format.h>

#include <array>

#include "contexts.h"
#include "icub_words.h"
#include "nido/gateway/icub_tasks.h"
#include "nido/kinematics/gaze_geometry.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

constexpr double kSmallestVergence_deg = 1;
constexpr double kFarthest_m = 100;

// What the iCub's controller can be told and this one always or never does.
struct Fixed {
  const char* word;
  double value;
  const char* why;
};
constexpr Fixed kOcr = {"ocr", 0.0, "one gain is for all of the head's turning, by its encoders: set vor"};
// What is only kept: no tolerance is needed.
constexpr const char* kTolerance = "ntol";
constexpr std::array<const char*, 3> kNeck = {"pitch", "roll", "yaw"};

template <class Angles>
std::vector<double> degrees(const Angles& angles_rad) {
  std::vector<double> angles_deg;
  for (const double angle_rad : angles_rad) angles_deg.push_back(angle_rad / kDegree_rad);
  return angles_deg;
}

std::optional<int> eye_at(const Bottle& words, std::size_t at) {
  if (is(words, at, "left")) return 0;
  return is(words, at, "right") ? std::optional(1) : std::nullopt;
}

Bottle point_reply(const Result<Eigen::Vector3d>& p_Root_m) {
  return p_Root_m ? ack({list_of(*p_Root_m)}) : nack(p_Root_m.error().message);
}

Error expected(const char* what) { return {ErrorCode::kInvalidArgument, std::string(what) + " is expected"}; }

// What the pictures show, in the names of the iCub's controller.
Bottle lens_properties(const GazeBody& body) {
  const PinholeCamera eye = eye_camera(body);
  const std::vector<double> intrinsics = {eye.fx_px, 0, eye.cx_px, 0, 0, eye.fy_px, eye.cy_px, 0, 0, 0, 1, 0};
  const std::vector<double> extrinsics = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  Bottle properties;
  for (const char* side : {"left", "right"}) {
    const auto add = [&](const char* name, Value value) {
      properties.push_back(property((std::string(name) + "_" + side).c_str(), std::move(value)));
    };
    add("camera_intrinsics", list_of(intrinsics));
    add("camera_width", Value::of(body.width_px));
    add("camera_height", Value::of(body.height_px));
    add("camera_extrinsics", list_of(extrinsics));
  }
  return properties;
}

}  // namespace

Bottle GazeWords::fixation_vector(const GazeState& state) {
  return yarp::vector_bottle({state.p_RootFixation_m.begin(), state.p_RootFixation_m.end()});
}
Bottle GazeWords::angles_vector(const GazeState& state) {
  return yarp::vector_bottle(degrees(state.angles_rad));
}
Bottle GazeWords::joints_vector(const GazeState& state) {
  // nido's order of the torso is that of its board: yaw, roll, pitch
  std::vector<double> joints_deg = degrees(state.torso_rad.reverse());
  for (const double joint_deg : degrees(state.head_rad)) joints_deg.push_back(joint_deg);
  return yarp::vector_bottle(joints_deg);
}

Result<GazeBody> GazeWords::body() {
  if (!body_) {
    const Result<GazeBody> told = gaze_.body();
    if (!told) return told.error();
    body_ = *told;
  }
  return *body_;
}

// The point that is meant: 3D X Y Z, mono left|right U V Z or ...ver VERGENCE, ster UL VL UR VR,
// ang abs|rel AZIMUTH ELEVATION VERGENCE, proj left|right U V A B C D of a plane ax + by + cz + d = 0.
Result<Eigen::Vector3d> GazeWords::place_of(const std::string& kind, const Bottle& place) {
  const bool has_side = kind == "mono" || kind == "proj";
  const bool by_vergence = kind == "mono" && is(place, 3, "ver");
  Bottle words = place;
  if (by_vergence) words.erase(words.begin() + 3);
  const auto n = numbers_from(words, has_side || kind == "ang" ? 1 : 0);
  const std::size_t count = n ? n->size() : 0;
  if (kind == "3D") {
    if (count != 3) return expected("X Y Z, in m,");
    return Eigen::Vector3d((*n)[0], (*n)[1], (*n)[2]);
  }
  const Result<GazeBody> body = this->body();
  if (!body) return body.error();
  const Result<GazeState> state = gaze_.state();
  if (!state) return state.error();
  if (kind == "ang") {
    if (count != 3 || !(is(place, 0, "abs") || is(place, 0, "rel"))) {
      return expected("abs|rel AZIMUTH ELEVATION VERGENCE, in degrees,");
    }
    return p_at_angles(*body, *state, is(place, 0, "rel"),
                       kDegree_rad * Eigen::Vector3d((*n)[0], (*n)[1], (*n)[2]));
  }
  if (kind == "ster") {
    if (count != 4) return expected("UL VL UR VR, in pixels,");
    const auto met = triangulate(sight_of(*body, *state, 0, {(*n)[0], (*n)[1]}),
                                 sight_of(*body, *state, 1, {(*n)[2], (*n)[3]}));
    if (met) return met->p_m;
    return Error{ErrorCode::kFailed, "the lines of sight of these pixels do not meet before the eyes"};
  }
  const std::optional<int> eye = eye_at(place, 0);
  if (!eye || count != (kind == "mono" ? 3U : 6U)) {
    return expected(kind == "mono" ? "left|right U V Z, or left|right U V ver VERGENCE,"
                                   : "left|right U V A B C D");
  }
  const Ray sight = sight_of(*body, *state, *eye, {(*n)[0], (*n)[1]});
  if (kind == "mono") {
    // how deep it lies along the optical axis
    const double depth_m = by_vergence ? distance_of_vergence_m(*body, (*n)[2] * kDegree_rad) : (*n)[2];
    if (!(depth_m > 0 && depth_m <= kFarthest_m)) return expected("a depth of 0 to 100 m");
    const Eigen::Isometry3d& X_RootEye = state->X_RootEyes[static_cast<std::size_t>(*eye)];
    return Eigen::Vector3d(sight.origin_m +
                           depth_m / sight.direction.dot(X_RootEye.linear().col(2)) * sight.direction);
  }
  const Eigen::Vector3d normal((*n)[2], (*n)[3], (*n)[4]);
  if (normal.isZero()) return expected("a plane a x + b y + c z + d = 0");
  const auto met = meet_plane(sight, -(*n)[5] / normal.squaredNorm() * normal, normal);
  if (met) return *met;
  return Error{ErrorCode::kFailed, "the line of sight of this pixel does not meet the plane"};
}

Status GazeWords::look(const std::string& kind, const Bottle& place) {
  const Result<Eigen::Vector3d> p_Root_m = place_of(kind, place);
  if (!p_Root_m) return p_Root_m.error();
  Status begun = gaze_.look_at(*p_Root_m);
  if (begun) has_target_ = true;
  return begun;
}

Status GazeWords::follow(const GazeState& state) {
  if (!has_target_ || kept_.tracking || state.moving) return {};
  has_target_ = false;
  // whose gaze is stabilized keeps the point in sight
  return kept_.stabilizing ? Status() : gaze_.stop();
}

Result<GazeWords::Context> GazeWords::context() const {
  const Result<GazeSettings> settings = gaze_.settings();
  if (!settings) return settings.error();
  return Context{kept_, *settings};
}

Status GazeWords::restore(const Context& context) {
  if (Status set = gaze_.set_settings(context.settings); !set) return set;
  if (Status held = hold(context.kept.stabilizing); !held) return held;
  kept_ = context.kept;
  return {};
}

Status GazeWords::hold(bool stabilizing) {
  if (stabilizing != kept_.stabilizing && !has_target_) {
    Status done;
    if (stabilizing) {
      const Result<GazeState> state = gaze_.state();
      if (!state) return state.error();
      done = gaze_.look_at(state->p_RootFixation_m);
    } else {
      done = gaze_.stop();
    }
    if (!done) return done;
  }
  kept_.stabilizing = stabilizing;
  return {};
}

Bottle GazeWords::reply(const Bottle& command) {
  const auto now = [this] { return context(); };
  if (const Status begun = contexts_.begin(now); !begun) return nack(begun.error().message);
  if (is(command, 0, "get")) return get(command);
  if (is(command, 0, "set")) return set(command);
  if (is(command, 0, "look")) {
    for (const char* kind : {"3D", "mono", "ster", "ang"}) {
      if (is(command, 1, kind) && command.size() > 2 && command[2].is_list()) {
        return outcome(look(kind, command[2].items));
      }
    }
    return nack("look 3D|mono|ster|ang (...) is expected");
  }
  if (is(command, 0, "stop")) {
    has_target_ = kept_.stabilizing = false;
    return outcome(gaze_.stop());
  }
  if (auto told =
          contexts_.reply(command, now, [this](const Context& context) { return restore(context); })) {
    return *std::move(told);
  }
  if (is(command, 0, "bind") || is(command, 0, "clear")) return bind(command);
  if (is(command, 0, "regi") || is(command, 0, "unre") || is(command, 0, "list")) {
    return events_.reply(command, 0).value_or(nack("register|unregister ongoing [0..1] is expected"));
  }
  return nack(
      "get, set, look, stop, stor, rest, del, bind, clear, register, unregister and list are understood");
}

Bottle GazeWords::bind(const Bottle& command) {
  const Result<GazeBody> body = this->body();
  if (!body) return nack(body.error().message);
  Result<GazeSettings> settings = gaze_.settings();
  if (!settings) return nack(settings.error().message);
  const bool clears = is(command, 0, "clear");
  const auto first = number_at(command, 2);
  const auto second = number_at(command, 3);
  if (is(command, 1, "eyes") && (clears || first)) {
    settings->vergence_rad.reset();
    if (!clears) {
      settings->vergence_rad =
          std::clamp(*first, kSmallestVergence_deg, body->vergence_upper_rad / kDegree_rad) * kDegree_rad;
    }
    return outcome(gaze_.set_settings(*settings));
  }
  for (Eigen::Index joint = 0; joint < 3; ++joint) {
    if (!is(command, 1, kNeck[static_cast<std::size_t>(joint)]) || !(clears || (first && second))) continue;
    const double lower_rad = body->neck_lower_rad[joint];
    const double upper_rad = body->neck_upper_rad[joint];
    // beyond what the joint can do is as far as it can
    settings->neck_lower_rad[joint] =
        clears ? lower_rad : std::clamp(*first * kDegree_rad, lower_rad, upper_rad);
    settings->neck_upper_rad[joint] =
        clears ? upper_rad : std::clamp(*second * kDegree_rad, lower_rad, upper_rad);
    return outcome(gaze_.set_settings(*settings));
  }
  return nack("bind pitch|roll|yaw MIN MAX, bind eyes VERGENCE, in degrees, and clear ... are understood");
}

Bottle GazeWords::set(const Bottle& command) {
  const auto number = number_at(command, 2);
  const bool is_empty = command.size() > 2 && command[2].is_list() && command[2].items.empty();
  if (is(command, 1, "tweak")) return is_empty ? ack() : nack("the lens is the robot's, and stays");
  // of what follows a point in both pictures; it is known here where that point is
  if (is(command, 1, "pid"))
    return command.size() > 2 && command[2].is_list() ? ack() : nack("a list is expected");
  if (!number) return nack("set WORD NUMBER is expected");
  if (is(command, 1, "track")) {
    kept_.tracking = *number > 0;
    return ack();
  }
  if (is(command, 1, kOcr.word)) return *number == kOcr.value ? ack() : nack(kOcr.why);
  if (is(command, 1, "stab")) return outcome(hold(*number > 0));
  if (is(command, 1, kTolerance)) {
    kept_.tolerance = *number;
    return ack();
  }
  Result<GazeSettings> settings = gaze_.settings();
  if (!settings) return nack(settings.error().message);
  if (is(command, 1, "Tneck")) {
    settings->neck_s = *number;
  } else if (is(command, 1, "Teyes")) {
    settings->eyes_s = *number;
  } else if (is(command, 1, "vor")) {
    settings->eyes_make_up = *number;
  } else if (is(command, 1, "sacc")) {
    settings->saccades = *number > 0 ? std::optional(kept_.saccades) : std::nullopt;
  } else if (is(command, 1, "sinh") || is(command, 1, "sact")) {
    GazeSettings::Saccades wanted = kept_.saccades;
    // clients say "at once" by a negative time
    (is(command, 1, "sinh") ? wanted.apart_s : wanted.from_rad) =
        is(command, 1, "sinh") ? std::max(*number, 0.0) : *number * kDegree_rad;
    // also where there are none now the device says whether they could be so
    GazeSettings tried = *settings;
    tried.saccades = wanted;
    Status set = gaze_.set_settings(tried);
    if (set && !settings->saccades) set = gaze_.set_settings(*settings);
    if (set) kept_.saccades = wanted;
    return outcome(set);
  } else {
    return nack("set Tneck, Teyes, track, vor, ocr, sacc, sinh, sact, stab, ntol, pid, tweak are understood");
  }
  return outcome(gaze_.set_settings(*settings));
}

Bottle GazeWords::place_reply(const Bottle& command) {
  if (is(command, 1, "3D")) {
    for (const char* kind : {"mono", "ster", "proj", "ang"}) {
      if (is(command, 2, kind) && command.size() > 3 && command[3].is_list()) {
        return point_reply(place_of(kind, command[3].items));
      }
    }
    return nack("get 3D mono|stereo|proj|ang (...) is expected");
  }
  if (command.size() < 3 || !command[2].is_list()) return nack("get 2D (left|right X Y Z), get ang (X Y Z)");
  const Bottle& words = command[2].items;
  const bool pixel = is(command, 1, "2D");
  const auto n = numbers_from(words, pixel ? 1 : 0);
  const std::optional<int> eye = eye_at(words, 0);
  if (!n || n->size() != 3 || (pixel && !eye)) return nack("get 2D (left|right X Y Z), get ang (X Y Z)");
  const Result<GazeBody> body = this->body();
  if (!body) return nack(body.error().message);
  const Eigen::Vector3d p_Root_m((*n)[0], (*n)[1], (*n)[2]);
  if (!pixel) return ack({list_of(degrees(angles_of(*body, p_Root_m)))});
  const Result<GazeState> state = gaze_.state();
  if (!state) return nack(state.error().message);
  const auto px = pixel_of(*body, *state, *eye, p_Root_m);
  return px ? ack({list_of(*px)}) : nack("the point lies behind the eye");
}

Bottle GazeWords::get(const Bottle& command) {
  if (is(command, 1, "track")) return ack({Value::of(kept_.tracking ? 1 : 0)});
  if (is(command, 1, "2D") || is(command, 1, "3D") || is(command, 1, "ang")) return place_reply(command);
  if (is(command, 1, kOcr.word)) return ack({Value::of(kOcr.value)});
  if (is(command, 1, "stab")) return ack({Value::of(kept_.stabilizing ? 1 : 0)});
  if (is(command, 1, kTolerance)) return ack({Value::of(kept_.tolerance)});
  if (is(command, 1, "sinh")) return ack({Value::of(kept_.saccades.apart_s)});
  if (is(command, 1, "sact")) return ack({Value::of(kept_.saccades.from_rad / kDegree_rad)});
  if (is(command, 1, "pid")) return ack({Value::list({property("dominantEye", Value::string("left"))})});
  if (is(command, 1, "info") || is(command, 1, "tweak")) {
    const Result<GazeBody> body = this->body();
    if (!body) return nack(body.error().message);
    Bottle properties = lens_properties(*body);
    if (is(command, 1, "info")) {
      const Bottle about = {property("server_version", Value::string("2.0")),
                            property("head_version", Value::string("1.0")),
                            property("min_allowed_vergence", Value::of(kSmallestVergence_deg)),
                            property("events", event_names())};
      properties.insert(properties.begin(), about.begin(), about.end());
    }
    return ack({Value::list(std::move(properties))});
  }
  for (Eigen::Index joint = 0; joint < 3; ++joint) {
    if (!is(command, 1, kNeck[static_cast<std::size_t>(joint)])) continue;
    const Result<GazeSettings> settings = gaze_.settings();
    if (!settings) return nack(settings.error().message);
    return ack({Value::of(settings->neck_lower_rad[joint] / kDegree_rad),
                Value::of(settings->neck_upper_rad[joint] / kDegree_rad)});
  }
  if (is(command, 1, "Tneck") || is(command, 1, "Teyes") || is(command, 1, "eyes") || is(command, 1, "vor") ||
      is(command, 1, "sacc")) {
    const Result<GazeSettings> settings = gaze_.settings();
    if (!settings) return nack(settings.error().message);
    if (is(command, 1, "Tneck")) return ack({Value::of(settings->neck_s)});
    if (is(command, 1, "Teyes")) return ack({Value::of(settings->eyes_s)});
    if (is(command, 1, "vor")) return ack({Value::of(settings->eyes_make_up)});
    if (is(command, 1, "sacc")) return ack({Value::of(settings->saccades ? 1 : 0)});
    // negative: not bound. Twice, since clients wait for two numbers and read the first
    const Value vergence = Value::of(settings->vergence_rad ? *settings->vergence_rad / kDegree_rad : -1.0);
    return ack({vergence, vergence});
  }
  const Result<GazeState> state = gaze_.state();
  if (!state) return nack(state.error().message);
  if (is(command, 1, "done") || is(command, 1, "sdon")) return ack({Value::of(state->moving ? 0 : 1)});
  if (is(command, 1, "des")) return ack({list_of(degrees(state->wanted_rad))});
  if (is(command, 1, "vel")) return ack({list_of(degrees(state->velocities_rad_s))});
  if (is(command, 1, "pose")) {
    const std::optional<int> eye = eye_at(command, 2);
    if (eye) return stamped_pose(state->X_RootEyes[static_cast<std::size_t>(*eye)], state->stamp_ns);
    if (is(command, 2, "head")) return stamped_pose(state->X_RootHead, state->stamp_ns);
  }
  return nack(
      "get done, track, pose left|right|head, des, vel, 2D, 3D, ang, Tneck, Teyes, vor, ocr, sacc, sinh, "
      "sact, "
      "stab, ntol, pid, pitch, roll, yaw, eyes, info and tweak are understood");
}

}  // namespace nido::gateway
