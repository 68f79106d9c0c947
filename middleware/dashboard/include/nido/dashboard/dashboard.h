#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"

namespace nido {

struct DashboardOptions {
  int port = 8080;    // of 127.0.0.1; 0: a free one
  std::string story;  // port of StageEvent that is followed from the start; others are found
};

// The page on which a person watches and drives a system (docs/dashboard.md). It reads what every tool may
// read, outside of any lockstep, and drives through the services that everybody has.
class Dashboard {
 public:
  // kTaken if the port has an owner. `node` must outlive it.
  static Result<std::unique_ptr<Dashboard>> open(Node& node, DashboardOptions options);
  virtual ~Dashboard() = default;

  // "http://127.0.0.1:8080/"
  [[nodiscard]] virtual std::string address() const = 0;
  // Looks at the system and tells the pages what is new. To be called about ten times a second, by one
  // thread.
  virtual void tick() = 0;
};

}  // namespace nido
