#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"
#include "nido/middleware/port.h"

namespace nido {

// What a node announces of itself, about once a second and at every change.
struct PortDescription {
  std::string name;       // "/vision/objects:o"
  std::string type;       // "nido_msgs/msg/Percepts"
  std::string direction;  // "output", "input", "service"
  std::string profile;    // "sensor", "state", "command", "event"; empty for services
  std::uint64_t written = 0;
  // inputs: where messages come from; outputs: `source` names the input at the other end
  std::vector<ConnectionCounters> connections;
};
struct NodeDescription {
  std::string name;
  std::uint32_t pid = 0;
  std::string host;
  std::string state;  // "starting", "ready", "failed", "stopping"
  std::string detail;
  std::vector<std::string> parameters;  // "key = value"
  std::vector<PortDescription> ports;
};
// A DDS topic that some process writes or reads, nido or not.
struct TopicDescription {
  std::string topic;  // "rt/vision/objects"
  std::string type;   // "nido_msgs/msg/Percepts"
  std::size_t writers = 0;
  std::size_t readers = 0;
};

// Who is there: for the command line and the launcher. Thread-safe.
class Directory {
 public:
  // Listens from now on. `node` must outlive it.
  static Result<std::unique_ptr<Directory>> open(Node& node);
  virtual ~Directory() = default;

  // What has been heard so far, by name; nodes that ended are gone.
  [[nodiscard]] virtual std::vector<NodeDescription> nodes() const = 0;
  [[nodiscard]] virtual std::optional<NodeDescription> node(const std::string& name) const = 0;
  // The node that owns a port, and the port.
  struct Owner {
    NodeDescription node;
    PortDescription port;
  };
  [[nodiscard]] virtual std::optional<Owner> owner_of(const std::string& port_name) const = 0;
  [[nodiscard]] virtual std::vector<TopicDescription> topics() const = 0;

  // Waits until `holds` is true of the directory, looking at every change; false after timeout_s of wall
  // time. Right after open() the picture grows for some tenths of a second: wait for what you look for.
  virtual bool wait(const std::function<bool(const Directory&)>& holds, double timeout_s) = 0;

  // Rewires from outside: asks the node that owns the input. kNotFound names the port that no node has. An
  // output that does not exist yet is no error: the connection is made when it appears.
  virtual Status connect(const std::string& output_name, const std::string& input_name, double timeout_s) = 0;
  virtual Status disconnect(const std::string& output_name, const std::string& input_name,
                            double timeout_s) = 0;
};

}  // namespace nido
