#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "limits/limited_control_board.h"
#include "nido/interfaces/clock.h"
#include "nido/middleware/node.h"
#include "nido/wrappers/server.h"
#include "src/device_registry.h"
#include "src/heartbeat.h"
#include "src/robot_file.h"
#include "src/robot_snapshot.h"
#include "task/body_frames.h"

namespace nido::sim {
class Window;
}

namespace nido {

// The devices of a robot file, each control board under its limits, and their servers. One thread calls it;
// what people ask by text is answered on others.
class Robot {
 public:
  // Makes the devices and opens the ports. `node` must outlive the robot. start_ns: the robot's time at the
  // start.
  static Result<std::unique_ptr<Robot>> create(Node& node, const RobotFile& file, const RunSettings& run,
                                               std::int64_t start_ns);
  ~Robot();
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  // Publishes how things are, before any time has passed.
  Status publish();
  // Whether time is made by a robot on a network, and not by this process.
  [[nodiscard]] bool has_far_time() const { return yarp_network_ != nullptr; }
  // The moment that it is in, between two control periods; kUnsupported without a simulator.
  [[nodiscard]] Result<RobotSnapshot> snapshot() const;
  // Goes on from a snapshot of the same robot file, whose time was given to create(). Before publish().
  Status go_on_from(const RobotSnapshot& snapshot, const std::string& source);
  // Shows the simulated world in a window until it is closed. kInvalidArgument without a simulator,
  // kNotFound without a display. After set_clock().
  Status open_window();
  // How the world port asks the owner of the clock; nothing without a simulator. Before the first step.
  void set_clock(std::function<std::string(const std::string&)> clock);
  // Waits for the end of the control period that began at now_ns, by the far robot's time: usually period_ns
  // later; more, in whole periods, when this side has fallen behind by more than 50 ms. When nothing comes
  // from there, by the wall clock. Only with has_far_time().
  std::int64_t wait_for_far_time(std::int64_t now_ns, std::int64_t period_ns,
                                 const std::function<void(const std::string&)>& log);
  // One control period that ends at now_ns: takes commands, moves the devices, publishes.
  Status step_to(std::int64_t now_ns);

 private:
  Robot(Node& node, std::int64_t start_ns);
  Status make_safety(const RobotFile& file);
  Status add_device(const DeviceEntry& entry, const SafetyEntry& safety, DeviceContext& context);
  Status add_server(const ServerEntry& entry);
  // What others read of this node says whether the emergency stop is on.
  void tell_health();

  [[nodiscard]] IControlBoard* board(const std::string& name) const;

  struct Device {
    std::string name;
    AnyDevice device;
    std::unique_ptr<LimitedControlBoard> limited;  // of control boards only
  };
  Node& node_;
  // in this order, so that servers end before what they serve, and devices before their clock
  ManualClock clock_;
  bool goes_on_ = false;  // from a snapshot
  std::shared_ptr<sim::SimulatedRobot> simulated_;
  std::shared_ptr<yarp::Network> yarp_network_;
  bool is_following_ = false;
  bool is_silent_ = false;   // nothing comes from the far side
  std::int64_t far_ns_ = 0;  // newest time of the far side
  std::shared_ptr<Safety> safety_;
  std::shared_ptr<Workspace> workspace_;  // null without borders
  std::optional<std::string> told_;       // the stop that others know of
  std::vector<Device> devices_;
  std::vector<ISteppable*> steppables_;
  std::vector<ISteppable*> commanders_;  // they command boards
  std::unique_ptr<BodyFrames> frames_;   // null without a body
  std::vector<std::unique_ptr<IServer>> servers_;
  std::unique_ptr<Node::Service> estop_service_;
  std::unique_ptr<Heartbeat> heartbeat_;
  std::unique_ptr<sim::Window> window_;  // asks the simulation as clients do
};

}  // namespace nido
