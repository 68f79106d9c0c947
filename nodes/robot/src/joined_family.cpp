#include <charconv>

#include "nido/wrappers/joined_board.h"
#include "src/device_registry.h"

namespace nido {
namespace {

// "torso": all joints of that board; "right_arm 3", "right_arm 0-6": one, or from one to another.
Result<std::vector<JointOf>> joints_of(const std::string& entry, const DeviceContext& context) {
  const std::size_t space = entry.find(' ');
  const std::string name = entry.substr(0, space);
  IControlBoard* board = context.board ? context.board(name) : nullptr;
  if (board == nullptr) {
    return Error{ErrorCode::kInvalidArgument,
                 "joints: there is no control board '" + name + "' further up in the robot file"};
  }
  int first = 0;
  int last = board->axes() - 1;
  if (space != std::string::npos) {
    const char* const end = entry.data() + entry.size();
    auto read = std::from_chars(entry.data() + space + 1, end, first);
    last = first;
    if (read.ec == std::errc{} && read.ptr != end && *read.ptr == '-') {
      read = std::from_chars(read.ptr + 1, end, last);
    }
    if (read.ec != std::errc{} || read.ptr != end || first < 0 || last < first || last >= board->axes()) {
      return Error{ErrorCode::kInvalidArgument,
                   "joints: '" + entry + "': BOARD, BOARD JOINT or BOARD FIRST-LAST " +
                       "is expected, joints 0 to " + std::to_string(board->axes() - 1)};
    }
  }
  std::vector<JointOf> joints;
  for (int joint = first; joint <= last; ++joint) joints.push_back({board, joint});
  return joints;
}

Result<MadeDevice> make_joined(const YAML::Node& parameters, DeviceContext& context) {
  std::vector<JointOf> joints;
  for (const auto& entry : parameters["joints"].as<std::vector<std::string>>()) {
    const Result<std::vector<JointOf>> some = joints_of(entry, context);
    if (!some) return some.error();
    joints.insert(joints.end(), some->begin(), some->end());
  }
  auto board = JoinedBoard::create(std::move(joints));
  if (!board) return board.error();
  MadeDevice made{std::unique_ptr<IControlBoard>(std::move(*board))};
  made.is_under_limits = true;
  return made;
}

}  // namespace

std::vector<DeviceKind> joined_family() {
  return {{"joined/control_board",
           {"device joined/control_board",
            "",
            {{.key = "joints",
              .kind = ValueKind::kTextList,
              .required = true,
              .meaning = "BOARD, BOARD JOINT or BOARD FIRST-LAST, boards that are further up in this file"}}},
           &make_joined}};
}

}  // namespace nido
