#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "nido/middleware/time.h"
#include "port_book.h"
#include "reader.h"
#include "writer.h"

namespace nido {

// The barrier of a lockstep run (messages Tick and TickDone in msgs/idl/nido.idl). The owner of the clock
// says: tick k, and everything that has been written so far; each member waits until that has arrived at its
// inputs, takes it and nothing newer, works, and says done with what it has written itself.
//
// A member joins with the TickDone of tick 0, which also tells its ports and connections, so that the owner
// can wait until both ends of each connection know each other. It leaves with tick kLeaves.

struct LockstepContext {
  std::shared_ptr<Participant> participant;
  std::shared_ptr<PortBook> book;
  std::string node;
  bool one_computer = true;  // no member is on another one
  std::function<bool()> is_stopped;
  std::function<void(const std::string&)> info;
  std::function<void(const std::string&)> warning;
};

// Messages of DDS come again when the two ends lose sight of each other for a while; each counts once.
class FirstTime {
 public:
  bool operator()(const MessageInfo& info) {
    std::uint64_t& last = last_[info.writer];
    return info.sequence > last && (last = info.sequence) > 0;
  }

 private:
  std::map<Guid, std::uint64_t> last_;
};

// Waits until everything that has been written is at the inputs. kTimeout when a message of a living source
// does not come; kInterrupted when stopped.
Status wait_for_inputs(const LockstepContext& context, const Sequences& written);

class LockstepMember final : private ReaderEvents {
 public:
  static Result<std::unique_ptr<LockstepMember>> open(LockstepContext context);
  ~LockstepMember() override;

  struct TickStart {
    std::uint64_t tick = 0;
    Time time;
  };
  // Waits for the next tick, joining first if that is not done; nothing when stopped.
  std::optional<TickStart> next();
  // Waits for the inputs of the tick. At every tick, also one without work: so no more messages are ever
  // under way than those of one tick, and the writers keep that many.
  Status prepare() { return wait_for_inputs(context_, written_); }
  // Before work: they can be taken.
  void hand_out();
  void finish(std::uint64_t tick);

 private:
  explicit LockstepMember(LockstepContext context) : context_(std::move(context)) {}
  void on_message(std::shared_ptr<void> message, const MessageInfo& info) override;
  void join();
  void send(std::uint64_t tick, const Sequences& written);

  LockstepContext context_;
  std::unique_ptr<Writer> done_writer_;
  Sequences joined_with_;  // what was said last
  Sequences told_;         // own outputs, as told
  Sequences written_;      // everybody's outputs, as the owner says
  std::uint64_t last_tick_ = 0;
  std::mutex mutex_;
  FirstTime is_new_;
  std::vector<std::shared_ptr<void>> ticks_;  // not yet worked on
  std::unique_ptr<Reader> tick_reader_;
};

class LockstepOwner final : private ReaderEvents {
 public:
  static Result<std::unique_ptr<LockstepOwner>> open(LockstepContext context,
                                                     std::vector<std::string> expected, double patience_s);
  ~LockstepOwner() override;
  // One tick: returns when every member has done it and the owner's own inputs have what they wrote. The
  // first call waits for the expected members. kTimeout, with the name of who is waited for, after patience_s
  // of wall time (0: no limit); kInterrupted when stopped.
  Status tick(Time now);

 private:
  struct Member {
    bool active = false;     // counted since the last tick
    std::uint64_t done = 0;  // last tick done
    Sequences join;          // what it said when it joined
  };
  LockstepOwner(LockstepContext context, std::vector<std::string> expected, double patience_s)
      : context_(std::move(context)), expected_(std::move(expected)), patience_s_(patience_s) {}
  void on_message(std::shared_ptr<void> message, const MessageInfo& info) override;
  // What keeps the run from starting, for people; empty if nothing.
  struct Obstacle {
    std::string absent;       // members that are not there
    std::string unconnected;  // between members
    std::string unseen;       // readers outside the lockstep that would miss the first messages
  };
  Obstacle obstacle();
  Status wait_for_members();
  void drop_dead(std::uint64_t tick);

  LockstepContext context_;
  const std::vector<std::string> expected_;
  const double patience_s_;
  std::unique_ptr<Writer> tick_writer_;
  std::uint64_t tick_ = 0;
  Sequences told_;  // what members know already

  std::mutex mutex_;
  std::map<std::string, Member> members_;
  FirstTime is_new_;
  Sequences written_;
  bool has_newcomer_ = false;
  std::unique_ptr<Reader> done_reader_;
};

}  // namespace nido
