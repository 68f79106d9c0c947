#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "client_connection.h"
#include "nido/interfaces/check_joints.h"
#include "nido/middleware/typed_port.h"
#include "nido/textproto/asked_board.h"
#include "nido/textproto/control_board_text.h"
#include "nido/textproto/text_value.h"
#include "nido/wrappers/clients.h"
#include "stamps.h"

namespace nido {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;

// "(0 3 5)"
std::string joint_list(std::span<const int> joints) { return fmt::format("({})", fmt::join(joints, " ")); }

// "(10.0 20.5)", in the unit of the other side
std::string value_list(std::span<const double> values, double unit) {
  std::string list = "(";
  for (std::size_t i = 0; i < values.size(); ++i)
    list += (i > 0 ? " " : "") + format_number(values[i] / unit);
  return list + ")";
}

class ControlBoardClient final : public AskedBoard {
 public:
  ControlBoardClient(Node& node, ClientOptions options) : node_(node), options_(std::move(options)) {}

  Status open() {
    if (Status told = ask_what_it_is(); !told) return told;
    auto state = open_connected<msgs::JointState>(node_, options_, "/state", Profile::kState, 4);
    if (!state) return state.error();
    state_ = std::move(*state);
    auto command = node_.open_output<msgs::JointCommand>(options_.local + "/command:o", Profile::kCommand);
    if (!command) return command.error();
    command_ = std::move(*command);
    if (Status connected =
            connect_output(node_, command_->name(), options_.remote + "/command:i", options_.timeout_s);
        !connected) {
      return connected;
    }
    if (!command_->wait_for_readers(1, options_.timeout_s)) {
      return Error{ErrorCode::kNotFound,
                   options_.remote + "/command:i does not take from " + command_->name()};
    }
    return {};
  }

  int axes() const override { return static_cast<int>(names_.size()); }

  Result<std::string> axis_name(int joint) const override {
    const int wanted[] = {joint};
    if (Status valid = check_joints(axes(), wanted); !valid) return valid.error();
    return names_[static_cast<std::size_t>(joint)];
  }

  Result<JointReading> read_joints() const override {
    const std::lock_guard lock(mutex_);
    if (std::optional<msgs::JointState> message = state_->take_latest()) {
      const std::size_t axes = names_.size();
      if (message->position().size() != axes || message->velocity().size() != axes ||
          message->effort().size() != axes) {
        return Error{ErrorCode::kFailed, fmt::format("{}/state:o: expected {} joints, got {}",
                                                     options_.remote, axes, message->position().size())};
      }
      newest_ = JointReading{to_ns(message->header().stamp()), std::move(message->position()),
                             std::move(message->velocity()), std::vector<double>(axes, 0.0),
                             std::move(message->effort())};
    }
    if (!newest_) return Error{ErrorCode::kTimeout, options_.remote + "/state:o: nothing has come yet"};
    return *newest_;
  }

  Result<std::vector<JointLimits>> limits() const override { return limits_; }

  Result<std::vector<ControlMode>> control_modes() const override {
    const Result<std::vector<TextValue>> words = ask_list("get icmd cmds");
    if (!words) return words.error();
    std::vector<ControlMode> modes;
    for (const TextValue& word : *words) {
      const std::optional<ControlMode> mode = word.text() ? mode_from_word(*word.text()) : std::nullopt;
      if (!mode) return strange("get icmd cmds");
      modes.push_back(*mode);
    }
    return modes;
  }

  Status set_control_mode(std::span<const int> joints, ControlMode mode) override {
    if (Status valid = check_joints(axes(), joints); !valid) return valid;
    if (mode == ControlMode::kFault)
      return Error{ErrorCode::kInvalidArgument, "mode fault cannot be asked for"};
    if (joints.empty()) return {};
    std::string modes;
    for (std::size_t i = 0; i < joints.size(); ++i) modes += (i > 0 ? " " : "") + mode_word(mode);
    return order(fmt::format("set icmd cmog {} {} ({})", joints.size(), joint_list(joints), modes));
  }

  Status move_to(std::span<const int> joints, std::span<const double> target_rad) override {
    if (Status valid = check_joint_values(axes(), joints, target_rad); !valid) return valid;
    return order_group("posg", joints, target_rad);
  }
  Result<std::vector<double>> target_positions() const override { return ask_numbers("get poss"); }

  Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) override {
    if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
    return order_group("velg", joints, speed_rad_s);
  }
  Result<std::vector<double>> reference_speeds() const override { return ask_numbers("get vels"); }

  Status set_reference_accelerations(std::span<const int> joints,
                                     std::span<const double> acceleration_rad_s2) override {
    if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
    return order_group("accg", joints, acceleration_rad_s2);
  }
  Result<std::vector<double>> reference_accelerations() const override { return ask_numbers("get accs"); }

  Result<std::vector<bool>> motion_done() const override {
    const Result<std::vector<TextValue>> words = ask_list("get donl");
    if (!words) return words.error();
    std::vector<bool> done;
    for (const TextValue& word : *words) done.push_back(word.is_number() && word.number() != 0);
    return done;
  }

  Status stop(std::span<const int> joints) override {
    if (Status valid = check_joints(axes(), joints); !valid) return valid;
    if (joints.empty()) return {};
    return order(fmt::format("set stog {} {}", joints.size(), joint_list(joints)));
  }

  Status set_positions(std::span<const int> joints, std::span<const double> target_rad) override {
    return stream(ControlMode::kDirect, joints, target_rad);
  }
  Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) override {
    return stream(ControlMode::kVelocity, joints, velocity_rad_s);
  }
  Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) override {
    return stream(ControlMode::kTorque, joints, torque_Nm);
  }
  Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) override {
    return stream(ControlMode::kPwm, joints, duty_cycle);
  }

 private:
  // names and limits, which never change
  Status ask_what_it_is() {
    const Result<std::vector<TextValue>> joints = ask_list("get info");
    if (!joints) return joints.error();
    for (const TextValue& joint : *joints) {
      const TextValue::List* entry = joint.list();
      const bool is_well_formed = entry != nullptr && entry->size() == 5 && (*entry)[0].text() != nullptr &&
                                  std::all_of(entry->begin() + 1, entry->end(),
                                              [](const TextValue& value) { return value.is_number(); });
      if (!is_well_formed) return strange("get info");
      names_.push_back(*(*entry)[0].text());
      limits_.push_back({(*entry)[1].number() * kDegree_rad, (*entry)[2].number() * kDegree_rad,
                         (*entry)[3].number() * kDegree_rad, (*entry)[4].number()});
    }
    return names_.empty() ? Status(strange("get info")) : Status();
  }

  Error strange(const std::string& line) const {
    return Error{ErrorCode::kFailed,
                 fmt::format("{}/rpc:i gave an answer to '{}' that is not understood: is it a "
                             "control board?",
                             options_.remote, line)};
  }

  // the words of an answer that is not a refusal
  Result<std::vector<TextValue>> ask(const std::string& line) const {
    const Result<std::string> answer = node_.call(options_.remote + "/rpc:i", line, options_.timeout_s);
    if (!answer) return answer.error();
    Result<std::vector<TextValue>> words = parse_text(*answer);
    if (!words || words->empty()) return strange(line);
    if (words->front().is_word("fail") || words->front().is_word("nak")) {
      const std::string* reason = words->size() > 1 ? (*words)[1].text() : nullptr;
      return Error{ErrorCode::kFailed,
                   options_.remote + ": " + (reason != nullptr ? *reason : "refused: " + line)};
    }
    return words;
  }

  Result<std::vector<TextValue>> ask_line(const std::string& line) const override { return ask(line); }

  // the list in `[is] WHAT (...) ...`
  Result<std::vector<TextValue>> ask_list(const std::string& line) const {
    Result<std::vector<TextValue>> words = ask(line);
    if (!words) return words.error();
    const TextValue::List* list = words->size() > 2 ? (*words)[2].list() : nullptr;
    if (list == nullptr || (!names_.empty() && list->size() != names_.size())) return strange(line);
    return *list;
  }

  Result<std::vector<double>> ask_numbers(const std::string& line) const {
    const Result<std::vector<TextValue>> words = ask_list(line);
    if (!words) return words.error();
    std::vector<double> numbers;
    for (const TextValue& word : *words) {
      if (!word.is_number()) return strange(line);
      numbers.push_back(word.number() * kDegree_rad);
    }
    return numbers;
  }

  Status order(const std::string& line) const {
    const Result<std::vector<TextValue>> words = ask(line);
    if (!words) return words.error();
    return {};
  }

  Status order_group(const std::string& word, std::span<const int> joints,
                     std::span<const double> values_rad) const {
    if (joints.empty()) return {};
    return order(fmt::format("set {} {} {} {}", word, joints.size(), joint_list(joints),
                             value_list(values_rad, kDegree_rad)));
  }

  Status stream(ControlMode mode, std::span<const int> joints, std::span<const double> values) {
    if (Status valid = check_joint_values(axes(), joints, values); !valid) return valid;
    if (joints.empty()) return {};
    msgs::JointCommand message;
    message.header(header(node_.now().ns, ""));
    message.mode(std::string(to_string(mode)));
    message.joint().assign(joints.begin(), joints.end());
    message.value().assign(values.begin(), values.end());
    const std::lock_guard lock(mutex_);
    return command_->write(message);
  }

  Node& node_;
  const ClientOptions options_;
  std::vector<std::string> names_;
  std::vector<JointLimits> limits_;
  mutable std::mutex mutex_;  // of what follows
  std::unique_ptr<Input<msgs::JointState>> state_;
  std::unique_ptr<Output<msgs::JointCommand>> command_;
  mutable std::optional<JointReading> newest_;
};

}  // namespace

Result<std::unique_ptr<IControlBoard>> control_board_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<ControlBoardClient>(node, options);
  if (Status opened = client->open(); !opened) return opened.error();
  return std::unique_ptr<IControlBoard>(std::move(client));
}

}  // namespace nido
