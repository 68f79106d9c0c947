// The contracts, run on devices that are seen through the network: server and client in one process, over
// DDS.

#include <unistd.h>

#include <chrono>
#include <thread>

#include "audio/room_speaker.h"
#include "control_board_contract.h"
#include "nido/wrappers/clients.h"
#include "nido/wrappers/servers.h"
#include "node_link.h"
#include "sensor_rigs.h"
#include "simulated_sensor_rigs.h"
#include "speaker_contract.h"

namespace nido::test {
namespace {

constexpr int kDomain = 42;

void must_hold(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

// Two nodes with names of their own, so that tests may run beside each other.
class Link {
 public:
  Node& server() { return *server_; }
  Node& client() { return *client_; }
  std::string remote(const std::string& what) const { return "/t" + id_ + "/" + what; }
  ClientOptions options(const std::string& what) const {
    return {remote(what), "/c" + id_ + "/" + what, kPatience_s};
  }

 private:
  const std::string id_ = std::to_string(getpid());
  std::unique_ptr<Node> server_ = make_test_node("server" + id_, kDomain);
  std::unique_ptr<Node> client_ = make_test_node("client" + id_, kDomain);
};

// The rig of a family, but its board is the client's.
template <class Local>
class RemoteRig final : public ControlBoardRig {
 public:
  RemoteRig() {
    // time runs as fast as messages travel, so that a late one must not count as a missing one
    LimitOptions patient;
    patient.command_timeout_ns = 1'000'000'000'000;
    local_.put_limits(patient);
    server_ = required(serve_control_board(link_.server(), link_.remote("arm"), local_.board(), kPeriod_ns));
    client_ = required(control_board_client(link_.client(), link_.options("arm")));
    advance();
  }
  IControlBoard& board() override { return *client_; }
  void advance() override {
    must_hold(server_->take_commands());
    local_.advance();
    const std::int64_t now_ns = local_.clock().now_ns();
    must_hold(server_->publish(now_ns));
    wait_until([&] {
      const Result<JointReading> reading = client_->read_joints();
      return reading.ok() && reading->stamp_ns == now_ns;
    });
  }
  int free_joint() override { return local_.free_joint(); }
  double tolerance_rad() override { return local_.tolerance_rad(); }

 private:
  Link link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<IControlBoard> client_;
};

INSTANTIATE_TEST_SUITE_P(FakeOverDds, ControlBoardContract,
                         testing::Values([] { return std::make_unique<RemoteRig<FakeRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverDds, ControlBoardContract,
                         testing::Values([] { return std::make_unique<RemoteRig<SimulatedRig>>(); }));

// The camera of a family, served.
template <class Local>
class RemoteCameraRig final : public CameraRig {
 public:
  RemoteCameraRig() {
    server_ =
        required(serve_camera(link_.server(), link_.remote("cam"), local_.camera(),
                              {.period_ns = kPeriod_ns * 3, .latency_ns = kPeriod_ns, .frame_id = "eye"}));
    client_ = required(camera_client(link_.client(), link_.options("cam")));
    // pictures may be lost, by design: time goes on until the first has come
    wait_until([&] {
      advance();
      Image image;
      return client_->grab(image).ok() && client_->info().ok();
    });
  }
  ICamera& camera() override { return *client_; }
  void advance() override {
    local_.advance();
    must_hold(server_->publish(local_.clock().now_ns()));
  }
  bool eventually(const std::function<bool()>& condition) override { return patiently(condition); }

 private:
  Link link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<ICamera> client_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverDds, CameraContract,
                         testing::Values([] { return std::make_unique<RemoteCameraRig<FakeCameraRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverDds, CameraContract, testing::Values([] {
                           return std::make_unique<RemoteCameraRig<SimulatedCameraRig>>();
                         }));

// Counts what a speaker took.
class CountedSpeaker final : public IAudioRender {
 public:
  explicit CountedSpeaker(IAudioRender& inner) : inner_(inner) {}
  Status start() override { return inner_.start(); }
  Status stop() override { return inner_.stop(); }
  Status render(const Sound& sound) override {
    const Status rendered = inner_.render(sound);
    if (rendered.ok()) ++taken_;
    return rendered;
  }
  [[nodiscard]] int taken() const { return taken_; }

 private:
  IAudioRender& inner_;
  int taken_ = 0;
};

class RemoteSpeakerRig final : public SpeakerRig {
 public:
  RemoteSpeakerRig() {
    server_ = required(serve_speaker(link_.server(), link_.remote("speaker"), far_));
    client_ = required(speaker_client(link_.client(), link_.options("speaker")));
    near_ = std::make_unique<CountedSpeaker>(*client_);
  }
  IAudioRender& speaker() override { return *near_; }
  void advance() override {
    wait_until([this] {
      if (!server_->publish(clock_.now_ns())) throw std::runtime_error("the server failed");
      return far_.taken() == near_->taken();
    });
    clock_.advance_ns(kPeriod_ns);
  }
  double waiting_s() override { return device_.waiting_s(); }

 private:
  ManualClock clock_;
  RoomSpeaker device_{"", 16000, clock_};
  CountedSpeaker far_{device_};
  Link link_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<IAudioRender> client_;
  std::unique_ptr<CountedSpeaker> near_;
};
INSTANTIATE_TEST_SUITE_P(RoomOverDds, SpeakerContract,
                         testing::Values([] { return std::make_unique<RemoteSpeakerRig>(); }));

// The hand of a family, served.
template <class Local>
class RemoteTouchRig final : public TouchRig {
 public:
  RemoteTouchRig() {
    server_ =
        required(serve_touch(link_.server(), link_.remote("skin"), local_.touch(), {kPeriod_ns, "hand"}));
    client_ = required(touch_client(link_.client(), link_.options("skin")));
    advance();
  }
  ITouch& touch() override { return *client_; }
  void advance() override {
    local_.advance();
    const std::int64_t now_ns = local_.clock().now_ns();
    must_hold(server_->publish(now_ns));
    wait_until([&] {
      const Result<TouchReading> reading = client_->read_touch();
      return reading.ok() && reading->stamp_ns == now_ns;
    });
  }
  bool press(int pad, bool pressed) override { return local_.press(pad, pressed); }

 private:
  Link link_;
  Local local_;
  std::unique_ptr<IServer> server_;
  std::unique_ptr<ITouch> client_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverDds, TouchContract,
                         testing::Values([] { return std::make_unique<RemoteTouchRig<FakeTouchRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverDds, TouchContract, testing::Values([] {
                           return std::make_unique<RemoteTouchRig<SimulatedTouchRig>>();
                         }));

TEST(WorldOverDds, LinesAreAnsweredFromTheOtherSide) {
  Link link;
  FakeWorld world;
  const auto server = required(serve_world(link.server(), link.remote("world"), world));
  const auto client = required(world_client(link.client(), link.options("world")));
  EXPECT_EQ(client->command("world num box"), world.command("world num box"));
  EXPECT_EQ(client->command("dance"), world.command("dance"));
}

TEST(ClientOfNobody, SaysWhichPortIsMissing) {
  Link link;
  ClientOptions options = link.options("nobody");
  options.timeout_s = 0.3;
  const auto board = control_board_client(link.client(), options);
  ASSERT_FALSE(board.ok());
  EXPECT_EQ(board.error().code, ErrorCode::kNotFound);
  EXPECT_NE(board.error().message.find(link.remote("nobody")), std::string::npos) << board.error().message;
  const auto camera = camera_client(link.client(), options);
  ASSERT_FALSE(camera.ok());
  EXPECT_NE(camera.error().message.find(link.remote("nobody")), std::string::npos) << camera.error().message;
}

TEST(ControlBoardOverDds, AFailureOfTheDeviceComesWithItsReason) {
  Link link;
  FakeControlBoard fake(three_joints());
  const auto server = required(serve_control_board(link.server(), link.remote("arm"), fake, kPeriod_ns));
  const auto client = required(control_board_client(link.client(), link.options("arm")));
  fake.set_failures({.commands = Error{ErrorCode::kFailed, "the \"motor\" is hot"}});
  const int joint[] = {0};
  const double target[] = {0.1};
  const Status refused = client->move_to(joint, target);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("the \"motor\" is hot"), std::string::npos)
      << refused.error().message;
}

}  // namespace
}  // namespace nido::test
