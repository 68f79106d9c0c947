// Keys of a run in a terminal.
#include <gtest/gtest.h>

#include "temp_folder.h"
#include "terminal.h"
#include "tool.h"

namespace nido::test {
namespace {

TEST(LaunchKeys, TheSpaceBarStopsTheRobotsAndTheTerminalIsLeftAsItWas) {
  TempFolder folder;
  const std::string app = folder.write(
      "small.yaml", std::string("name: small\nsummary: a small app\nprocesses:\n  - {program: ") + TEST_NODE +
                        ", name: robot, clock: owner, parameters: {behaviour: clock}}\n");
  Terminal terminal(NIDO, {"launch", app, "--out", (folder.path() / "out").string(), "--domain",
                           std::to_string(test_domain())});
  ASSERT_TRUE(terminal.wait_for("the space bar is the emergency stop")) << terminal.text();
  ASSERT_TRUE(terminal.wait_for("1 processes are ready")) << terminal.text();
  terminal.type("x ");
  EXPECT_TRUE(terminal.wait_for("'robot' takes no command until 'nido node call robot estop clear'"))
      << terminal.text();
  EXPECT_FALSE(terminal.is_by_lines());
  terminal.type("\x03");
  EXPECT_TRUE(terminal.wait_for("stopped by Ctrl-C")) << terminal.text();
  EXPECT_TRUE(becomes_true([&] { return terminal.is_by_lines(); }));
}

}  // namespace
}  // namespace nido::test
