// Round trips through ROS 1, where Debian's libroscpp-dev, libstd-msgs-dev and python3-rosmaster are
// installed.
#include "ping_pong.h"

#ifdef NIDO_WITH_ROSCPP
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <chrono>
#include <thread>

#include "child.h"
#include "free_port.h"
#include "server.h"

namespace nido::bench {

namespace {

void join(const std::string& master, const std::string& name) {
  ros::init(ros::M_string{{"__master", master}, {"__ip", "127.0.0.1"}}, name,
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
}

class Asker final : public PingPong {
 public:
  Asker() : master_(free_tcp_port()), server_({"rosmaster", "--core", "-p", std::to_string(master_)}) {}
  ~Asker() override { ros::shutdown(); }
  static Result<std::unique_ptr<PingPong>> make(int /*domain*/) {
    auto self = std::make_unique<Asker>();
    join(self->address(), "bench_asker");
    for (int i = 0; i < 1000 && !ros::master::check(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if (!ros::master::check()) {
      return Error{ErrorCode::kUnsupported, "rosmaster does not start"};
    }
    self->node_ = std::make_unique<ros::NodeHandle>();
    self->out_ = self->node_->advertise<std_msgs::String>("/bench/ping", 10);
    self->in_ = self->node_->subscribe<std_msgs::String>(
        "/bench/pong", 10, [raw = self.get()](const std_msgs::String::ConstPtr&) { ++raw->got_; },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
    self->message_.data.assign(kMessage_bytes, 'x');
    return std::unique_ptr<PingPong>(std::move(self));
  }
  std::string address() const override { return "http://127.0.0.1:" + std::to_string(master_); }
  Status connect() override {
    for (int i = 0; i < 2000; ++i) {
      if (out_.getNumSubscribers() > 0 && in_.getNumPublishers() > 0 && round_trip()) {
        return {};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Error{ErrorCode::kTimeout, "the answering ROS node did not appear"};
  }
  bool round_trip() override {
    const long seen = got_;
    out_.publish(message_);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    while (got_ == seen && std::chrono::steady_clock::now() < deadline) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
    }
    return got_ != seen;
  }

 private:
  const int master_;
  const Server server_;
  std::unique_ptr<ros::NodeHandle> node_;
  ros::Publisher out_;
  ros::Subscriber in_;
  std_msgs::String message_;
  long got_ = 0;
};

Status answer(int /*domain*/, const std::string& master) {
  join(master, "bench_answerer");
  ros::NodeHandle node;
  ros::Publisher out = node.advertise<std_msgs::String>("/bench/pong", 10);
  const ros::Subscriber in = node.subscribe<std_msgs::String>(
      "/bench/ping", 10, [&](const std_msgs::String::ConstPtr& message) { out.publish(message); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  end_with_parent();
  ros::spin();
  return {};
}

}  // namespace

PingPongKind ros_1() { return {"ROS 1 (roscpp)", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench

#else

namespace nido::bench {

PingPongKind ros_1() {
  return {"ROS 1 (roscpp)",
          "rtt",
          "not built in: packages libroscpp-dev, libstd-msgs-dev, python3-rosmaster were not there",
          {},
          {}};
}

}  // namespace nido::bench

#endif
