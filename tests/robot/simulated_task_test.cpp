// The contracts of control in the space of the task and of frames, run on the simulated body.

#include "frame_contract.h"
#include "simulated_task_rig.h"
#include "task_contracts.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(SimulatedUnderLimits, TaskContract,
                         testing::Values([] { return std::make_unique<SimulatedTaskRig>(); }));
INSTANTIATE_TEST_SUITE_P(SimulatedUnderLimits, FrameContract,
                         testing::Values([] { return std::make_unique<SimulatedTaskRig>(); }));

}  // namespace
}  // namespace nido::test
