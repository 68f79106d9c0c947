#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "name_client.h"
#include "nido/yarp/names.h"
#include "nido/yarp/port_host.h"

namespace nido::yarp {

// Where the names of a host's ports are known: served here, or at a name server that runs elsewhere. For the
// loop's thread.
class NamesPlace {
 public:
  NamesPlace(EventLoop& loop, const PortHostOptions& options);

  // Whether they are served here; the host then listens as own_name().
  [[nodiscard]] bool are_served() const { return registry_.has_value(); }
  [[nodiscard]] const std::string& own_name() const { return own_name_; }

  // A port of this host has come, has gone.
  void add(const Contact& own);
  void remove(const std::string& name);
  void find(const std::string& name, std::function<void(std::optional<Contact>)> done);
  // Whether a number was promised to somebody who has not opened it yet.
  [[nodiscard]] bool is_given(int number) const { return registry_ && registry_->is_taken(number); }

  // What is asked of the name server here, by line and by Bottle; only if they are served.
  [[nodiscard]] std::string answer(const std::string& line, const std::string& peer);
  [[nodiscard]] Bottle answer_bottle(const Bottle& request, const std::string& peer);
  // To be called now and then: registers again at a name server that has been started again.
  void look_at_clock();

 private:
  void enroll(const Contact& own);

  std::optional<NameRegistry> registry_;
  std::string own_name_;
  std::function<void(const std::string&)> log_;
  std::map<std::string, Contact> registered_;  // elsewhere
  std::chrono::steady_clock::time_point looked_;
  std::unique_ptr<NameClient> client_;  // last: it answers those who wait when it ends
};

}  // namespace nido::yarp
