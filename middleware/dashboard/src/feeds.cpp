#include "feeds.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "nido/middleware/typed_port.h"

namespace nido {
namespace {

constexpr std::size_t kLogKept = 2000;
constexpr std::size_t kStoryKept = 500;
constexpr std::size_t kLongestText = 2000;
constexpr std::array<const char*, 4> kLevels = {"debug", "info", "warning", "error"};

double seconds_of(const msgs::Time& time) { return time.sec() + time.nanosec() * 1e-9; }

std::string own_port(const Node& node, std::string port) {
  std::replace(port.begin(), port.end(), ':', '_');
  return "/" + node.options().name + port + ":i";
}

std::string cut(const std::string& text) {
  return text.size() <= kLongestText ? text : text.substr(0, kLongestText) + "...";
}

// Items of a deque whose last has the number `last`, those after `told`.
nlohmann::json since(const std::deque<nlohmann::json>& items, std::uint64_t last, std::uint64_t told) {
  auto list = nlohmann::json::array();
  const std::size_t fresh = static_cast<std::size_t>(std::min<std::uint64_t>(last - told, items.size()));
  for (std::size_t i = items.size() - fresh; i < items.size(); ++i) list.push_back(items[i]);
  return list;
}

}  // namespace

Feeds::Feeds(Node& node, std::string story_port) : node_(node), story_port_(std::move(story_port)) {
  if (auto input = node_.open_input<msgs::Log>(own_port(node_, "/log"), Profile::kEvent, 1024)) {
    log_ = std::move(*input);
    if (const Status status = log_->connect("/log"); !status) node_.log_warning(status.error().message);
  }
  if (auto input = node_.open_input<msgs::Clock>(own_port(node_, "/clock"), Profile::kSensor, 1)) {
    clock_ = std::move(*input);
    if (const Status status = clock_->connect("/clock"); !status) node_.log_warning(status.error().message);
  }
  if (!story_port_.empty()) {
    // kept until the output appears: nothing of the story is missed
    if (auto input = node_.open_input<msgs::StageEvent>(own_port(node_, story_port_), Profile::kEvent, 256)) {
      if (const Status status = (*input)->connect(story_port_); !status)
        node_.log_warning(status.error().message);
      stories_[story_port_] = std::move(*input);
    }
  }
}

Feeds::~Feeds() = default;

template <class T>
void Feeds::follow_ports(const std::vector<NodeDescription>& nodes, const std::string& type, bool wanted,
                         Inputs<T>& inputs, Profile profile, std::size_t depth) {
  if (!wanted) return inputs.clear();
  for (const NodeDescription& node : nodes) {
    for (const PortDescription& port : node.ports) {
      if (port.direction != "output" || port.type != type || inputs.contains(port.name)) continue;
      if (inputs.size() >= 64) return;
      auto input = node_.open_input<T>(own_port(node_, port.name), profile, depth);
      if (!input) continue;
      if (const Status status = (*input)->connect(port.name); !status) continue;
      inputs[port.name] = std::move(*input);
    }
  }
}

void Feeds::follow(const std::vector<NodeDescription>& nodes, bool somebody_looks) {
  follow_ports(nodes, "nido_msgs/msg/StageEvent", true, stories_, Profile::kEvent, 256);
  // the newest is enough: nobody waits for this reader, and nothing is sent to it twice
  follow_ports(nodes, "sensor_msgs/msg/JointState", somebody_looks, joints_, Profile::kSensor, 1);
  follow_ports(nodes, "nido_msgs/msg/Touch", somebody_looks, touch_, Profile::kSensor, 1);
}

void Feeds::take_log() {
  while (log_) {
    const auto line = log_->take();
    if (!line) return;
    const std::size_t level = std::min<std::size_t>(line->level(), kLevels.size() - 1);
    log_lines_.push_back({{"t", seconds_of(line->header().stamp())},
                          {"node", cut(line->node())},
                          {"level", kLevels[level]},
                          {"text", cut(line->text())}});
    ++log_number_;
    if (log_lines_.size() > kLogKept) log_lines_.pop_front();
  }
}

bool Feeds::add_story(nlohmann::json event) {
  const std::string key = event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (!story_known_.insert(key).second) return false;
  if (story_known_.size() > 10 * kStoryKept) story_known_.clear();
  story_.push_back(std::move(event));
  ++story_number_;
  if (story_.size() > kStoryKept) story_.pop_front();
  return true;
}

void Feeds::take_story() {
  for (auto& [port, input] : stories_) {
    while (const auto event = input->take()) {
      add_story({{"t", seconds_of(event->header().stamp())},
                 {"stage", cut(event->stage())},
                 {"state", cut(event->state())},
                 {"object", cut(event->object())},
                 {"text", cut(event->text())}});
    }
  }
}

void Feeds::add_past_story(const nlohmann::json& events) {
  for (const auto& event : events) add_story(event);
}

nlohmann::json Feeds::new_log() {
  take_log();
  auto list = since(log_lines_, log_number_, log_told_);
  log_told_ = log_number_;
  return list;
}

nlohmann::json Feeds::new_story() {
  take_story();
  auto list = since(story_, story_number_, story_told_);
  story_told_ = story_number_;
  return list;
}

nlohmann::json Feeds::whole_log() const { return log_lines_; }
nlohmann::json Feeds::whole_story() const { return story_; }

std::optional<double> Feeds::simulated_s() {
  if (!clock_) return std::nullopt;
  if (const auto tick = clock_->take_latest()) simulated_s_ = seconds_of(tick->clock());
  return simulated_s_;
}

nlohmann::json Feeds::joints() {
  auto parts = nlohmann::json::object();
  for (auto& [port, input] : joints_) {
    if (const auto state = input->take_latest()) parts[port] = state->position();
  }
  return parts;
}

nlohmann::json Feeds::touch() {
  auto pads = nlohmann::json::object();
  for (auto& [port, input] : touch_) {
    if (const auto state = input->take_latest()) {
      // a patch of skin has hundreds of taxels: their sum says enough
      constexpr std::size_t kMostPads = 12;
      if (state->on().size() > kMostPads) {
        const bool any = std::find(state->on().begin(), state->on().end(), true) != state->on().end();
        const double sum_N = std::accumulate(state->force_n().begin(), state->force_n().end(), 0.0);
        pads[port] = {{"on", nlohmann::json::array({any})}, {"force_n", nlohmann::json::array({sum_N})}};
        continue;
      }
      auto on = nlohmann::json::array();
      for (const bool one : state->on()) on.push_back(one);
      pads[port] = {{"on", on}, {"force_n", state->force_n()}};
    }
  }
  return pads;
}

}  // namespace nido
