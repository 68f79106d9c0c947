// Round trips through nido: two ports, or a service.
#include "bench_node.h"
#include "child.h"
#include "nido/middleware/direct_port.h"
#include "ping_pong.h"

namespace nido::bench {

namespace {

class PortAsker final : public PingPong {
 public:
  static Result<std::unique_ptr<PingPong>> make(int domain) {
    auto self = std::make_unique<PortAsker>();
    auto node = make_node("rtt_asker", domain);
    if (!node) return node.error();
    self->node_ = std::move(*node);
    auto out = self->node_->open_output<msgs::String>("/rtt/ping:o", Profile::kEvent);
    if (!out) return out.error();
    self->out_ = std::move(*out);
    auto in = self->node_->open_input<msgs::String>("/rtt/pong:i", Profile::kEvent);
    if (!in) return in.error();
    self->in_ = std::move(*in);
    if (auto status = self->in_->connect("/rtt/pong:o"); !status) return status.error();
    self->message_.data(std::string(kMessage_bytes, 'x'));
    return std::unique_ptr<PingPong>(std::move(self));
  }
  Status connect() override {
    if (in_->wait_for_sources(1, kPatience_s) && out_->wait_for_readers(1, kPatience_s)) return {};
    return Error{ErrorCode::kTimeout, "the answering node did not appear"};
  }
  bool round_trip() override {
    return out_->write(message_) && in_->wait_for_message(1.0) && in_->take().has_value();
  }

 private:
  std::unique_ptr<Node> node_;
  std::unique_ptr<Output<msgs::String>> out_;
  std::unique_ptr<Input<msgs::String>> in_;
  msgs::String message_;
};

// Answers where it is received.
Status answer_port(int domain, const std::string& /*address*/) {
  auto node = make_node("rtt_answerer", domain);
  if (!node) return node.error();
  auto out = (*node)->open_output<msgs::String>("/rtt/pong:o", Profile::kEvent);
  if (!out) return out.error();
  auto in = open_direct_input<msgs::String>(
      **node, "/rtt/ping:i", Profile::kEvent,
      [&out](const msgs::String& message, const Arrival&) { (void)(*out)->write(message); });
  if (!in) return in.error();
  if (auto status = (*in)->connect("/rtt/ping:o"); !status) return status;
  while (hear_parent()) {
  }
  return {};
}

class ServiceAsker final : public PingPong {
 public:
  static Result<std::unique_ptr<PingPong>> make(int domain) {
    auto self = std::make_unique<ServiceAsker>();
    auto node = make_node("rpc_asker", domain);
    if (!node) return node.error();
    self->node_ = std::move(*node);
    return std::unique_ptr<PingPong>(std::move(self));
  }
  Status connect() override {
    auto answer = node_->call("/rpc", text_, kPatience_s);
    return answer ? Status() : Status(answer.error());
  }
  bool round_trip() override {
    const auto answer = node_->call("/rpc", text_, 1.0);
    return answer && *answer == text_;
  }

 private:
  std::unique_ptr<Node> node_;
  const std::string text_ = std::string(kMessage_bytes, 'x');
};

Status answer_service(int domain, const std::string& /*address*/) {
  auto node = make_node("rpc_answerer", domain);
  if (!node) return node.error();
  auto service = (*node)->open_service("/rpc", [](const std::string& text) { return text; });
  if (!service) return service.error();
  while (hear_parent()) {
  }
  return {};
}

}  // namespace

PingPongKind nido_port() { return {"nido port", "rtt", "", PortAsker::make, answer_port}; }
PingPongKind nido_service() { return {"nido service", "rpc", "", ServiceAsker::make, answer_service}; }

}  // namespace nido::bench
