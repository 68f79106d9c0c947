// The contract of control in the space of the task, run on the simulated body.

#include "simulated_task_rig.h"
#include "task_contracts.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(SimulatedUnderLimits, TaskContract,
                         testing::Values([] { return std::make_unique<SimulatedTaskRig>(); }));

}  // namespace
}  // namespace nido::test
