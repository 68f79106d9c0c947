// Messages through another vendor's DDS and back (cyclone_peer.c): what comes back is what was sent, field
// for field.
#include <cstdlib>
#include <numeric>

#include "child_process.h"
#include "test_node.h"

namespace nido::testing {

namespace {

// Cyclone on the loopback interface only, as nido is
constexpr const char* kCycloneSettings =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>"
    "</Interfaces><AllowMulticast>true</AllowMulticast></General></Domain></CycloneDDS>";

class Interop : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("CYCLONEDDS_URI", kCycloneSettings, 1);
    node_ = make_node("interop");
    peer_ = std::make_unique<ChildProcess>(NIDO_CYCLONE_PEER,
                                           std::vector<std::string>{std::to_string(own_domain())});
    ASSERT_EQ(peer_->line_with("READY"), "") << peer_->seen();
  }

  // A message to Cyclone and what it sends back.
  template <class T>
  T there_and_back(const std::string& name, const T& message) {
    auto out = make_output<T>(*node_, "/there/" + name, Profile::kEvent);
    auto in = make_input<T>(*node_, "/interop/" + name + ":i", Profile::kEvent);
    EXPECT_TRUE(in->connect("/back/" + name).ok());
    EXPECT_TRUE(out->wait_for_readers(1, kPatience_s));
    EXPECT_TRUE(in->wait_for_sources(1, kPatience_s));
    // the peer's two ends see nido's at times of their own; a message of before is lost, as it is to any late
    // joiner
    for (int attempt = 0; attempt < 100; ++attempt) {
      EXPECT_TRUE(out->write(message).ok());
      if (in->wait_for_message(0.2)) {
        return *in->take();
      }
    }
    ADD_FAILURE() << name << " did not come back";
    return {};
  }

  std::unique_ptr<Node> node_;
  std::unique_ptr<ChildProcess> peer_;
};

msgs::Header header() {
  msgs::Header header;
  header.stamp().sec(1234567);
  header.stamp().nanosec(987654321);
  header.frame_id("root");
  return header;
}

template <class Array>
void fill(Array& values, double first) {
  std::iota(values.begin(), values.end(), first);
}

TEST_F(Interop, JointState) {
  msgs::JointState sent;
  sent.header(header());
  sent.name({"neck_pitch", "neck_roll", ""});
  sent.position({0.1, -0.2, 1e300});
  sent.velocity({1.0, 2.0, 3.0});
  sent.effort({-1e-300});
  EXPECT_TRUE(there_and_back("joint_state", sent) == sent);
}

TEST_F(Interop, Image) {
  msgs::Image sent;
  sent.header(header());
  sent.height(240);
  sent.width(320);
  sent.encoding("rgb8");
  sent.step(960);
  sent.data().resize(230400);
  for (std::size_t i = 0; i < sent.data().size(); ++i) {
    sent.data()[i] = static_cast<std::uint8_t>(i * 31U);
  }
  EXPECT_TRUE(there_and_back("image", sent) == sent);
}

TEST_F(Interop, CameraInfo) {
  msgs::CameraInfo sent;
  sent.header(header());
  sent.height(240);
  sent.width(320);
  sent.distortion_model("plumb_bob");
  sent.d({0.1, 0.2, 0.3, 0.4, 0.5});
  fill(sent.k(), 1.0);
  fill(sent.r(), 10.0);
  fill(sent.p(), 20.0);
  sent.binning_x(2);
  sent.roi().x_offset(3);
  sent.roi().height(4);
  sent.roi().do_rectify(true);
  EXPECT_TRUE(there_and_back("camera_info", sent) == sent);
}

TEST_F(Interop, Imu) {
  msgs::Imu sent;
  sent.header(header());
  sent.orientation().w(0.5);
  sent.orientation().x(-0.5);
  fill(sent.orientation_covariance(), 1.0);
  sent.angular_velocity().z(3.25);
  fill(sent.angular_velocity_covariance(), 11.0);
  sent.linear_acceleration().y(-9.81);
  fill(sent.linear_acceleration_covariance(), 21.0);
  EXPECT_TRUE(there_and_back("imu", sent) == sent);
}

TEST_F(Interop, Clock) {
  msgs::Clock sent;
  sent.clock().sec(77);
  sent.clock().nanosec(1000000);
  EXPECT_TRUE(there_and_back("clock", sent) == sent);
}

TEST_F(Interop, Transforms) {
  msgs::TFMessage sent;
  sent.transforms().resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    auto& transform = sent.transforms()[i];
    transform.header(header());
    transform.child_frame_id("link_" + std::to_string(i));
    transform.transform().translation().x(static_cast<double>(i));
    transform.transform().rotation().w(1.0);
  }
  EXPECT_TRUE(there_and_back("tf", sent) == sent);
}

TEST_F(Interop, ACallOfAService) {
  auto service = node_->open_service("/interop/rpc", [](const std::string& text) { return "heard " + text; });
  ASSERT_TRUE(service.ok()) << service.error().message;
  std::string answer = "(none)";
  for (int attempt = 0; attempt < 100 && answer == "(none)"; ++attempt) {
    peer_->send("call get encs");
    answer = peer_->line_with("ANSWER ", 0.3);
  }
  EXPECT_EQ(answer, "heard get encs") << peer_->seen();
}

}  // namespace

}  // namespace nido::testing
