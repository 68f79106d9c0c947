// The contracts of control in the space of the task and of frames, seen through the YARP protocol: DDS,
// gateway, sockets.

#include "../robot/simulated_task_rig.h"
#include "frame_contract.h"
#include "gateway_link.h"
#include "nido/textproto/task_text.h"
#include "nido/wrappers/task_wrappers.h"
#include "task_contracts.h"

namespace nido::test {
namespace {

// The hand, the gaze and the frames of a family, seen from the other side.
template <class Local>
class TasksOverYarp final : public Local {
 public:
  TasksOverYarp() {
    hand_server_ = required(serve_cartesian(link_.server(), link_.stem("arm"), Local::hand()));
    gaze_server_ = required(serve_gaze(link_.server(), link_.stem("gaze"), Local::gaze()));
    frames_server_ = required(serve_frames(link_.server(), link_.stem("frames"), Local::frames()));
    hand_ = asked_cartesian(line_to("arm/rpc:i"));
    gaze_ = asked_gaze(line_to("gaze/rpc:i"));
    frames_ = asked_frames(line_to("frames/rpc:i"));
  }
  ICartesianControl& hand() override { return *hand_; }
  IGazeControl& gaze() override { return *gaze_; }
  IFrameTransforms& frames() override { return *frames_; }

 private:
  // lines go as Bottles, and so do their answers
  AskLine line_to(const std::string& port) {
    link_.wait_for(link_.stem(port));
    return [this, port](const std::string& line) -> Result<std::string> {
      const Result<yarp::Bottle> question = yarp::parse_bottle(line);
      if (!question) return question.error();
      const Result<yarp::Bottle> answer = link_.network()->ask(link_.stem(port), *question);
      if (!answer) return answer.error();
      return yarp::to_text(*answer);
    };
  }
  GatewayLink link_;
  std::unique_ptr<IServer> hand_server_;
  std::unique_ptr<IServer> gaze_server_;
  std::unique_ptr<IServer> frames_server_;
  std::unique_ptr<ICartesianControl> hand_;
  std::unique_ptr<IGazeControl> gaze_;
  std::unique_ptr<IFrameTransforms> frames_;
};
INSTANTIATE_TEST_SUITE_P(FakeOverYarp, FrameContract,
                         testing::Values([] { return std::make_unique<TasksOverYarp<FakeTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(FakeOverYarp, TaskContract,
                         testing::Values([] { return std::make_unique<TasksOverYarp<FakeTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverYarp, FrameContract,
                         testing::Values([] { return std::make_unique<TasksOverYarp<SimulatedTaskRig>>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedOverYarp, TaskContract,
                         testing::Values([] { return std::make_unique<TasksOverYarp<SimulatedTaskRig>>(); }));

}  // namespace
}  // namespace nido::test
