#pragma once

// Every message by a short name: nido::msgs::Image is the type that travels as ROS 2's sensor_msgs/msg/Image.
// Plain values with accessors as fastddsgen makes them: image.width(320); image.data().resize(n);
// The definitions, with units and frames of every field, are in msgs/idl.

#include "nido/msgs/idl/nido.h"
#include "nido/msgs/idl/std.h"

// NIDO_MSGS(X): X(package, folder, type) for every type that can travel by itself; `folder` is msg or srv.
#define NIDO_MSGS(X)                      \
  X(builtin_interfaces, msg, Time)        \
  X(std_msgs, msg, Header)                \
  X(std_msgs, msg, String)                \
  X(geometry_msgs, msg, Vector3)          \
  X(geometry_msgs, msg, Point)            \
  X(geometry_msgs, msg, Quaternion)       \
  X(geometry_msgs, msg, Pose)             \
  X(geometry_msgs, msg, Wrench)           \
  X(geometry_msgs, msg, WrenchStamped)    \
  X(geometry_msgs, msg, Transform)        \
  X(geometry_msgs, msg, TransformStamped) \
  X(sensor_msgs, msg, JointState)         \
  X(sensor_msgs, msg, Image)              \
  X(sensor_msgs, msg, RegionOfInterest)   \
  X(sensor_msgs, msg, CameraInfo)         \
  X(sensor_msgs, msg, Imu)                \
  X(rosgraph_msgs, msg, Clock)            \
  X(tf2_msgs, msg, TFMessage)             \
  X(nido_msgs, msg, JointCommand)         \
  X(nido_msgs, msg, Touch)                \
  X(nido_msgs, msg, Audio)                \
  X(nido_msgs, msg, Heard)                \
  X(nido_msgs, msg, Percept)              \
  X(nido_msgs, msg, Percepts)             \
  X(nido_msgs, msg, HandView)             \
  X(nido_msgs, msg, GazeGoal)             \
  X(nido_msgs, msg, GazeStatus)           \
  X(nido_msgs, msg, ActionGoal)           \
  X(nido_msgs, msg, ActionStatus)         \
  X(nido_msgs, msg, StageEvent)           \
  X(nido_msgs, msg, Reward)               \
  X(nido_msgs, msg, Values)               \
  X(nido_msgs, msg, Log)                  \
  X(nido_msgs, msg, ConnectionInfo)       \
  X(nido_msgs, msg, PortInfo)             \
  X(nido_msgs, msg, NodeInfo)             \
  X(nido_msgs, msg, PortSequence)         \
  X(nido_msgs, msg, Tick)                 \
  X(nido_msgs, msg, TickDone)             \
  X(nido_msgs, srv, Text_Request)         \
  X(nido_msgs, srv, Text_Response)

namespace nido::msgs {

#define NIDO_MSGS_ALIAS(package, folder, type) using type = package::folder::dds_::type##_;
NIDO_MSGS(NIDO_MSGS_ALIAS)
#undef NIDO_MSGS_ALIAS

}  // namespace nido::msgs
