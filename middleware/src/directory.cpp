#include "nido/middleware/directory.h"

#include <map>
#include <mutex>

#include "nido/middleware/typed_port.h"
#include "node_impl.h"

namespace nido {

namespace {

NodeDescription from_message(msgs::NodeInfo& info) {
  NodeDescription node;
  node.name = info.name();
  node.pid = info.pid();
  node.host = info.host();
  node.state = info.state();
  node.detail = info.detail();
  node.parameters = info.parameters();
  for (msgs::PortInfo& from : info.ports()) {
    PortDescription port;
    port.name = from.name();
    port.type = from.type();
    port.direction = from.direction();
    port.profile = from.profile();
    port.written = from.written();
    for (const msgs::ConnectionInfo& connection : from.connections()) {
      port.connections.push_back({connection.source(), connection.live(), connection.received(),
                                  connection.lost(), connection.bytes()});
    }
    node.ports.push_back(std::move(port));
  }
  return node;
}

class DdsDirectory final : public Directory, private ReaderEvents {
 public:
  DdsDirectory(Node& node, std::shared_ptr<Participant> participant)
      : node_(node), participant_(std::move(participant)) {}
  ~DdsDirectory() override { reader_.reset(); }

  Status start() {
    participant_->watch(changes_);
    Quality quality;
    quality.transient_local = true;
    quality.depth = 256;
    auto reader =
        Reader::open(participant_, "rt/nido/nodes", message_type_of<msgs::NodeInfo>(), quality, "", *this);
    if (!reader) {
      return reader.error();
    }
    reader_ = std::move(reader).value();
    return {};
  }

  [[nodiscard]] std::vector<NodeDescription> nodes() const override {
    // a name has one owner: of two lives of a process the later one counts, the other is not forgotten yet
    std::map<std::string, const Life*> by_name;
    const std::lock_guard lock(mutex_);
    for (const auto& entry : lives_) {
      const Life*& newest = by_name[entry.second.node.name];
      if (newest == nullptr || newest->number < entry.second.number) {
        newest = &entry.second;
      }
    }
    std::vector<NodeDescription> all;
    all.reserve(by_name.size());
    for (const auto& entry : by_name) {
      all.push_back(entry.second->node);
    }
    return all;
  }

  [[nodiscard]] std::optional<NodeDescription> node(const std::string& name) const override {
    for (NodeDescription& candidate : nodes()) {
      if (candidate.name == name) {
        return std::move(candidate);
      }
    }
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Owner> owner_of(const std::string& port_name) const override {
    for (const NodeDescription& candidate : nodes()) {
      for (const PortDescription& port : candidate.ports) {
        if (port.name == port_name) {
          return Owner{candidate, port};
        }
      }
    }
    return std::nullopt;
  }

  [[nodiscard]] std::vector<TopicDescription> topics() const override {
    std::map<std::pair<std::string, std::string>, TopicDescription> by_name;
    for (const EndpointInfo& endpoint : participant_->endpoints()) {
      MessageType type;
      type.dds_name = endpoint.dds_type;
      TopicDescription& topic = by_name[{endpoint.topic, endpoint.dds_type}];
      topic.topic = endpoint.topic;
      topic.type = type.ros_name();
      ++(endpoint.is_writer ? topic.writers : topic.readers);
    }
    std::vector<TopicDescription> all;
    for (auto& entry : by_name) {
      all.push_back(std::move(entry.second));
    }
    return all;
  }

  bool wait(const std::function<bool(const Directory&)>& holds, double timeout_s) override {
    return changes_->wait([&] { return holds(*this); }, timeout_s);
  }

  Status connect(const std::string& output_name, const std::string& input_name, double timeout_s) override {
    return ask("connect", output_name, input_name, timeout_s);
  }
  Status disconnect(const std::string& output_name, const std::string& input_name,
                    double timeout_s) override {
    return ask("disconnect", output_name, input_name, timeout_s);
  }

 private:
  Status ask(const std::string& verb, const std::string& output_name, const std::string& input_name,
             double timeout_s) {
    std::optional<Owner> owner;
    const bool found = changes_->wait(
        [&] {
          owner = owner_of(input_name);
          return owner.has_value();
        },
        timeout_s);
    if (!found || owner->port.direction != "input") {
      return Error{ErrorCode::kNotFound, found ? "port " + input_name + " is an " + owner->port.direction +
                                                     " port; messages go from an output to an input"
                                               : "no node has an input port " + input_name +
                                                     "; 'nido port list' shows the ports that are there"};
    }
    auto answer = node_.call("/" + owner->node.name + "/control", verb + " " + output_name + " " + input_name,
                             timeout_s);
    if (!answer) {
      return answer.error();
    }
    if (!answer->starts_with("[ok]")) {
      return Error{verb == "disconnect" ? ErrorCode::kNotFound : ErrorCode::kInvalidArgument,
                   answer->starts_with("[fail] ") ? answer->substr(7) : *answer};
    }
    return {};
  }

  void on_message(std::shared_ptr<void> message, const MessageInfo& info) override {
    {
      const std::lock_guard lock(mutex_);
      const auto [life, is_new] = lives_.try_emplace(info.writer);
      if (is_new) {
        life->second.number = ++lives_seen_;
      }
      life->second.node = from_message(*static_cast<msgs::NodeInfo*>(message.get()));
    }
    changes_->notify();
  }
  void on_matched(const Guid& writer, bool matched) override {
    if (matched) {
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      lives_.erase(writer);
    }
    changes_->notify();
  }

  // A process from its start to its end.
  struct Life {
    NodeDescription node;
    std::uint64_t number = 0;  // in the order of appearance
  };

  Node& node_;
  const std::shared_ptr<Participant> participant_;
  const std::shared_ptr<ChangeSignal> changes_ = std::make_shared<ChangeSignal>();
  mutable std::mutex mutex_;
  std::map<Guid, Life> lives_;  // by their writer
  std::uint64_t lives_seen_ = 0;
  std::unique_ptr<Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<Directory>> Directory::open(Node& node) {
  auto* impl = dynamic_cast<NodeImpl*>(&node);
  if (impl == nullptr) {
    return Error{ErrorCode::kInvalidArgument, "a directory needs a node made by Node::create"};
  }
  auto directory = std::make_unique<DdsDirectory>(node, impl->participant());
  if (auto status = directory->start(); !status) {
    return status.error();
  }
  return std::unique_ptr<Directory>(std::move(directory));
}

}  // namespace nido
