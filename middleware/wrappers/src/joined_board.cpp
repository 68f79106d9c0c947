#include "nido/wrappers/joined_board.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <set>

#include "nido/interfaces/check_joints.h"
#include "nido/interfaces/check_motors.h"

namespace nido {
namespace {

Error lacks(const char* what) {
  return {ErrorCode::kUnsupported, std::string("a board that this one is made of ") + what};
}

template <class Reading>
std::int64_t oldest_ns(const std::vector<Reading>& readings) {
  return std::min_element(readings.begin(), readings.end(),
                          [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; })
      ->stamp_ns;
}

}  // namespace

Result<std::unique_ptr<JoinedBoard>> JoinedBoard::create(std::vector<JointOf> joints) {
  if (joints.empty()) return Error{ErrorCode::kInvalidArgument, "a board has one joint or more"};
  std::set<std::pair<IControlBoard*, int>> named;
  for (const auto& [board, joint] : joints) {
    if (board == nullptr) return Error{ErrorCode::kInvalidArgument, "a joint has no board"};
    if (const Status exists = check_joints(board->axes(), std::span(&joint, 1)); !exists)
      return exists.error();
    if (!named.emplace(board, joint).second) {
      return Error{ErrorCode::kInvalidArgument,
                   "joint " + std::to_string(joint) + " of a board is named twice"};
    }
  }
  return std::unique_ptr<JoinedBoard>(new JoinedBoard(std::move(joints)));
}

JoinedBoard::JoinedBoard(std::vector<JointOf> joints) {
  for (const auto& [board, joint] : joints) {
    const auto found = std::find(boards_.begin(), boards_.end(), board);
    joints_.push_back({static_cast<std::size_t>(found - boards_.begin()), joint});
    if (found == boards_.end()) boards_.push_back(board);
  }
}

template <class T, class Read>
Result<std::vector<T>> JoinedBoard::readings(Read read) const {
  std::vector<T> all;
  for (const IControlBoard* board : boards_) {
    Result<T> one = std::invoke(read, *board);
    if (!one) return one.error();
    all.push_back(std::move(*one));
  }
  return all;
}

template <class T, class Read>
Result<std::vector<T>> JoinedBoard::gathered(Read read) const {
  const auto all = readings<std::vector<T>>(read);
  if (!all) return all.error();
  std::vector<T> picked;
  for (const Place& place : joints_) {
    picked.push_back((*all)[place.board].at(static_cast<std::size_t>(place.joint)));
  }
  return picked;
}

template <class T, class Whole>
std::vector<T> JoinedBoard::picked(const std::vector<Whole>& wholes, std::vector<T> Whole::*list) const {
  std::vector<T> out;
  for (const Place& place : joints_) {
    const std::vector<T>& one = wholes[place.board].*list;
    if (one.empty()) return {};
    out.push_back(one.at(static_cast<std::size_t>(place.joint)));
  }
  return out;
}

template <class Command>
Status JoinedBoard::split(std::span<const int> joints, Command command) {
  for (std::size_t b = 0; b < boards_.size(); ++b) {
    std::vector<int> own;
    std::vector<std::size_t> values;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const Place& place = joints_[static_cast<std::size_t>(joints[i])];
      if (place.board != b) continue;
      own.push_back(place.joint);
      values.push_back(i);
    }
    if (own.empty()) continue;
    if (Status told = command(*boards_[b], own, values); !told) return told;
  }
  return {};
}

template <class T, class Command>
Status JoinedBoard::split_values(std::span<const int> joints, std::span<const T> values, bool moves,
                                 Command command) {
  std::vector<std::pair<IControlBoard*, std::vector<int>>> taken;
  Status told = split(
      joints, [&](IControlBoard& board, const std::vector<int>& own, const std::vector<std::size_t>& places) {
        std::vector<T> part;
        for (const std::size_t place : places) part.push_back(values[place]);
        Status one = std::invoke(command, board, std::span<const int>(own), std::span<const T>(part));
        if (one) taken.emplace_back(&board, own);
        return one;
      });
  if (told || !moves) return told;
  for (const auto& [board, own] : taken) {
    // the refusal that led here is what the caller has to know
    [[maybe_unused]] const Status stopped = board->stop(own);
  }
  return told;
}

Result<std::string> JoinedBoard::axis_name(int joint) const {
  if (const Status exists = check_joints(axes(), std::span(&joint, 1)); !exists) return exists.error();
  const Place& place = joints_[static_cast<std::size_t>(joint)];
  return boards_[place.board]->axis_name(place.joint);
}

Result<JointReading> JoinedBoard::read_joints() const {
  const auto all = readings<JointReading>(&IControlBoard::read_joints);
  if (!all) return all.error();
  JointReading reading;
  reading.stamp_ns = oldest_ns(*all);
  reading.position_rad = picked(*all, &JointReading::position_rad);
  reading.velocity_rad_s = picked(*all, &JointReading::velocity_rad_s);
  reading.acceleration_rad_s2 = picked(*all, &JointReading::acceleration_rad_s2);
  reading.torque_Nm = picked(*all, &JointReading::torque_Nm);
  return reading;
}

Result<std::vector<JointLimits>> JoinedBoard::limits() const {
  return gathered<JointLimits>(&IControlBoard::limits);
}
Result<std::vector<ControlMode>> JoinedBoard::control_modes() const {
  return gathered<ControlMode>(&IControlBoard::control_modes);
}
Result<std::vector<double>> JoinedBoard::target_positions() const {
  return gathered<double>(&IControlBoard::target_positions);
}
Result<std::vector<double>> JoinedBoard::reference_speeds() const {
  return gathered<double>(&IControlBoard::reference_speeds);
}
Result<std::vector<double>> JoinedBoard::reference_accelerations() const {
  return gathered<double>(&IControlBoard::reference_accelerations);
}
Result<std::vector<bool>> JoinedBoard::motion_done() const {
  return gathered<bool>(&IControlBoard::motion_done);
}
Result<std::vector<bool>> JoinedBoard::amplifiers_on() const {
  return gathered<bool>(&IControlBoard::amplifiers_on);
}
Result<std::vector<Pid>> JoinedBoard::pids(PidLoop loop) const {
  return gathered<Pid>([loop](const IControlBoard& board) { return board.pids(loop); });
}
Result<std::vector<InteractionMode>> JoinedBoard::interaction_modes() const {
  return gathered<InteractionMode>(&IControlBoard::interaction_modes);
}
Result<std::vector<Impedance>> JoinedBoard::impedances() const {
  return gathered<Impedance>(&IControlBoard::impedances);
}
Result<std::vector<bool>> JoinedBoard::calibrated() const {
  return gathered<bool>(&IControlBoard::calibrated);
}

Status JoinedBoard::set_control_mode(std::span<const int> joints, ControlMode mode) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  return split(joints, [mode](IControlBoard& board, const auto& own, const auto&) {
    return board.set_control_mode(own, mode);
  });
}
Status JoinedBoard::stop(std::span<const int> joints) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  // all are told, whoever does not obey
  Status outcome;
  [[maybe_unused]] const Status told = split(joints, [&](IControlBoard& board, const auto& own, const auto&) {
    if (Status stopped = board.stop(own); !stopped) outcome = stopped;
    return Status();
  });
  return outcome;
}
Status JoinedBoard::move_to(std::span<const int> joints, std::span<const double> target_rad) {
  if (Status valid = check_joint_values(axes(), joints, target_rad); !valid) return valid;
  return split_values(joints, target_rad, true, &IControlBoard::move_to);
}
Status JoinedBoard::set_positions(std::span<const int> joints, std::span<const double> target_rad) {
  if (Status valid = check_joint_values(axes(), joints, target_rad); !valid) return valid;
  return split_values(joints, target_rad, true, &IControlBoard::set_positions);
}
Status JoinedBoard::set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) {
  if (Status valid = check_joint_values(axes(), joints, velocity_rad_s); !valid) return valid;
  return split_values(joints, velocity_rad_s, true, &IControlBoard::set_velocities);
}
Status JoinedBoard::set_torques(std::span<const int> joints, std::span<const double> torque_Nm) {
  if (Status valid = check_joint_values(axes(), joints, torque_Nm); !valid) return valid;
  return split_values(joints, torque_Nm, true, &IControlBoard::set_torques);
}
Status JoinedBoard::set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) {
  if (Status valid = check_joint_values(axes(), joints, duty_cycle); !valid) return valid;
  return split_values(joints, duty_cycle, true, &IControlBoard::set_duty_cycles);
}
Status JoinedBoard::set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) {
  if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
  return split_values(joints, speed_rad_s, false, &IControlBoard::set_reference_speeds);
}
Status JoinedBoard::set_reference_accelerations(std::span<const int> joints,
                                                std::span<const double> acceleration_rad_s2) {
  if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
  return split_values(joints, acceleration_rad_s2, false, &IControlBoard::set_reference_accelerations);
}
Status JoinedBoard::set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) {
  if (Status valid = check_pids(axes(), joints, pids); !valid) return valid;
  return split_values(joints, pids, false, [loop](IControlBoard& board, auto own, auto values) {
    return board.set_pids(loop, own, values);
  });
}
Status JoinedBoard::set_interaction_mode(std::span<const int> joints, InteractionMode mode) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  return split(joints, [mode](IControlBoard& board, const auto& own, const auto&) {
    return board.set_interaction_mode(own, mode);
  });
}
Status JoinedBoard::set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) {
  if (Status valid = check_impedances(axes(), joints, impedances); !valid) return valid;
  return split_values(joints, impedances, false, &IControlBoard::set_impedances);
}
Status JoinedBoard::calibrate(std::span<const int> joints) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  return split(joints,
               [](IControlBoard& board, const auto& own, const auto&) { return board.calibrate(own); });
}
Status JoinedBoard::home(std::span<const int> joints) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  return split(joints, [](IControlBoard& board, const auto& own, const auto&) { return board.home(own); });
}

Result<MotorReading> JoinedBoard::read_motors() const {
  const auto all = readings<MotorReading>(&IControlBoard::read_motors);
  if (!all) return all.error();
  MotorReading reading;
  reading.stamp_ns = oldest_ns(*all);
  for (const auto list :
       {&MotorReading::position_rad, &MotorReading::velocity_rad_s, &MotorReading::acceleration_rad_s2,
        &MotorReading::duty_cycle, &MotorReading::current_A, &MotorReading::temperature_C}) {
    reading.*list = picked(*all, list);
  }
  return reading;
}

Result<PidReading> JoinedBoard::read_pids(PidLoop loop) const {
  const auto all = readings<PidReading>([loop](const IControlBoard& board) { return board.read_pids(loop); });
  if (!all) return all.error();
  return PidReading{picked(*all, &PidReading::reference), picked(*all, &PidReading::error),
                    picked(*all, &PidReading::output)};
}

Result<std::vector<std::string>> JoinedBoard::variable_names() const {
  std::vector<std::string> names;
  for (std::size_t b = 0; b < boards_.size(); ++b) {
    const Result<std::vector<std::string>> own = boards_[b]->variable_names();
    if (!own) return own.error();
    for (const std::string& name : *own) names.push_back(std::to_string(b) + "." + name);
  }
  return names;
}

Result<std::pair<IControlBoard*, std::string>> JoinedBoard::owner_of(const std::string& variable) const {
  const std::size_t dot = variable.find('.');
  std::size_t board = boards_.size();
  if (dot != std::string::npos) {
    const auto [stop, code] = std::from_chars(variable.data(), variable.data() + dot, board);
    if (code != std::errc{} || stop != variable.data() + dot) board = boards_.size();
  }
  if (board < boards_.size()) return std::pair(boards_[board], variable.substr(dot + 1));
  return Error{ErrorCode::kNotFound, "there is no variable '" + variable +
                                         "': they are called 0.NAME for the " +
                                         "first board, 1.NAME for the second, and so on"};
}
Result<std::string> JoinedBoard::variable(const std::string& name) const {
  const auto owner = owner_of(name);
  return owner ? owner->first->variable(owner->second) : owner.error();
}
Status JoinedBoard::set_variable(const std::string& name, const std::string& value) {
  const auto owner = owner_of(name);
  return owner ? owner->first->set_variable(owner->second, value) : owner.error();
}

Result<std::vector<double>> JoinedBoard::commanded(ControlMode mode) const {
  return gathered<double>([mode](const IControlBoard& board) -> Result<std::vector<double>> {
    const auto* commanded = dynamic_cast<const ICommanded*>(&board);
    return commanded != nullptr ? commanded->commanded(mode) : lacks("does not tell what it is streamed");
  });
}
Result<std::vector<double>> JoinedBoard::greatest_currents() const {
  return gathered<double>([](const IControlBoard& board) -> Result<std::vector<double>> {
    const auto* range = dynamic_cast<const ICurrentRange*>(&board);
    return range != nullptr ? range->greatest_currents() : lacks("does not know its greatest currents");
  });
}
Status JoinedBoard::set_position_limits(int joint, double min_rad, double max_rad) {
  if (Status exists = check_joints(axes(), std::span(&joint, 1)); !exists) return exists;
  return split(std::span(&joint, 1), [&](IControlBoard& board, const auto& own, const auto&) -> Status {
    auto* settings = dynamic_cast<ILimitSettings*>(&board);
    return settings != nullptr ? settings->set_position_limits(own.front(), min_rad, max_rad)
                               : lacks("takes no other limits");
  });
}
Status JoinedBoard::set_velocity_limit(int joint, double max_rad_s) {
  if (Status exists = check_joints(axes(), std::span(&joint, 1)); !exists) return exists;
  return split(std::span(&joint, 1), [&](IControlBoard& board, const auto& own, const auto&) -> Status {
    auto* settings = dynamic_cast<ILimitSettings*>(&board);
    return settings != nullptr ? settings->set_velocity_limit(own.front(), max_rad_s)
                               : lacks("takes no other limits");
  });
}

}  // namespace nido
