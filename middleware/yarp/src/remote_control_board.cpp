#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numbers>
#include <optional>

#include "nido/interfaces/check_joints.h"
#include "nido/textproto/asked_board.h"
#include "nido/textproto/control_board_text.h"
#include "nido/yarp/devices.h"
#include "remote_stamps.h"

namespace nido::yarp {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kPercent = 0.01;
constexpr std::size_t kLongestState = 256 * 1024;
// modes that the far side tells may be older than what was set last
constexpr auto kModesDelay = std::chrono::milliseconds(200);

std::string word_of_number(std::int64_t number) {
  std::string word;
  for (; number > 0; number >>= 8) word += static_cast<char>(number & 0xff);
  return word;
}

Value whole(std::size_t number) { return Value::of(static_cast<std::int64_t>(number)); }

class RemoteControlBoard final : public AskedBoard {
 public:
  RemoteControlBoard(std::shared_ptr<Network> network, const RemoteDevice& device, double max_torque_Nm)
      : network_(std::move(network)),
        device_(device),
        max_torque_Nm_(max_torque_Nm),
        stamps_(device, *network_) {}

  Status open() {
    const Result<Bottle> version = ask({Value::word("get"), Value::word("prot")});
    if (!version) return version.error();
    const Result<Bottle> axes = ask({Value::word("get"), Value::word("axes")});
    if (!axes) return axes.error();
    if (axes->size() < 3 || !(*axes)[2].is_integer() || (*axes)[2].integer < 1 || (*axes)[2].integer > 1000) {
      return strange("[get] [axes]");
    }
    for (std::int64_t joint = 0; joint < (*axes)[2].integer; ++joint) {
      if (Status told = ask_about(joint); !told) return told;
    }
    auto state = network_->subscribe(
        device_.remote + "/stateExt:o", device_.local + "/stateExt:i", kLongestState,
        [this](const std::string& bytes, const std::string& envelope) { take_state(bytes, envelope); });
    if (!state) return state.error();
    state_ = std::move(*state);
    auto command = network_->stream_to(device_.remote + "/command:i", device_.local + "/command:o");
    if (!command) return command.error();
    command_ = std::move(*command);
    return wait_for_first([this] { return read_joints(); });
  }

  int axes() const override { return static_cast<int>(names_.size()); }
  Result<std::string> axis_name(int joint) const override {
    const int wanted[] = {joint};
    if (Status valid = check_joints(axes(), wanted); !valid) return valid.error();
    return names_[static_cast<std::size_t>(joint)];
  }
  Result<std::vector<JointLimits>> limits() const override { return limits_; }

  Result<JointReading> read_joints() const override {
    const std::lock_guard lock(mutex_);
    if (!newest_) return Error{ErrorCode::kTimeout, device_.remote + "/stateExt:o: nothing has come yet"};
    return *newest_;
  }

  Result<std::vector<ControlMode>> control_modes() const override {
    const Result<Bottle> reply = ask({Value::word("get"), Value::word("icmd"), Value::word("cmds")});
    if (!reply) return reply.error();
    if (reply->size() < 3 || !(*reply)[2].is_list() || (*reply)[2].items.size() != names_.size()) {
      return strange("[get] [icmd] [cmds]");
    }
    std::vector<ControlMode> modes;
    for (const Value& word : (*reply)[2].items) {
      modes.push_back(mode_from_word(word.text).value_or(ControlMode::kFault));
    }
    return modes;
  }

  Status set_control_mode(std::span<const int> joints, ControlMode mode) override {
    if (Status valid = check_joints(axes(), joints); !valid) return valid;
    if (mode == ControlMode::kFault) {
      return Error{ErrorCode::kInvalidArgument, "mode fault cannot be asked for"};
    }
    if (joints.empty()) return {};
    const Bottle words(joints.size(), Value::word(mode_word(mode)));
    if (Status ordered = order({Value::word("set"), Value::word("icmd"), Value::word("cmog"),
                                whole(joints.size()), list_of(joints), Value::list(words)});
        !ordered) {
      return ordered;
    }
    const std::lock_guard lock(mutex_);
    for (const int joint : joints) modes_[static_cast<std::size_t>(joint)] = mode;
    modes_set_ = std::chrono::steady_clock::now();
    return {};
  }

  Status move_to(std::span<const int> joints, std::span<const double> target_rad) override {
    if (Status valid = check_joint_values(axes(), joints, target_rad); !valid) return valid;
    if (Status switched = be_in(ControlMode::kPosition, joints); !switched) return switched;
    return order_group("posg", joints, target_rad);
  }
  Result<std::vector<double>> target_positions() const override { return ask_numbers("poss"); }
  Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) override {
    if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
    return order_group("velg", joints, speed_rad_s);
  }
  Result<std::vector<double>> reference_speeds() const override { return ask_numbers("vels"); }
  Status set_reference_accelerations(std::span<const int> joints,
                                     std::span<const double> acceleration_rad_s2) override {
    if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
    return order_group("accg", joints, acceleration_rad_s2);
  }
  Result<std::vector<double>> reference_accelerations() const override { return ask_numbers("accs"); }

  Result<std::vector<bool>> motion_done() const override {
    std::vector<bool> done;
    for (std::size_t joint = 0; joint < names_.size(); ++joint) {
      const Result<Bottle> reply = ask({Value::word("get"), Value::word("don"), whole(joint)});
      if (!reply) return reply.error();
      if (reply->size() < 3 || !(*reply)[2].is_integer()) return strange("[get] [don]");
      done.push_back((*reply)[2].integer != 0);
    }
    return done;
  }

  Status stop(std::span<const int> joints) override {
    if (Status valid = check_joints(axes(), joints); !valid) return valid;
    if (joints.empty()) return {};
    if (Status stopped =
            order({Value::word("set"), Value::word("stog"), whole(joints.size()), list_of(joints)});
        !stopped) {
      return stopped;
    }
    return set_control_mode(joints, ControlMode::kPosition);
  }

  Status set_positions(std::span<const int> joints, std::span<const double> target_rad) override {
    return stream(ControlMode::kDirect, "dpog", joints, target_rad, kDegree_rad);
  }
  Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) override {
    return stream(ControlMode::kVelocity, "vmog", joints, velocity_rad_s, kDegree_rad);
  }
  Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) override {
    return stream(ControlMode::kTorque, "dtqg", joints, torque_Nm, 1.0);
  }
  // this one has no form for several joints
  Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) override {
    if (Status valid = check_joint_values(axes(), joints, duty_cycle); !valid) return valid;
    if (Status switched = be_in(ControlMode::kPwm, joints); !switched) return switched;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      Bottle head = {Value::word("ipwm"), Value::word("ref"),
                     Value::of(static_cast<std::int64_t>(joints[i]))};
      Status sent =
          command_->send({Value::list(std::move(head)), Value::list({Value::of(duty_cycle[i] / kPercent)})});
      if (!sent) return sent;
    }
    return {};
  }

 private:
  Error strange(const std::string& line) const {
    return {ErrorCode::kFailed,
            fmt::format("{}/rpc:i gave an answer to {} that is not understood: is it a control board?",
                        device_.remote, line)};
  }

  // the words of an answer that is not a refusal
  Result<Bottle> ask(const Bottle& request) const {
    Result<Bottle> reply = network_->ask(device_.remote + "/rpc:i", request);
    if (!reply) return reply;
    if (reply->empty() || reply->front().is_word("fail") || reply->front().is_word("nak")) {
      const std::string reason =
          reply->size() > 1 && (*reply)[1].is_text() ? (*reply)[1].text : "refused: " + to_text(request);
      return Error{ErrorCode::kFailed, device_.remote + ": " + reason};
    }
    return reply;
  }
  Result<std::vector<TextValue>> ask_line(const std::string& line) const override {
    Result<Bottle> request = parse_bottle(line);
    if (!request) return request.error();
    const Result<Bottle> reply = ask(*request);
    if (!reply) return reply.error();
    return parse_text(to_text(*reply));
  }
  Status order(const Bottle& request) const {
    // what was streamed before must not come after the order
    if (command_) command_->flush();
    const Result<Bottle> reply = ask(request);
    if (!reply) return reply.error();
    return {};
  }

  // name and limits of one joint
  Status ask_about(std::int64_t joint) {
    const auto get = [&](const Bottle& what, std::size_t numbers) -> Result<Bottle> {
      Bottle request = {Value::word("get")};
      request.insert(request.end(), what.begin(), what.end());
      request.push_back(Value::of(joint));
      Result<Bottle> reply = ask(request);
      if (!reply) return reply;
      if (reply->size() < 2 + numbers) return strange(to_text(request));
      for (std::size_t i = 2; numbers > 1 && i < 2 + numbers; ++i) {
        if (!(*reply)[i].is_number()) return strange(to_text(request));
      }
      return reply;
    };
    const Result<Bottle> name = get({Value::word("name")}, 1);
    if (!name) return name.error();
    names_.push_back((*name)[2].is_text() ? (*name)[2].text : to_text((*name)[2]));
    const Result<Bottle> range = get({Value::word("llim")}, 2);
    if (!range) return range.error();
    const Result<Bottle> speed = get({Value::word("vlim")}, 2);
    if (!speed) return speed.error();
    JointLimits limits{(*range)[2].as_number() * kDegree_rad, (*range)[3].as_number() * kDegree_rad,
                       (*speed)[3].as_number() * kDegree_rad, max_torque_Nm_};
    // torque is not had everywhere
    const Result<Bottle> torque = get({Value::word("torq"), Value::word("rng")}, 2);
    if (torque && (*torque)[3].as_number() > 0) limits.max_torque_Nm = (*torque)[3].as_number();
    limits_.push_back(limits);
    modes_.push_back(std::nullopt);
    return {};
  }

  Result<std::vector<double>> ask_numbers(const char* what) const {
    const Result<Bottle> reply = ask({Value::word("get"), Value::word(what)});
    if (!reply) return reply.error();
    if (reply->size() < 3 || !(*reply)[2].is_list() || (*reply)[2].items.size() != names_.size()) {
      return strange(what);
    }
    std::vector<double> numbers;
    for (const Value& value : (*reply)[2].items) {
      if (!value.is_number()) return strange(what);
      numbers.push_back(value.as_number() * kDegree_rad);
    }
    return numbers;
  }

  static Value list_of(std::span<const int> joints) {
    Bottle list;
    for (const int joint : joints) list.push_back(Value::of(static_cast<std::int64_t>(joint)));
    return Value::list(std::move(list));
  }
  static Value list_of(std::span<const double> values, double unit) {
    Bottle list;
    for (const double value : values) list.push_back(Value::of(value / unit));
    return Value::list(std::move(list));
  }

  Status order_group(const char* word, std::span<const int> joints,
                     std::span<const double> values_rad) const {
    if (joints.empty()) return {};
    return order({Value::word("set"), Value::word(word), whole(joints.size()), list_of(joints),
                  list_of(values_rad, kDegree_rad)});
  }

  // switches those joints that are in another mode
  Status be_in(ControlMode mode, std::span<const int> joints) {
    std::vector<int> others;
    {
      const std::lock_guard lock(mutex_);
      for (const int joint : joints) {
        if (modes_[static_cast<std::size_t>(joint)] != mode) others.push_back(joint);
      }
    }
    return set_control_mode(others, mode);
  }

  Status stream(ControlMode mode, const char* word, std::span<const int> joints,
                std::span<const double> values, double unit) {
    if (Status valid = check_joint_values(axes(), joints, values); !valid) return valid;
    if (joints.empty()) return {};
    if (Status switched = be_in(mode, joints); !switched) return switched;
    Bottle head = {Value::word(word), whole(joints.size()), list_of(joints)};
    return command_->send({Value::list(std::move(head)), list_of(values, unit)});
  }

  // eleven lists, each followed by whether it is valid
  void take_state(const std::string& bytes, const std::string& envelope) {
    const Result<Decoded> decoded = decode_any(bytes, Dialect::k3);
    if (!decoded) return;
    const Bottle& state = decoded->bottle;
    const std::size_t axes = names_.size();
    const auto numbers = [&](std::size_t index, double unit) -> std::optional<std::vector<double>> {
      if (2 * index + 1 >= state.size() || !state[2 * index].is_list() ||
          !state[2 * index + 1].is_word("ok") || state[2 * index].items.size() < axes) {
        return std::nullopt;
      }
      std::vector<double> out;
      for (std::size_t i = 0; i < axes; ++i) {
        const Value& value = state[2 * index].items[i];
        out.push_back(value.is_number() ? value.as_number() * unit : 0.0);
      }
      return out;
    };
    const auto position = numbers(0, kDegree_rad);
    if (!position) return;
    const std::vector<double> zeros(axes, 0.0);
    const auto modes = numbers(9, 1.0);
    const std::lock_guard lock(mutex_);
    newest_ = JointReading{stamps_.of(envelope), *position, numbers(1, kDegree_rad).value_or(zeros),
                           numbers(2, kDegree_rad).value_or(zeros), numbers(6, 1.0).value_or(zeros)};
    if (!modes || std::chrono::steady_clock::now() - modes_set_ < kModesDelay) return;
    for (std::size_t i = 0; i < axes; ++i) {
      modes_[i] = mode_from_word(word_of_number(static_cast<std::int64_t>((*modes)[i])));
    }
  }

  const std::shared_ptr<Network> network_;
  const RemoteDevice device_;
  const double max_torque_Nm_;
  std::vector<std::string> names_;
  std::vector<JointLimits> limits_;
  mutable std::mutex mutex_;  // of the next four
  RemoteStamps stamps_;
  std::optional<JointReading> newest_;
  std::vector<std::optional<ControlMode>> modes_;
  std::chrono::steady_clock::time_point modes_set_;
  std::unique_ptr<Network::Stream> command_;
  std::unique_ptr<Network::Subscription> state_;  // last: ends before what it calls
};

}  // namespace

Result<std::unique_ptr<IControlBoard>> yarp_control_board(std::shared_ptr<Network> network,
                                                          const RemoteDevice& device, double max_torque_Nm) {
  auto board = std::make_unique<RemoteControlBoard>(std::move(network), device, max_torque_Nm);
  if (Status opened = board->open(); !opened) return opened.error();
  return std::unique_ptr<IControlBoard>(std::move(board));
}

}  // namespace nido::yarp
