#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "limits/safety.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"

namespace nido {

// Listens whether others are still there and tells the robot's safety each time they are heard, on a thread
// of its own. A source is the name of a node, which is asked and must answer, or of an output port ("/reach/
// command:o"), which must be written.
class Heartbeat {
 public:
  // `node` must outlive this. timeout_s: how often they have to be heard; they are listened for four times as
  // often.
  static Result<std::unique_ptr<Heartbeat>> listen(Node& node, std::shared_ptr<Safety> safety,
                                                   std::vector<std::string> sources, double timeout_s);
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

 private:
  struct Source {
    std::string name;
    std::unique_ptr<RawInput> input;  // of a port, once it is there
  };
  Heartbeat(Node& node, std::shared_ptr<Safety> safety, std::unique_ptr<Directory> directory)
      : node_(node), safety_(std::move(safety)), directory_(std::move(directory)) {}
  void run(double interval_s);
  [[nodiscard]] bool is_heard(Source& source, double patience_s);

  Node& node_;
  const std::shared_ptr<Safety> safety_;
  const std::unique_ptr<Directory> directory_;
  std::vector<Source> sources_;
  std::mutex mutex_;  // of ends_
  std::condition_variable changed_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace nido
