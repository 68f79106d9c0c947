#include <utility>

#include "nido/wrappers/clients.h"
#include "nido/wrappers/servers.h"

namespace nido {
namespace {

class WorldServer final : public IServer {
 public:
  explicit WorldServer(std::unique_ptr<Node::Service> service) : service_(std::move(service)) {}
  Status publish(std::int64_t) override { return {}; }

 private:
  std::unique_ptr<Node::Service> service_;
};

class WorldClient final : public IWorld {
 public:
  WorldClient(Node& node, ClientOptions options) : node_(node), options_(std::move(options)) {}
  std::string command(const std::string& line) override {
    const Result<std::string> answer = node_.call(options_.remote, line, options_.timeout_s);
    return answer ? *answer : "[fail] \"" + answer.error().message + "\"";
  }

 private:
  Node& node_;
  const ClientOptions options_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_world(Node& node, const std::string& stem, IWorld& world) {
  auto service = node.open_service(stem, [&world](const std::string& line) { return world.command(line); });
  if (!service) return service.error();
  return std::unique_ptr<IServer>(std::make_unique<WorldServer>(std::move(*service)));
}

Result<std::unique_ptr<IWorld>> world_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<WorldClient>(node, options);
  // an unknown word is answered too: whoever answers is there
  const Result<std::string> answer = node.call(options.remote, "world num box", options.timeout_s);
  if (!answer) return answer.error();
  return std::unique_ptr<IWorld>(std::move(client));
}

}  // namespace nido
