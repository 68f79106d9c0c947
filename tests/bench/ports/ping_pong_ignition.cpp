// Round trips through Ignition (Gazebo) Transport, where Debian's libignition-transport-dev is installed.
#include "ping_pong.h"

#ifdef NIDO_WITH_IGNITION
#include <ignition/msgs/bytes.pb.h>

#include <chrono>
#include <condition_variable>
#include <ignition/transport/Node.hh>
#include <mutex>

#include "child.h"

namespace nido::bench {

namespace {

namespace transport = ignition::transport;
using Message = ignition::msgs::Bytes;

// no other process of this machine takes part
transport::NodeOptions own_partition(int domain) {
  transport::NodeOptions options;
  options.SetPartition("nido_bench_" + std::to_string(domain));
  return options;
}

class Asker final : public PingPong {
 public:
  explicit Asker(int domain) : node_(own_partition(domain)), out_(node_.Advertise<Message>("/bench/ping")) {
    message_.set_data(std::string(kMessage_bytes, 'x'));
    std::function<void(const Message&)> note = [this](const Message&) {
      {
        const std::lock_guard lock(mutex_);
        ++got_;
      }
      changed_.notify_one();
    };
    node_.Subscribe("/bench/pong", note);
  }
  static Result<std::unique_ptr<PingPong>> make(int domain) {
    return std::unique_ptr<PingPong>(std::make_unique<Asker>(domain));
  }
  Status connect() override {
    for (int i = 0; i < 100; ++i) {
      if (ask(0.2)) {
        return {};
      }
    }
    return Error{ErrorCode::kTimeout, "the answering Ignition node did not appear"};
  }
  bool round_trip() override { return ask(1.0); }

 private:
  bool ask(double patience_s) {
    std::unique_lock lock(mutex_);
    const long seen = got_;
    lock.unlock();
    out_.Publish(message_);
    lock.lock();
    return changed_.wait_for(lock, std::chrono::duration<double>(patience_s), [&] { return got_ != seen; });
  }
  transport::Node node_;
  transport::Node::Publisher out_;
  Message message_;
  std::mutex mutex_;
  std::condition_variable changed_;
  long got_ = 0;
};

Status answer(int domain, const std::string& /*address*/) {
  transport::Node node(own_partition(domain));
  auto out = node.Advertise<Message>("/bench/pong");
  std::function<void(const Message&)> echo = [&](const Message& message) { out.Publish(message); };
  node.Subscribe("/bench/ping", echo);
  while (hear_parent()) {
  }
  return {};
}

}  // namespace

PingPongKind ignition_transport() { return {"Ignition Transport", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench

#else

namespace nido::bench {

PingPongKind ignition_transport() {
  return {
      "Ignition Transport", "rtt", "not built in: package libignition-transport-dev was not there", {}, {}};
}

}  // namespace nido::bench

#endif
