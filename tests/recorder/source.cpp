// A process that publishes for the tests of recordings. Parameters:
//   joints   messages of /source/joints:o (53 joints, profile state), one each period
//   images   messages of /source/left:o and /source/right:o (640x480 rgb8, profile sensor), at 30 Hz
//   texts    messages of /source/text:o (profile event), one each period
//   readers  inputs that each port waits for before the first message
// Prints "written PORT N" for each port when all is out, then stays until it is stopped.
#include <cstdio>
#include <random>

#include "nido/middleware/typed_port.h"

namespace {
using namespace nido;

constexpr int kJoints = 53;
constexpr std::uint32_t kWidth = 640;
constexpr std::uint32_t kHeight = 480;
constexpr double kImagePeriod_s = 1.0 / 30;

// Much like a camera's: smooth with noise.
msgs::Image make_image(std::uint32_t seed) {
  msgs::Image image;
  image.width(kWidth);
  image.height(kHeight);
  image.encoding("rgb8");
  image.step(3 * kWidth);
  image.data().resize(std::size_t{3} * kWidth * kHeight);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image.data().size(); ++i) {
    image.data()[i] = static_cast<std::uint8_t>(i / 4000 + random() % 4);
  }
  return image;
}

template <class T>
struct Stream {
  std::unique_ptr<Output<T>> port;
  T message;
  int left = 0;
  int written = 0;

  Status open(Node& node, const std::string& name, Profile profile, int count) {
    left = count;
    if (count == 0) return {};
    auto opened = node.open_output<T>(name, profile, 64);
    if (!opened) return opened.error();
    port = std::move(*opened);
    return {};
  }
  [[nodiscard]] bool has_readers(std::size_t count) const {
    return !port || port->wait_for_readers(count, 60.0);
  }
  Status write() {
    if (left == 0) return {};
    --left;
    ++written;
    return port->write(message);
  }
  void report() const {
    if (port) std::printf("written %s %d\n", port->name().c_str(), written);
  }
};

Status body(Node& node) {
  const auto joints = node.parameter<int>("joints", 0);
  const auto images = node.parameter<int>("images", 0);
  const auto texts = node.parameter<int>("texts", 0);
  const auto readers = node.parameter<int>("readers", 1);
  if (!joints || !images || !texts || !readers)
    return Error{ErrorCode::kInvalidArgument, "a count is no number"};
  Stream<msgs::JointState> state;
  Stream<msgs::Image> left;
  Stream<msgs::Image> right;
  Stream<msgs::String> text;
  if (auto status = state.open(node, "/source/joints:o", Profile::kState, *joints); !status) return status;
  if (auto status = left.open(node, "/source/left:o", Profile::kSensor, *images); !status) return status;
  if (auto status = right.open(node, "/source/right:o", Profile::kSensor, *images); !status) return status;
  if (auto status = text.open(node, "/source/text:o", Profile::kEvent, *texts); !status) return status;
  left.message = make_image(1);
  right.message = make_image(2);
  for (int i = 0; i < kJoints; ++i) state.message.name().push_back("joint_" + std::to_string(i));
  state.message.position().resize(kJoints);
  state.message.velocity().resize(kJoints);
  state.message.effort().resize(kJoints);
  node.set_ready();
  const auto count = static_cast<std::size_t>(*readers);
  if (!state.has_readers(count) || !left.has_readers(count) || !right.has_readers(count) ||
      !text.has_readers(count)) {
    return Error{ErrorCode::kTimeout, "the readers did not come"};
  }
  std::puts("begun");
  std::fflush(stdout);
  Time next_image{};
  bool reported = false;
  return node.run([&](Time now) -> Status {
    state.message.position()[0] = now.seconds();
    text.message.data("text " + std::to_string(text.written));
    if (auto status = state.write(); !status) return status;
    if (auto status = text.write(); !status) return status;
    if (now.ns >= next_image.ns) {
      next_image.ns = now.ns + Time::from_seconds(kImagePeriod_s).ns;
      left.message.data()[static_cast<std::size_t>(left.written)] ^= 1;
      right.message.data()[static_cast<std::size_t>(right.written)] ^= 1;
      if (auto status = left.write(); !status) return status;
      if (auto status = right.write(); !status) return status;
    }
    if (!reported && state.left + left.left + text.left == 0) {
      reported = true;
      state.report();
      left.report();
      right.report();
      text.report();
      std::puts("all written");
      std::fflush(stdout);
    }
    return {};
  });
}

}  // namespace

int main(int argc, char** argv) { return node_main(argc, argv, "source", body); }
