#include "nido/wrappers/task_wrappers.h"

#include <utility>

#include "nido/textproto/task_text.h"

namespace nido {
namespace {

class ServiceServer final : public IServer {
 public:
  explicit ServiceServer(std::unique_ptr<Node::Service> service) : service_(std::move(service)) {}
  Status publish(std::int64_t) override { return {}; }

 private:
  std::unique_ptr<Node::Service> service_;
};

template <class Reply>
Result<std::unique_ptr<IServer>> serve(Node& node, const std::string& stem, Reply reply) {
  auto service = node.open_service(stem + "/rpc:i", std::move(reply));
  if (!service) return service.error();
  return std::unique_ptr<IServer>(std::make_unique<ServiceServer>(std::move(*service)));
}

AskLine asker(Node& node, const ClientOptions& options) {
  return [&node, name = options.remote + "/rpc:i", timeout_s = options.timeout_s](const std::string& line) {
    return node.call(name, line, timeout_s);
  };
}

}  // namespace

Result<std::unique_ptr<IServer>> serve_cartesian(Node& node, const std::string& stem,
                                                 ICartesianControl& hand) {
  return serve(node, stem, [&hand](const std::string& line) { return cartesian_reply(hand, line); });
}
Result<std::unique_ptr<IServer>> serve_gaze(Node& node, const std::string& stem, IGazeControl& gaze) {
  return serve(node, stem, [&gaze](const std::string& line) { return gaze_reply(gaze, line); });
}
Result<std::unique_ptr<IServer>> serve_frames(Node& node, const std::string& stem, IFrameTransforms& frames) {
  return serve(node, stem, [&frames](const std::string& line) { return frames_reply(frames, line); });
}

Result<std::unique_ptr<ICartesianControl>> cartesian_client(Node& node, const ClientOptions& options) {
  std::unique_ptr<ICartesianControl> client = asked_cartesian(asker(node, options));
  const Result<CartesianState> there = client->state();
  if (!there) return there.error();
  return client;
}
Result<std::unique_ptr<IGazeControl>> gaze_client(Node& node, const ClientOptions& options) {
  std::unique_ptr<IGazeControl> client = asked_gaze(asker(node, options));
  const Result<GazeState> there = client->state();
  if (!there) return there.error();
  return client;
}
Result<std::unique_ptr<IFrameTransforms>> frames_client(Node& node, const ClientOptions& options) {
  std::unique_ptr<IFrameTransforms> client = asked_frames(asker(node, options));
  const Result<std::vector<Frame>> there = client->frames();
  if (!there) return there.error();
  return client;
}

}  // namespace nido
