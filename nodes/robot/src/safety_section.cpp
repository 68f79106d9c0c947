#include "src/safety_section.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace nido {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string number_rule(const std::string& text) { return number_in(text) ? "" : "is no number"; }

std::vector<double> numbers_in(const YAML::Node& list) {
  std::vector<double> numbers;
  for (const YAML::Node& item : list) numbers.push_back(number_in(item.as<std::string>()).value_or(0));
  return numbers;
}

Field numbers_field(const char* key, const char* meaning) {
  return {.key = key, .kind = ValueKind::kTextList, .meaning = meaning, .rule = number_rule};
}

const Schema& heartbeat_schema() {
  static const Schema schema{
      "heartbeat",
      "",
      {{.key = "timeout_s",
        .kind = ValueKind::kNumber,
        .required = true,
        .meaning = "the robot stops when a source that has been heard is not heard for so long, s",
        .min = 0.02,
        .max = 60},
       {.key = "from",
        .kind = ValueKind::kTextList,
        .fallback = "[]",
        .meaning = "nodes and output ports; also 'beat' on the port estop counts"}}};
  return schema;
}

const Schema& box_schema() {
  static const Schema schema{"box",
                             "",
                             {numbers_field("x_m", "from and to; without it from end to end of the world"),
                              numbers_field("y_m", "from and to"), numbers_field("z_m", "from and to")}};
  return schema;
}

const Schema& plane_schema() {
  static const Schema schema{
      "plane",
      "",
      {numbers_field("point_m", "x, y, z of a point of the plane"),
       numbers_field("normal", "x, y, z of a direction: the links stay on that side")}};
  return schema;
}

const Schema& rule_schema() {
  static const Schema schema{
      "workspace rule",
      "name",
      {{.key = "name", .required = true, .meaning = "of the border, in sentences"},
       {.key = "links", .kind = ValueKind::kTextList, .required = true, .meaning = "links of the body"},
       {.key = "radius_m",
        .kind = ValueKind::kNumber,
        .fallback = "0",
        .meaning = "of a sphere around each link's origin",
        .min = 0,
        .max = 1},
       {.key = "inside",
        .kind = ValueKind::kMap,
        .meaning = "they stay in this box (root frame)",
        .inner = &box_schema()},
       {.key = "outside",
        .kind = ValueKind::kMap,
        .meaning = "they stay out of this box",
        .inner = &box_schema()},
       {.key = "plane",
        .kind = ValueKind::kMap,
        .meaning = "they stay on one side of this plane",
        .inner = &plane_schema()}}};
  return schema;
}

const Schema& joint_schema() {
  static const Schema schema{
      "joint limit",
      "",
      {{.key = "device", .required = true, .meaning = "name of a control board of this file"},
       {.key = "joint", .fallback = "all", .meaning = "name or number of a joint, or all"},
       {.key = "min_deg", .kind = ValueKind::kNumber, .meaning = "smallest angle"},
       {.key = "max_deg", .kind = ValueKind::kNumber, .meaning = "greatest angle"},
       {.key = "speed_deg_s", .kind = ValueKind::kNumber, .meaning = "top speed", .min = 0.01},
       {.key = "torque_Nm", .kind = ValueKind::kNumber, .meaning = "greatest torque", .min = 0},
       {.key = "speed",
        .kind = ValueKind::kNumber,
        .meaning = "of all joints: share of their top speeds",
        .min = 0.01,
        .max = 1}}};
  return schema;
}

Result<WorkspaceRule> read_rule(const YAML::Node& node, const std::string& where) {
  WorkspaceRule rule;
  rule.name = node["name"].as<std::string>();
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: workspace '{}': {}", where, rule.name, what)};
  };
  rule.links = node["links"].as<std::vector<std::string>>();
  rule.radius_m = node["radius_m"].as<double>();
  int kinds = 0;
  for (const auto& [key, kind] : {std::pair{"inside", WorkspaceRule::Kind::kInside},
                                  {"outside", WorkspaceRule::Kind::kOutside},
                                  {"plane", WorkspaceRule::Kind::kPlane}}) {
    if (!node[key]) continue;
    rule.kind = kind;
    ++kinds;
  }
  if (kinds != 1) return wrong("expected is one of inside, outside, plane");
  if (rule.kind == WorkspaceRule::Kind::kPlane) {
    const std::vector<double> point = numbers_in(node["plane"]["point_m"]);
    const std::vector<double> normal = numbers_in(node["plane"]["normal"]);
    if (point.size() != 3 || normal.size() != 3) return wrong("point_m and normal are three numbers each");
    rule.p_RootPlane_m = {point[0], point[1], point[2]};
    rule.normal_Root = Eigen::Vector3d(normal[0], normal[1], normal[2]).normalized();
    return rule;
  }
  const YAML::Node box = node[rule.kind == WorkspaceRule::Kind::kInside ? "inside" : "outside"];
  Eigen::Vector3d from_m = Eigen::Vector3d::Constant(-kInfinity);
  Eigen::Vector3d to_m = Eigen::Vector3d::Constant(kInfinity);
  for (const auto& [axis, key] : {std::pair{0, "x_m"}, {1, "y_m"}, {2, "z_m"}}) {
    if (!box[key]) continue;
    const std::vector<double> ends = numbers_in(box[key]);
    if (ends.size() != 2 || ends[0] >= ends[1]) {
      return wrong(fmt::format("{} is two numbers, the smaller one first", key));
    }
    from_m[axis] = ends[0];
    to_m[axis] = ends[1];
  }
  if (!from_m.array().isFinite().any()) return wrong("a box needs x_m, y_m or z_m");
  rule.box_Root_m = {from_m, to_m};
  return rule;
}

Status read_limit(const YAML::Node& node, const std::string& where, SafetyEntry& safety) {
  BoardNarrowing& board = safety.limits[node["device"].as<std::string>()];
  const auto number = [&](const char* key, double unit) -> std::optional<double> {
    if (!node[key]) return std::nullopt;
    return node[key].as<double>() * unit;
  };
  const JointNarrowing joint{number("min_deg", kDegree_rad), number("max_deg", kDegree_rad),
                             number("speed_deg_s", kDegree_rad), number("torque_Nm", 1)};
  const auto which = node["joint"].as<std::string>();
  if (node["speed"] && which != "all") {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: safety.limits: speed is for all joints; one joint has speed_deg_s", where)};
  }
  if (node["speed"]) board.speed = node["speed"].as<double>();
  if (joint.min_rad || joint.max_rad || joint.speed_rad_s || joint.torque_Nm) board.joints[which] = joint;
  return {};
}

}  // namespace

const Schema& safety_schema() {
  static const Schema schema{
      "safety",
      "",
      {{.key = "read_only",
        .kind = ValueKind::kFlag,
        .fallback = "false",
        .meaning = "every command is refused"},
       {.key = "speed",
        .kind = ValueKind::kNumber,
        .fallback = "1",
        .meaning = "share of the joints' top speeds that is allowed",
        .min = 0.01,
        .max = 1},
       {.key = "estop",
        .fallback = "hold",
        .meaning = "what the emergency stop does: joints hold, or their motors go off (idle)",
        .allowed = {"hold", "idle"}},
       {.key = "heartbeat",
        .kind = ValueKind::kMap,
        .meaning = "who has to be heard, or the robot stops",
        .inner = &heartbeat_schema()},
       {.key = "limits",
        .kind = ValueKind::kList,
        .fallback = "[]",
        .meaning = "joints that may do less than they can",
        .inner = &joint_schema()},
       {.key = "workspace",
        .kind = ValueKind::kList,
        .fallback = "[]",
        .meaning = "where links may not be driven",
        .inner = &rule_schema()}}};
  return schema;
}

Result<SafetyEntry> read_safety(const YAML::Node& checked, const std::string& where) {
  SafetyEntry safety;
  safety.read_only = checked["read_only"].as<bool>();
  safety.speed = checked["speed"].as<double>();
  safety.estop = checked["estop"].as<std::string>() == "idle" ? StopAction::kIdle : StopAction::kHold;
  if (const YAML::Node heartbeat = checked["heartbeat"]) {
    safety.heartbeat_s = heartbeat["timeout_s"].as<double>();
    safety.heartbeat_from = heartbeat["from"].as<std::vector<std::string>>();
  }
  for (const YAML::Node& limit : checked["limits"]) {
    if (Status read = read_limit(limit, where, safety); !read) return read.error();
  }
  for (const YAML::Node& node : checked["workspace"]) {
    Result<WorkspaceRule> rule = read_rule(node, where);
    if (!rule) return rule.error();
    safety.workspace.push_back(std::move(*rule));
  }
  return safety;
}

Result<std::vector<JointLimits>> narrowed(const IControlBoard& board, const std::string& name,
                                          const SafetyEntry& safety) {
  Result<std::vector<JointLimits>> limits = board.limits();
  if (!limits) return limits;
  const auto found = safety.limits.find(name);
  const BoardNarrowing narrowing = found == safety.limits.end() ? BoardNarrowing{} : found->second;
  const auto narrow = [&](const std::string& joint, JointLimits& own,
                          const JointNarrowing& wanted) -> Status {
    const auto wrong = [&](const std::string& what, double unit) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("safety.limits of '{}', joint {}: {}: it can go from {:.1f} to {:.1f} deg at {:.1f} "
                      "deg/s with {:.3g} N m",
                      name, joint, what, own.min_rad / unit, own.max_rad / unit,
                      own.max_velocity_rad_s / unit, own.max_torque_Nm)};
    };
    constexpr double kRounding = 1e-9;
    const JointLimits next{wanted.min_rad.value_or(own.min_rad), wanted.max_rad.value_or(own.max_rad),
                           wanted.speed_rad_s.value_or(own.max_velocity_rad_s),
                           wanted.torque_Nm.value_or(own.max_torque_Nm)};
    if (next.min_rad < own.min_rad - kRounding || next.max_rad > own.max_rad + kRounding ||
        next.max_velocity_rad_s > own.max_velocity_rad_s + kRounding ||
        next.max_torque_Nm > own.max_torque_Nm + kRounding) {
      return wrong("wider than the joint's own limits", kDegree_rad);
    }
    if (next.min_rad > next.max_rad) return wrong("min_deg above max_deg leaves nothing", kDegree_rad);
    own = next;
    return {};
  };
  std::vector<std::string> names;
  for (int joint = 0; joint < board.axes(); ++joint) {
    const Result<std::string> axis = board.axis_name(joint);
    names.push_back(axis ? *axis : std::to_string(joint));
  }
  // what holds for all goes before what holds for one
  for (const bool one : {false, true}) {
    for (const auto& [which, wanted] : narrowing.joints) {
      if ((which != "all") != one) continue;
      bool is_there = false;
      for (std::size_t i = 0; i < limits->size(); ++i) {
        if (one && which != names[i] && which != std::to_string(i)) continue;
        is_there = true;
        if (Status narrower = narrow(names[i], (*limits)[i], wanted); !narrower) return narrower.error();
      }
      if (is_there) continue;
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("safety.limits of '{}': it has no joint '{}'; there are {}", name, which,
                               fmt::join(names, ", "))};
    }
  }
  for (JointLimits& joint : *limits) joint.max_velocity_rad_s *= safety.speed * narrowing.speed;
  return limits;
}

}  // namespace nido
