#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/yarp/bottle.h"

namespace nido::yarp {

// One connection, as administrative commands tell it.
struct Route {
  std::string from;
  std::string to;
  std::string carrier;
};

// What administrative commands do to a port.
class AdminActions {
 public:
  virtual ~AdminActions() = default;
  [[nodiscard]] virtual std::vector<Route> routes(const std::string& port, bool outgoing) const = 0;
  [[nodiscard]] virtual std::string address_of(const std::string& port) const = 0;
  [[nodiscard]] virtual bool gives(const std::string& port) const = 0;
  [[nodiscard]] virtual bool takes(const std::string& port) const = 0;
  // `target` may begin with a carrier ("tcp://b").
  virtual void add_output(const std::string& port, const std::string& target, const std::string& carrier,
                          std::function<void(Status)> done) = 0;
  virtual void remove(const std::string& port, const std::string& target, bool outputs, bool inputs,
                      std::function<void(bool output, bool input)> done) = 0;
};

// Answers one administrative command to a port: `[list] [out]`, `[add] /b`, ... `done` is called once, now or
// later.
void answer_admin_command(AdminActions& actions, const std::string& port,
                          std::map<std::string, Bottle>& properties, const Bottle& command,
                          std::function<void(Bottle)> done);

// What '*' says, in lines.
[[nodiscard]] std::string describe(const AdminActions& actions, const std::string& port);
// What '?' says, in lines.
[[nodiscard]] std::string help_for_people(const std::string& port, const std::string& about);

}  // namespace nido::yarp
