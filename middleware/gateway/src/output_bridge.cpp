#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "bridges.h"
#include "nido/middleware/image_port.h"
#include "nido/textproto/control_board_text.h"
#include "nido/textproto/text_value.h"
#include "nido/yarp/image.h"

namespace nido::gateway {
namespace {

constexpr double kService_s = 1.0;
// how old the modes in stateExt:o may be
constexpr auto kModesPeriod = std::chrono::milliseconds(20);
// pictures that the loop has not sent yet; more of them are not made
constexpr int kMostUnsent = 4;
// messages of other kinds that wait here, and for each connection
constexpr std::size_t kMessagesKept = 64;

// Asks a control board for its modes, again and again, while somebody wants to know.
class ModePoller {
 public:
  ModePoller(Node& node, std::string service) : node_(node), service_(std::move(service)) {}
  ~ModePoller() { want(false); }

  void want(bool wanted) {
    if (wanted == thread_.joinable()) return;
    stops_ = !wanted;
    if (wanted) {
      thread_ = std::thread([this] { poll(); });
    } else {
      thread_.join();
    }
  }
  [[nodiscard]] std::shared_ptr<Modes> modes() const { return modes_; }

 private:
  void poll() {
    for (auto next = std::chrono::steady_clock::now(); !stops_;) {
      const Result<std::string> answer = node_.call(service_, "get icmd cmds", kService_s);
      const Result<std::vector<TextValue>> words =
          answer ? parse_text(*answer) : Result<std::vector<TextValue>>(answer.error());
      if (words && words->size() > 2 && (*words)[2].list() != nullptr) {
        std::vector<ControlMode> modes;
        for (const TextValue& word : *(*words)[2].list()) {
          const std::optional<ControlMode> mode =
              word.text() != nullptr ? mode_from_word(*word.text()) : std::nullopt;
          modes.push_back(mode.value_or(ControlMode::kFault));
        }
        modes_->set(std::move(modes));
      }
      next = std::max(next + kModesPeriod, std::chrono::steady_clock::now());
      std::this_thread::sleep_until(next);
    }
  }

  Node& node_;
  const std::string service_;
  std::shared_ptr<Modes> modes_ = std::make_shared<Modes>();
  std::atomic<bool> stops_ = false;
  std::thread thread_;
};

// Pictures as they are sent. The memory of one that has been sent is used for the next: new memory for each
// would cost more than what is done with it. Thread-safe.
class Pictures : public std::enable_shared_from_this<Pictures> {
 public:
  std::shared_ptr<const yarp::Content> of(const ImageView& view) {
    std::unique_ptr<yarp::Content> content = take();
    yarp::encode_image(static_cast<int>(view.width), static_cast<int>(view.height), view.pixels, view.step,
                       content->refill());
    return {content.release(), [pictures = shared_from_this()](const yarp::Content* sent) {
              pictures->give_back(std::unique_ptr<yarp::Content>(const_cast<yarp::Content*>(sent)));
            }};
  }

 private:
  static constexpr std::size_t kKept = 8;
  std::unique_ptr<yarp::Content> take() {
    const std::lock_guard lock(mutex_);
    if (kept_.empty()) return std::make_unique<yarp::Content>(yarp::Content::of_bytes({}));
    std::unique_ptr<yarp::Content> content = std::move(kept_.back());
    kept_.pop_back();
    return content;
  }
  void give_back(std::unique_ptr<yarp::Content> content) {
    const std::lock_guard lock(mutex_);
    if (kept_.size() < kKept) kept_.push_back(std::move(content));
  }
  std::mutex mutex_;
  std::vector<std::unique_ptr<yarp::Content>> kept_;
};

class OutputBridge final : public Bridge {
 public:
  OutputBridge(BridgeContext& context, const PortDescription& port, const AnyType& type, Profile profile)
      : context_(context), name_(port.name), type_(type), profile_(profile) {}

  ~OutputBridge() override {
    for (const View& view : views_) context_.ports.close_port(view.name);
    take_no_more();
  }

  Status open() {
    constexpr std::string_view kState = "/state:o";
    if (std::string_view(name_).ends_with(kState)) {
      poller_ = std::make_unique<ModePoller>(context_.node,
                                             name_.substr(0, name_.size() - kState.size()) + "/rpc:i");
    }
    readers_ = std::make_unique<std::array<std::atomic<std::size_t>, 4>>();
    for (View& view : views_of(name_, type_, poller_ ? poller_->modes() : std::make_shared<Modes>())) {
      yarp::PortSpec spec;
      spec.name = view.name;
      spec.gives = true;
      spec.about = view.about;
      spec.queue = profile_ == Profile::kSensor ? 1 : kMessagesKept;
      const std::size_t index = views_.size();
      spec.on_readers = [this, index](std::size_t readers) { on_readers(index, readers); };
      spec.connect_natively = [this](const std::string& target, bool connect, yarp::PortSpec::Done done) {
        return connect_natively(target, connect, std::move(done));
      };
      spec.native_outputs = [this] { return native_outputs(); };
      // a view whose name somebody else has is left out; the nido name itself must be had
      const Status opened = context_.ports.open_port(std::move(spec));
      if (!opened && index == 0) return opened;
      if (opened) views_.push_back(std::move(view));
    }
    return {};
  }

 private:
  void on_readers(std::size_t view, std::size_t readers) {
    (*readers_)[view] = readers;
    bool wanted = false;
    bool modes_wanted = false;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      wanted = wanted || (*readers_)[i] > 0;
      modes_wanted = modes_wanted || ((*readers_)[i] > 0 && views_[i].wants_modes);
    }
    if (poller_) poller_->want(modes_wanted);
    if (wanted) {
      take();
    } else {
      take_no_more();
    }
  }

  void take() {
    if (input_) return;
    const std::string own = own_name(context_.node, name_, ":i");
    const bool pictures = type_.name == "sensor_msgs/msg/Image";
    auto input = pictures ? open_image_input(context_.node, own, profile_,
                                             [this](const ImageView& view, const Arrival& arrival) {
                                               publish_picture(view, arrival.sequence);
                                             })
                          : context_.node.open_raw_input(own, type_.type, profile_,
                                                         profile_ == Profile::kSensor ? 4 : kMessagesKept);
    if (!input) {
      context_.node.log_warning(fmt::format("{}: {}", name_, input.error().message));
      return;
    }
    input_ = std::move(*input);
    if (const Status connected = input_->connect(name_); !connected) {
      context_.node.log_warning(fmt::format("{}: {}", name_, connected.error().message));
    }
    stops_ = false;
    if (!pictures) thread_ = std::thread([this] { forward(); });
  }

  void take_no_more() {
    stops_ = true;
    if (thread_.joinable()) thread_.join();
    input_.reset();
  }

  void forward() {
    const bool newest_only = profile_ == Profile::kSensor;
    while (!stops_) {
      if (!input_->wait_for_message(0.05)) continue;
      while (std::optional<RawReceived> received = newest_only ? input_->take_latest() : input_->take()) {
        if (newest_only && *unsent_ >= kMostUnsent) continue;
        publish(*received);
      }
    }
  }

  void publish(const RawReceived& received) {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if ((*readers_)[i] == 0) continue;
      const View& view = views_[i];
      publish_as(view, std::make_shared<const yarp::Content>(view.content(received.message.get())),
                 received.sequence, view.time_s(received.message.get()));
    }
    note_unsent();
  }

  // all views of a picture show the same
  void publish_picture(const ImageView& view, std::uint64_t sequence) {
    if (*unsent_ >= kMostUnsent || view.encoding != "rgb8" || view.step < view.width * 3 ||
        view.pixels.size() < std::size_t{view.step} * view.height) {
      return;
    }
    const std::shared_ptr<const yarp::Content> content = pictures_->of(view);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if ((*readers_)[i] > 0) {
        publish_as(views_[i], content, sequence, static_cast<double>(view.time.ns) * 1e-9);
      }
    }
    note_unsent();
  }

  void publish_as(const View& view, std::shared_ptr<const yarp::Content> content, std::uint64_t sequence,
                  double time_s) {
    const yarp::Stamp stamp{static_cast<std::int64_t>(sequence & 0x7fffffffU), time_s};
    context_.ports.publish(view.name, std::move(content), yarp::to_text(stamp));
  }

  void note_unsent() {
    ++*unsent_;
    context_.loop.post([unsent = unsent_] { --*unsent; });
  }

  // an input of nido is connected by DDS, whoever asks for it
  bool connect_natively(const std::string& target, bool connect, yarp::PortSpec::Done done) {
    const std::optional<Directory::Owner> owner = context_.directory.owner_of(target);
    if (!owner || owner->port.direction != "input") return false;
    wiring_.add([this, target, connect, done = std::move(done)] {
      constexpr double kTimeout_s = 3.0;
      Status outcome = connect ? context_.directory.connect(name_, target, kTimeout_s)
                               : context_.directory.disconnect(name_, target, kTimeout_s);
      context_.loop.post([done, outcome = std::move(outcome)] { done(outcome); });
    });
    return true;
  }

  std::vector<std::string> native_outputs() const {
    std::vector<std::string> out;
    const std::optional<Directory::Owner> owner = context_.directory.owner_of(name_);
    if (!owner) return out;
    const std::string own = own_name(context_.node, name_, ":i");
    for (const ConnectionCounters& connection : owner->port.connections) {
      if (connection.source.starts_with('/') && connection.source != own) out.push_back(connection.source);
    }
    return out;
  }

  BridgeContext& context_;
  const std::string name_;
  const AnyType& type_;
  const Profile profile_;
  std::unique_ptr<ModePoller> poller_;
  std::vector<View> views_;
  std::unique_ptr<std::array<std::atomic<std::size_t>, 4>> readers_;  // of each view
  std::shared_ptr<std::atomic<int>> unsent_ = std::make_shared<std::atomic<int>>(0);
  const std::shared_ptr<Pictures> pictures_ = std::make_shared<Pictures>();
  std::unique_ptr<RawInput> input_;
  std::atomic<bool> stops_ = false;
  std::thread thread_;
  Worker wiring_;
};

}  // namespace

std::string own_name(const Node& node, const std::string& name, const std::string& end) {
  std::string stem = name;
  if (const std::size_t colon = stem.rfind(':'); colon != std::string::npos) {
    stem = stem.substr(0, colon) + "_" + stem.substr(colon + 1);
  }
  return "/" + node.options().name + stem + end;
}

Result<std::unique_ptr<Bridge>> bridge_output(BridgeContext& context, const PortDescription& port) {
  const AnyType* type = find_any_type(port.type);
  if (type == nullptr) {
    return Error{ErrorCode::kUnsupported, fmt::format("{}: type {} is not known here", port.name, port.type)};
  }
  const Result<Profile> profile = profile_from_string(port.profile);
  if (!profile) return profile.error();
  auto bridge = std::make_unique<OutputBridge>(context, port, *type, *profile);
  if (Status opened = bridge->open(); !opened) return opened.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

}  // namespace nido::gateway
