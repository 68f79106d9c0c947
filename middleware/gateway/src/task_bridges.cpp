// The ports of iCub's own controllers of hand and gaze, before nido's devices.
#include <array>
#include <map>
#include <utility>

#include "bridges.h"
#include "icub_words.h"
#include "nido/gateway/icub_tasks.h"
#include "nido/textproto/task_text.h"

namespace nido::gateway {
namespace {

constexpr double kService_s = 3.0;
// for a state that is asked for again soon, and an order that nobody waits for: a robot that went away holds
// up nothing
constexpr double kLook_s = 0.5;
constexpr double kPeriod_s = 0.02;  // of what the controllers publish
constexpr std::string_view kRpc = "/rpc:i";

// What both have: words that are worked on one after the other on a thread, and states that are published as
// long as somebody reads them.
class TaskBridge : public Bridge {
 public:
  TaskBridge(BridgeContext& context, std::string stem) : context_(context), stem_(std::move(stem)) {}

 protected:
  // For the destructor of what is made of this: nothing of it is called any more.
  void close() {
    *alive_ = nullptr;
    closing_ = true;  // what waits is not begun any more
    for (const std::string& name : names_) context_.ports.close_port(name);
    worker_.wait();
  }
  using Work = std::function<std::optional<yarp::Bottle>(const yarp::Bottle&, const yarp::Incoming&)>;
  Status open_input(const std::string& end, const std::string& about, Work work) {
    yarp::PortSpec spec;
    spec.name = stem_ + end;
    spec.takes = true;
    spec.about = about;
    spec.on_message = [this, work = std::move(work)](yarp::Incoming incoming) {
      worker_.add(
          [this, work, incoming = std::move(incoming)]() mutable { take(work, std::move(incoming)); });
    };
    return open(std::move(spec));
  }
  virtual void tick() = 0;
  void publish(const std::string& end, yarp::Bottle content, std::int64_t stamp_ns) {
    const yarp::Stamp stamp{++count_ & 0x7fffffff, static_cast<double>(stamp_ns) * 1e-9};
    context_.ports.publish(stem_ + end, std::make_shared<const yarp::Content>(std::move(content)),
                           yarp::to_text(stamp));
  }
  template <class State>
  void publish_events(MotionEvents& events, const State& state) {
    for (yarp::Bottle& event : events.follow(state.moving, state.progress, state.stamp_ns)) {
      publish("/events:o", std::move(event), state.stamp_ns);
    }
  }
  // The outputs that both have, and no more to be opened.
  Status open_outputs(std::initializer_list<std::pair<const char*, const char*>> outputs) {
    for (const auto& [end, about] : outputs) {
      if (Status opened = open_output(end, about); !opened) return opened;
    }
    if (Status opened = open_output("/events:o", "motion-onset, motion-done, motion-ongoing"); !opened) {
      return opened;
    }
    start();
    return {};
  }
  AskLine asker(const std::string& service) {
    return [this, service](const std::string& line) {
      return context_.node.call(service, line, looks_ ? kLook_s : kService_s);
    };
  }
  void refuse(const std::string& end, const Status& status) {
    if (!status) context_.node.log_warning(stem_ + end + ": " + status.error().message);
  }
  std::atomic<bool> goes_on_ = false;  // tick() is wanted though nobody reads

 private:
  Status open_output(const std::string& end, const std::string& about) {
    yarp::PortSpec spec;
    spec.name = stem_ + end;
    spec.gives = true;
    spec.about = about;
    spec.on_readers = [this, end](std::size_t readers) { readers_[end] = readers; };
    return open(std::move(spec));
  }
  // Calls tick() on the worker's thread, again and again, while somebody reads or it is said to go on.
  void start() {
    context_.loop.every(kPeriod_s, [alive = alive_] {
      if (*alive != nullptr) (*alive)->turn();
    });
  }
  Status open(yarp::PortSpec spec) {
    const std::string name = spec.name;
    Status opened = context_.ports.open_port(std::move(spec));
    if (opened) names_.push_back(name);
    return opened;
  }
  void take(const Work& work, yarp::Incoming incoming) {
    if (closing_) return;
    looks_ = !incoming.wants_reply;
    Result<yarp::Bottle> words = yarp::Bottle{};
    if (incoming.is_text) {
      words = yarp::parse_bottle(incoming.bytes);
    } else if (Result<yarp::Decoded> content = incoming.content(); content) {
      words = std::move(content->bottle);
    } else {
      words = content.error();
    }
    if (!words) {
      incoming.answer(yarp::Bottle{yarp::Value::word("nack"), yarp::Value::string(words.error().message)});
      return;
    }
    incoming.answer(work(*words, incoming));
  }
  void turn() {
    bool wanted = goes_on_;
    for (const auto& [end, readers] : readers_) wanted = wanted || readers > 0;
    if (!wanted || is_at_work_.exchange(true)) return;
    worker_.add([this] {
      looks_ = true;
      if (!closing_) tick();
      is_at_work_ = false;
    });
  }

  BridgeContext& context_;
  const std::string stem_;
  const std::shared_ptr<TaskBridge*> alive_ = std::make_shared<TaskBridge*>(this);
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> readers_;  // of each output; the loop's
  std::atomic<bool> is_at_work_ = false;
  std::atomic<bool> closing_ = false;
  bool looks_ = false;  // the worker's
  std::int64_t count_ = 0;
  Worker worker_;
};

class CartesianBridge final : public TaskBridge {
 public:
  // /icubSim/cartesian/left_arm/rpc:i
  CartesianBridge(BridgeContext& context, const std::string& robot, const std::string& part,
                  const std::string& stem)
      : TaskBridge(context, robot + "/" + stem + "/" + part),
        hand_(asked_cartesian(asker(robot + "/cartesian/" + part + std::string(kRpc)))),
        words_(*hand_, part) {}
  ~CartesianBridge() override { close(); }

  Status open() {
    const auto answer = [this](const yarp::Bottle& words, const yarp::Incoming& incoming) {
      note_client(incoming);
      return std::optional(reply(words, incoming));
    };
    const auto obey = [this](const yarp::Bottle& words,
                             const yarp::Incoming& incoming) -> std::optional<yarp::Bottle> {
      const yarp::Bottle told = reply(words, incoming);
      if (told.size() > 1 && told[0].is_word("nack"))
        refuse("/command:i", Error{ErrorCode::kFailed, told[1].text});
      return std::nullopt;
    };
    if (Status opened = open_input("/rpc:i", "a hand, as cartesiancontrollerclient asks it", answer); !opened)
      return opened;
    if (Status opened = open_input("/command:i", "poses and speeds for a hand", obey); !opened) return opened;
    return open_outputs({{"/state:o", "pose of the palm: x y z, axis, angle"}});
  }

 private:
  // A client's ports have one stem: /client/rpc:o, /client/command:o.
  static std::string stem_of(const std::string& sender) { return sender.substr(0, sender.rfind('/')); }
  void note_client(const yarp::Incoming& incoming) {
    std::erase_if(clients_, [](const auto& client) { return client.second.expired(); });
    if (incoming.sender.starts_with('/')) clients_[stem_of(incoming.sender)] = incoming.connection;
  }
  yarp::Bottle reply(const yarp::Bottle& words, const yarp::Incoming& incoming) {
    const yarp::Bottle told = words_.reply(words);
    if (is(words, 0, "tvel") && is(told, 0, "ack")) {
      // who streams by datagrams is there as long as its questions have a connection
      const auto client = clients_.find(stem_of(incoming.sender));
      commander_ = incoming.connection;
      if (commander_.expired() && client != clients_.end()) commander_ = client->second;
    }
    goes_on_ = words_.keeps_speed();
    return told;
  }
  void tick() override {
    const Result<CartesianState> state = hand_->state();
    if (!state) return;
    if (commander_.expired()) words_.let_go_of_speed();
    refuse("/command:i", words_.follow(*state));
    goes_on_ = words_.keeps_speed();
    publish("/state:o", CartesianWords::pose_vector(*state), state->stamp_ns);
    publish_events(words_.events(), *state);
  }

  const std::unique_ptr<ICartesianControl> hand_;
  CartesianWords words_;                                      // the worker's, as is what follows
  std::map<std::string, std::weak_ptr<const void>> clients_;  // that asked, by their stem: their connections
  std::weak_ptr<const void> commander_;                       // who gave the hand a speed
};

class GazeBridge final : public TaskBridge {
 public:
  GazeBridge(BridgeContext& context, const std::string& stem, const std::string& service)
      : TaskBridge(context, stem), gaze_(asked_gaze(asker(service))), words_(*gaze_) {}
  ~GazeBridge() override { close(); }

  Status open() {
    const auto answer = [this](const yarp::Bottle& words, const yarp::Incoming&) {
      auto reply = std::optional(words_.reply(words));
      goes_on_ = words_.has_target();
      return reply;
    };
    if (Status opened = open_input("/rpc", "the gaze, as gazecontrollerclient asks it", answer); !opened)
      return opened;
    for (const auto& [end, kind, about] : std::initializer_list<std::array<const char*, 3>>{
             {"/xd:i", "3D", "points to look at: X Y Z"},
             {"/mono:i", "mono", "pixels to look at: left|right U V Z, or ... ver VERGENCE"},
             {"/stereo:i", "ster", "pixels to look at: UL VL UR VR"},
             {"/angles:i", "ang", "directions to look: abs|rel AZIMUTH ELEVATION VERGENCE"}}) {
      const auto order = [this, name = std::string(end), what = std::string(kind)](const yarp::Bottle& words,
                                                                                   const yarp::Incoming&) {
        refuse(name, words_.look(what, words));
        goes_on_ = words_.has_target();
        return std::optional<yarp::Bottle>();
      };
      if (Status opened = open_input(end, about, order); !opened) return opened;
    }
    return open_outputs({{"/x:o", "where the eyes meet: x y z"},
                         {"/angles:o", "azimuth, elevation, vergence, degrees"},
                         {"/q:o", "joints of torso (pitch, roll, yaw) and head, degrees"}});
  }

 private:
  void tick() override {
    const Result<GazeState> state = gaze_->state();
    if (!state) return;
    refuse("/rpc", words_.follow(*state));
    goes_on_ = words_.has_target();
    publish("/x:o", GazeWords::fixation_vector(*state), state->stamp_ns);
    publish("/angles:o", GazeWords::angles_vector(*state), state->stamp_ns);
    publish("/q:o", GazeWords::joints_vector(*state), state->stamp_ns);
    publish_events(words_.events(), *state);
  }

  const std::unique_ptr<IGazeControl> gaze_;
  GazeWords words_;  // the worker's
};

template <class Made>
Result<std::unique_ptr<Bridge>> opened(std::unique_ptr<Made> bridge) {
  if (Status status = bridge->open(); !status) return status.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

}  // namespace

Result<std::unique_ptr<Bridge>> bridge_task(BridgeContext& context, const std::string& service,
                                            const TaskStems& stems) {
  constexpr std::string_view kCartesian = "/cartesian/";
  constexpr std::string_view kGaze = "/gaze/rpc:i";
  if (const std::size_t at = service.find(kCartesian);
      at != std::string::npos && service.ends_with(kRpc) && !stems.cartesian.empty()) {
    const std::size_t first = at + kCartesian.size();
    return opened(std::make_unique<CartesianBridge>(
        context, service.substr(0, at), service.substr(first, service.size() - kRpc.size() - first),
        stems.cartesian));
  }
  if (service.ends_with(kGaze) && !stems.gaze.empty()) {
    return opened(std::make_unique<GazeBridge>(context, stems.gaze, service));
  }
  return std::unique_ptr<Bridge>();
}

}  // namespace nido::gateway
