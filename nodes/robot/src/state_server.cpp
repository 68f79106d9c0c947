#include "src/state_server.h"

#include <mutex>
#include <utility>

#include "nido/middleware/typed_port.h"

namespace nido {
namespace {

class StateServer final : public IServer {
 public:
  explicit StateServer(const sim::SimulatedRobot& robot) : robot_(robot) {}

  Status open(Node& node, const std::string& port) {
    auto output = node.open_output<msgs::String>(port + ":o", Profile::kEvent);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t) override {
    if (output_->reader_count() == 0) return {};
    msgs::String message;
    {
      const std::lock_guard lock(robot_.mutex());
      message.data(sim::hash_word(robot_.simulation().complete_hash()));
    }
    return output_->write(message);
  }

 private:
  const sim::SimulatedRobot& robot_;
  std::unique_ptr<Output<msgs::String>> output_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_state_hash(Node& node, const std::string& port,
                                                  const sim::SimulatedRobot& robot) {
  auto server = std::make_unique<StateServer>(robot);
  if (Status opened = server->open(node, port); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
