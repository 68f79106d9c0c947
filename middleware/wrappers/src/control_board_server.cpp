#include <fmt/format.h>

#include <utility>
#include <vector>

#include "nido/middleware/typed_port.h"
#include "nido/textproto/control_board_text.h"
#include "nido/wrappers/servers.h"
#include "ordered_board.h"
#include "stamps.h"

namespace nido {
namespace {

// commands that arrive between two control periods
constexpr std::size_t kCommandsKept = 256;

class ControlBoardServer final : public IServer {
 public:
  ControlBoardServer(Node& node, std::string stem, IControlBoard& board, std::int64_t period_ns)
      : node_(node), stem_(std::move(stem)), board_(board), text_(board_), due_(period_ns) {}

  Status open() {
    for (int joint = 0; joint < board_.axes(); ++joint) {
      Result<std::string> name = board_.axis_name(joint);
      if (!name) return name.error();
      message_.name().push_back(std::move(*name));
    }
    auto state = node_.open_output<msgs::JointState>(stem_ + "/state:o", Profile::kState);
    if (!state) return state.error();
    state_ = std::move(*state);
    auto command =
        node_.open_input<msgs::JointCommand>(stem_ + "/command:i", Profile::kCommand, kCommandsKept);
    if (!command) return command.error();
    command_ = std::move(*command);
    auto service =
        node_.open_service(stem_ + "/rpc:i", [this](const std::string& line) { return text_.reply(line); });
    if (!service) return service.error();
    service_ = std::move(*service);
    return {};
  }

  Status take_commands() override {
    while (const auto received = command_->take_received()) {
      const msgs::JointCommand& command = received->message;
      const std::vector<int> joints(command.joint().begin(), command.joint().end());
      if (const Status applied =
              board_.apply_streamed(received->source_time, command.mode(), joints, command.value());
          !applied) {
        warn(fmt::format("{}/command:i: a command was refused: {}", stem_, applied.error().message));
      }
    }
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    Result<JointReading> reading = board_.read_joints();
    if (!reading) return Error{reading.error().code, stem_ + ": " + reading.error().message};
    message_.header(header(reading->stamp_ns, ""));
    message_.position(std::move(reading->position_rad));
    message_.velocity(std::move(reading->velocity_rad_s));
    message_.effort(std::move(reading->torque_Nm));
    return state_->write(message_);
  }

 private:
  // a stream of bad commands makes one line a second, not a hundred
  void warn(const std::string& text) {
    const std::int64_t now_ns = node_.now().ns;
    if (refused_ > 0 && now_ns - warned_ns_ < 1'000'000'000) {
      ++refused_;
      return;
    }
    node_.log_warning(refused_ > 1 ? fmt::format("{} (and {} before)", text, refused_ - 1) : text);
    warned_ns_ = now_ns;
    refused_ = 1;
  }

  Node& node_;
  const std::string stem_;
  OrderedBoard board_;
  ControlBoardText text_;
  Due due_;
  msgs::JointState message_;
  std::unique_ptr<Output<msgs::JointState>> state_;
  std::unique_ptr<Input<msgs::JointCommand>> command_;
  std::unique_ptr<Node::Service> service_;  // last: ends before what its handler uses
  std::int64_t warned_ns_ = 0;
  int refused_ = 0;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_control_board(Node& node, const std::string& stem,
                                                     IControlBoard& board, std::int64_t period_ns) {
  auto server = std::make_unique<ControlBoardServer>(node, stem, board, period_ns);
  if (Status opened = server->open(); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
