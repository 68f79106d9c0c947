#pragma once

#include <yaml-cpp/yaml.h>

#include <map>
#include <string>
#include <vector>

#include "limits/safety.h"
#include "limits/workspace.h"
#include "nido/interfaces/control_board.h"
#include "nido/launcher/schema.h"

namespace nido {

// What one joint may do, where that is less than the device can.
struct JointNarrowing {
  std::optional<double> min_rad;
  std::optional<double> max_rad;
  std::optional<double> speed_rad_s;
  std::optional<double> torque_Nm;
};

// The same for a board.
struct BoardNarrowing {
  double speed = 1;                              // share of its joints' top speeds, 0..1
  std::map<std::string, JointNarrowing> joints;  // by name or number
};

// What is held above everything else that a robot is told: the key `safety` of its file.
struct SafetyEntry {
  bool read_only = false;
  double speed = 1;  // of the joints' top speeds, 0..1
  StopAction estop = StopAction::kHold;
  double heartbeat_s = 0;                        // 0: none is wanted
  std::vector<std::string> heartbeat_from;       // nodes and output ports
  std::map<std::string, BoardNarrowing> limits;  // by the device's name
  std::vector<WorkspaceRule> workspace;
};

const Schema& safety_schema();
// From a map that was checked against the schema. `where` names the file in sentences.
Result<SafetyEntry> read_safety(const YAML::Node& checked, const std::string& where);

// The limits that a board called `name` shall have: its own, or what the file allows of them.
// kInvalidArgument for joints that it does not have, and for limits that are wider than its own or leave
// nothing.
Result<std::vector<JointLimits>> narrowed(const IControlBoard& board, const std::string& name,
                                          const SafetyEntry& safety);

}  // namespace nido
