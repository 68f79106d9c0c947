// The contracts of the interfaces, on devices that are seen through the YARP protocol: device, server, DDS,
// gateway, sockets, and a device again.

#include <future>

#include "control_board_contract.h"
#include "gateway_link.h"
#include "nido/wrappers/servers.h"
#include "sensor_rigs.h"
#include "simulated_sensor_rigs.h"

namespace nido::test {
namespace {

void must_hold(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

// Opens a far side while time passes on this one.
template <class Open, class Advance>
auto open_meanwhile(const Open& open, const Advance& advance) {
  auto opened = std::async(std::launch::async, open);
  while (opened.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) advance();
  return required(opened.get());
}

// The board of a family, seen from the other side.
template <class Local>
class YarpBoardRig final : public ControlBoardRig {
 public:
  YarpBoardRig() {
    // time runs as fast as messages travel, so that a late one must not count as a missing one
    LimitOptions patient;
    patient.command_timeout_ns = 1'000'000'000'000;
    local_.put_limits(patient);
    server_ = required(serve_control_board(link_.server(), link_.stem("arm"), local_.board(), kPeriod_ns));
    must_hold(server_->publish(local_.clock().now_ns()));
    for (const char* port : {"/stateExt:o", "/rpc:i", "/command:i"}) link_.wait_for(link_.stem("arm") + port);
    client_ =
        open_meanwhile([this] { return yarp::yarp_control_board(link_.network(), link_.remote("arm"), 1.0); },
                       [this] { step(); });
    advance();
    // the stream flows from its first message on, which finds its way while time passes
    const int joint[] = {free_joint()};
    const auto index = static_cast<std::size_t>(joint[0]);
    const double start_rad = client_->read_joints()->position_rad[index];
    const double target[] = {start_rad + 0.05};
    while (std::abs(client_->read_joints()->position_rad[index] - target[0]) > 0.02) {
      must_hold(client_->set_positions(joint, target));
      advance();
    }
  }
  IControlBoard& board() override { return *client_; }
  void advance() override {
    step();
    const std::int64_t now_ns = local_.clock().now_ns();
    wait_until([&] {
      const Result<JointReading> reading = client_->read_joints();
      return reading.ok() && reading->stamp_ns == now_ns;
    });
  }
  int free_joint() override { return local_.free_joint(); }
  double tolerance_rad() override { return local_.tolerance_rad(); }
  bool keeps_order() override { return false; }

 private:
  void step() {
    must_hold(server_->take_commands());
    local_.advance();
    must_hold(server_->publish(local_.clock().now_ns()));
  }
  GatewayLink link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<IControlBoard> client_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverYarp, ControlBoardContract,
                         testing::Values([] { return std::make_unique<YarpBoardRig<FakeRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverYarp, ControlBoardContract,
                         testing::Values([] { return std::make_unique<YarpBoardRig<SimulatedRig>>(); }));

template <class Local>
class YarpCameraRig final : public CameraRig {
 public:
  YarpCameraRig() {
    server_ =
        required(serve_camera(link_.server(), link_.stem("cam"), local_.camera(),
                              {.period_ns = kPeriod_ns * 3, .latency_ns = kPeriod_ns, .frame_id = "eye"}));
    advance();
    for (const char* port : {"", "/rpc"}) link_.wait_for(link_.stem("cam") + port);
    client_ = open_meanwhile(
        [this] { return yarp::yarp_camera(link_.network(), link_.remote("cam"), CameraInfo{}); },
        [this] { advance(); });
  }
  ICamera& camera() override { return *client_; }
  void advance() override {
    local_.advance();
    must_hold(server_->publish(local_.clock().now_ns()));
  }
  bool eventually(const std::function<bool()>& condition) override { return patiently(condition); }

 private:
  GatewayLink link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<ICamera> client_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverYarp, CameraContract,
                         testing::Values([] { return std::make_unique<YarpCameraRig<FakeCameraRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverYarp, CameraContract, testing::Values([] {
                           return std::make_unique<YarpCameraRig<SimulatedCameraRig>>();
                         }));

template <class Local>
class YarpTouchRig final : public TouchRig {
 public:
  YarpTouchRig() {
    server_ =
        required(serve_touch(link_.server(), link_.stem("left_hand"), local_.touch(), {kPeriod_ns, "hand"}));
    must_hold(server_->publish(local_.clock().now_ns()));
    link_.wait_for(link_.stem("left_hand_comp"));
    client_ = open_meanwhile(
        [this] {
          return yarp::yarp_touch(link_.network(), link_.remote("left_hand_comp"), {20, 1.0});
        },
        [this] { step(); });
    advance();
  }
  ITouch& touch() override { return *client_; }
  void advance() override {
    step();
    wait_until([&] {
      const Result<TouchReading> reading = client_->read_touch();
      return reading.ok() && reading->stamp_ns == local_.clock().now_ns();
    });
  }
  bool press(int pad, bool pressed) override { return local_.press(pad, pressed); }

 private:
  void step() {
    local_.advance();
    must_hold(server_->publish(local_.clock().now_ns()));
  }
  GatewayLink link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<ITouch> client_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverYarp, TouchContract,
                         testing::Values([] { return std::make_unique<YarpTouchRig<FakeTouchRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverYarp, TouchContract,
                         testing::Values([] { return std::make_unique<YarpTouchRig<SimulatedTouchRig>>(); }));

TEST(WorldOverYarp, LinesAreAnsweredFromTheOtherSide) {
  GatewayLink link;
  FakeWorld world;
  const auto server = required(serve_world(link.server(), link.stem("world"), world));
  link.wait_for(link.stem("world"));
  const auto client = required(yarp::yarp_world(link.network(), link.remote("world")));
  EXPECT_EQ(client->command("world num box"), world.command("world num box"));
  EXPECT_EQ(client->command("dance"), world.command("dance"));
}

TEST(YarpNetwork, SaysWhatIsNotThere) {
  yarp::NetworkOptions options;
  options.names_port = 9;  // nobody serves names there
  const auto network = yarp::Network::open(options);
  ASSERT_FALSE(network.ok());
  EXPECT_EQ(network.error().code, ErrorCode::kNotFound);
  GatewayLink link;
  const auto board = yarp::yarp_control_board(link.network(), link.remote("nobody"), 1.0);
  ASSERT_FALSE(board.ok());
  EXPECT_NE(board.error().message.find("nobody"), std::string::npos) << board.error().message;
}

}  // namespace
}  // namespace nido::test
