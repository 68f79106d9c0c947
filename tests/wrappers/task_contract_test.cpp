// The contracts of control in the space of the task and of frames, seen over DDS.

#include <unistd.h>

#include "../robot/simulated_task_rig.h"
#include "frame_contract.h"
#include "nido/wrappers/task_wrappers.h"
#include "node_link.h"
#include "task_contracts.h"

namespace nido::test {
namespace {

constexpr int kDomain = 42;

// The hand, the gaze and the frames of a family, served.
template <class Local>
class TasksOverDds final : public Local {
 public:
  ICartesianControl& hand() override { return *hand_; }
  IGazeControl& gaze() override { return *gaze_; }
  IFrameTransforms& frames() override { return *frames_; }

 private:
  const std::string id_ = std::to_string(getpid());
  std::unique_ptr<Node> server_ = make_test_node("server" + id_, kDomain);
  std::unique_ptr<Node> client_ = make_test_node("client" + id_, kDomain);
  std::unique_ptr<IServer> hand_server_ =
      required(serve_cartesian(*server_, "/t" + id_ + "/arm", Local::hand()));
  std::unique_ptr<IServer> gaze_server_ = required(serve_gaze(*server_, "/t" + id_ + "/gaze", Local::gaze()));
  std::unique_ptr<IServer> frames_server_ =
      required(serve_frames(*server_, "/t" + id_ + "/frames", Local::frames()));
  std::unique_ptr<ICartesianControl> hand_ =
      required(cartesian_client(*client_, {"/t" + id_ + "/arm", "", kPatience_s}));
  std::unique_ptr<IGazeControl> gaze_ =
      required(gaze_client(*client_, {"/t" + id_ + "/gaze", "", kPatience_s}));
  std::unique_ptr<IFrameTransforms> frames_ =
      required(frames_client(*client_, {"/t" + id_ + "/frames", "", kPatience_s}));
};
INSTANTIATE_TEST_SUITE_P(FakeOverDds, FrameContract,
                         testing::Values([] { return std::make_unique<TasksOverDds<FakeTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(FakeOverDds, TaskContract,
                         testing::Values([] { return std::make_unique<TasksOverDds<FakeTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverDds, FrameContract,
                         testing::Values([] { return std::make_unique<TasksOverDds<SimulatedTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverDds, TaskContract,
                         testing::Values([] { return std::make_unique<TasksOverDds<SimulatedTaskRig>>(); }));

}  // namespace
}  // namespace nido::test
