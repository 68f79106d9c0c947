#include <fmt/format.h>

#include <array>
#include <numbers>
#include <string_view>

#include "nido/gateway/conversions.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kPercent = 0.01;

enum class Addressed { kOne, kAll, kGroup };

struct Head {
  std::string_view interface;  // word before it; empty: none is needed
  std::string_view word;
  ControlMode mode;
  Addressed addressed;
  double unit;
};

constexpr std::array<Head, 20> kHeads = {{
    {"", "dpo", ControlMode::kDirect, Addressed::kOne, kDegree_rad},
    {"", "dpos", ControlMode::kDirect, Addressed::kAll, kDegree_rad},
    {"", "dpog", ControlMode::kDirect, Addressed::kGroup, kDegree_rad},
    {"", "vmo", ControlMode::kVelocity, Addressed::kOne, kDegree_rad},
    {"", "vmos", ControlMode::kVelocity, Addressed::kAll, kDegree_rad},
    {"", "vmog", ControlMode::kVelocity, Addressed::kGroup, kDegree_rad},
    {"", "vdso", ControlMode::kVelocity, Addressed::kOne, kDegree_rad},
    {"", "vdsa", ControlMode::kVelocity, Addressed::kAll, kDegree_rad},
    {"", "vdsg", ControlMode::kVelocity, Addressed::kGroup, kDegree_rad},
    {"", "pos", ControlMode::kPosition, Addressed::kOne, kDegree_rad},
    {"", "poss", ControlMode::kPosition, Addressed::kAll, kDegree_rad},
    {"", "posg", ControlMode::kPosition, Addressed::kGroup, kDegree_rad},
    {"", "dtq", ControlMode::kTorque, Addressed::kOne, 1.0},
    {"", "dtqs", ControlMode::kTorque, Addressed::kAll, 1.0},
    {"", "dtqg", ControlMode::kTorque, Addressed::kGroup, 1.0},
    {"torq", "ref", ControlMode::kTorque, Addressed::kOne, 1.0},
    {"torq", "refs", ControlMode::kTorque, Addressed::kAll, 1.0},
    {"ipwm", "ref", ControlMode::kPwm, Addressed::kOne, kPercent},
    {"ipwm", "refs", ControlMode::kPwm, Addressed::kAll, kPercent},
    {"ipwm", "refg", ControlMode::kPwm, Addressed::kGroup, kPercent},
}};
constexpr std::array<std::string_view, 6> kInterfaces = {"torq", "ipwm", "icur", "ipod", "ivel", "ived"};

Error wrong(std::string what) { return {ErrorCode::kInvalidArgument, std::move(what)}; }

}  // namespace

Result<StreamCommand> parse_stream_command(const Bottle& given) {
  // a person writes the two lists with or without brackets around them
  const Bottle& bottle = given.size() == 1 && given[0].is_list() ? given[0].items : given;
  if (bottle.size() != 2 || !bottle[0].is_list() || !bottle[1].is_list()) {
    return wrong("two lists are expected, what and how much: ((dpo 3) (45.0))");
  }
  const std::vector<Value>& head = bottle[0].items;
  std::size_t at = 0;
  std::string_view interface;
  if (!head.empty() && head[0].is_text()) {
    for (const std::string_view known : kInterfaces) {
      if (head[0].text == known) {
        interface = known;
        at = 1;
      }
    }
  }
  const Head* found = nullptr;
  for (const Head& known : kHeads) {
    if (at < head.size() && head[at].is_word(known.word) &&
        (known.interface.empty() ? interface != "icur" : known.interface == interface)) {
      found = &known;
    }
  }
  if (found == nullptr) {
    return wrong(fmt::format("'{}' is no streaming command: dpo, vmo, dtq, ipwm ref and their groups are",
                             yarp::to_text(head).substr(0, 60)));
  }
  StreamCommand command;
  command.mode = found->mode;
  for (const Value& value : bottle[1].items) {
    if (!value.is_number()) return wrong("a value is a number");
    command.values.push_back(value.as_number() * found->unit);
  }
  const std::size_t count = command.values.size();
  const auto joint_of = [&](const Value& value) -> bool {
    if (!value.is_integer() || value.integer < 0 || value.integer > 1000) return false;
    command.joints.push_back(static_cast<int>(value.integer));
    return true;
  };
  switch (found->addressed) {
    case Addressed::kOne:
      if (head.size() != at + 2 || !joint_of(head[at + 1]) || count != 1)
        return wrong("one joint and one value are expected");
      break;
    case Addressed::kAll:
      for (std::size_t joint = 0; joint < count; ++joint) command.joints.push_back(static_cast<int>(joint));
      break;
    case Addressed::kGroup:
      if (head.size() != at + 3 || !head[at + 2].is_list()) return wrong("N (JOINT ...) is expected");
      for (const Value& joint : head[at + 2].items) {
        if (!joint_of(joint)) return wrong("a joint is a whole number from 0");
      }
      if (!head[at + 1].is_integer() || head[at + 1].integer != std::ssize(command.joints) ||
          command.joints.size() != count) {
        return wrong(fmt::format("{} joints but {} values", command.joints.size(), count));
      }
      break;
  }
  return command;
}

}  // namespace nido::gateway
