#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "change_signal.h"
#include "nido/middleware/directory.h"

namespace nido {

// Port name -> sequence number of its last message.
using Sequences = std::map<std::string, std::uint64_t>;

// A connection that an input of this process wants, or a reader that an output of this process has.
struct Wire {
  std::string output;
  std::string input;
  bool live = false;
};

// What a node asks of each of its ports.
class PortRecord {
 public:
  virtual ~PortRecord() = default;
  [[nodiscard]] virtual PortDescription describe() const = 0;
  // The definition of its type; empty if it is not known.
  [[nodiscard]] virtual std::string idl() const { return ""; }
  // Lets others ask who owns the name.
  virtual void drain_name_lock() {}
  // Sentences about partners that do not fit, each one once.
  virtual std::vector<std::string> new_complaints() { return {}; }
};

class OutputRecord : public PortRecord {
 public:
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual std::uint64_t written() const = 0;
  [[nodiscard]] virtual std::vector<Wire> wires() const = 0;
  // Lockstep: what is written from here on belongs to the next tick. What was written before is with all
  // readers.
  virtual void begin_tick() = 0;
};

class InputRecord : public PortRecord {
 public:
  virtual Status connect(const std::string& output_name) = 0;
  virtual Status disconnect(const std::string& output_name) = 0;
  [[nodiscard]] virtual std::vector<Wire> wires() const = 0;
  // Lockstep. From now on messages up to these sequence numbers are waited for, arrived() tells, ...
  virtual void aim(const Sequences& written) = 0;
  [[nodiscard]] virtual bool arrived() const = 0;
  // ... what is still missing, for people, ...
  [[nodiscard]] virtual std::string missing() const = 0;
  // ... and they, and no later ones, can be taken. `is_first`: the first tick of all, before which both ends
  // of every connection knew each other.
  virtual void release(bool is_first) = 0;
};

// The ports of a process. Ports enter and leave by themselves; they may outlive the node. Thread-safe.
class PortBook {
 public:
  void enter(OutputRecord* port) {
    change([&] { outputs_.push_back(port); });
  }
  void enter(InputRecord* port) {
    change([&] { inputs_.push_back(port); });
  }
  void enter_service(PortRecord* port) {
    change([&] { services_.push_back(port); });
  }
  void leave(PortRecord* port) {
    change([&] {
      std::erase(outputs_, port);
      std::erase(inputs_, port);
      std::erase(services_, port);
    });
  }

  // A port does not vanish while a function runs; the function may not open or close ports.
  void each_output(const std::function<void(OutputRecord&)>& function) { each(outputs_, function); }
  void each_input(const std::function<void(InputRecord&)>& function) { each(inputs_, function); }
  void each_port(const std::function<void(PortRecord&)>& function) {
    each(outputs_, function);
    each(inputs_, function);
    each(services_, function);
  }

  // Ports or connections came or went.
  void notify() {
    changes_->notify();
    arrivals_->notify();
  }
  // Notified when ports or connections come and go.
  [[nodiscard]] const std::shared_ptr<ChangeSignal>& changes() const { return changes_; }
  // Notified when the state that arrived() looks at changes, too.
  [[nodiscard]] const std::shared_ptr<ChangeSignal>& arrivals() const { return arrivals_; }

 private:
  void change(const std::function<void()>& function) {
    {
      const std::lock_guard lock(mutex_);
      function();
    }
    notify();
  }
  template <class Record, class Function>
  void each(const std::vector<Record*>& records, const Function& function) {
    const std::lock_guard lock(mutex_);
    for (Record* record : records) {
      function(*record);
    }
  }

  std::mutex mutex_;
  std::vector<OutputRecord*> outputs_;
  std::vector<InputRecord*> inputs_;
  std::vector<PortRecord*> services_;
  const std::shared_ptr<ChangeSignal> changes_ = std::make_shared<ChangeSignal>();
  const std::shared_ptr<ChangeSignal> arrivals_ = std::make_shared<ChangeSignal>();
};

}  // namespace nido
