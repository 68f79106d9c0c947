#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/msgs/types.h"

namespace nido {

// What is said and what moves in a system, as the page wants it. Log and story are kept from the beginning,
// the last lines of them; joints and touch pads are read only while somebody looks. For one thread.
class Feeds {
 public:
  Feeds(Node& node, std::string story_port);
  ~Feeds();

  // Opens what has appeared, lets go what has gone.
  void follow(const std::vector<NodeDescription>& nodes, bool somebody_looks);
  // Lines of a story that was told before this was made.
  void add_past_story(const nlohmann::json& events);

  // What has come since the last call.
  nlohmann::json new_log();
  nlohmann::json new_story();
  // All that is kept.
  [[nodiscard]] nlohmann::json whole_log() const;
  [[nodiscard]] nlohmann::json whole_story() const;
  // The newest time of /clock; nothing as long as nobody writes it.
  std::optional<double> simulated_s();
  // The newest angles by port, rad; of those that wrote since the last call.
  nlohmann::json joints();
  // The newest state of touch pads by port.
  nlohmann::json touch();

 private:
  template <class T>
  using Inputs = std::map<std::string, std::unique_ptr<Input<T>>>;
  template <class T>
  void follow_ports(const std::vector<NodeDescription>& nodes, const std::string& type, bool wanted,
                    Inputs<T>& inputs, Profile profile, std::size_t depth);
  void take_log();
  void take_story();
  bool add_story(nlohmann::json event);

  Node& node_;
  std::string story_port_;
  std::unique_ptr<Input<msgs::Log>> log_;
  std::unique_ptr<Input<msgs::Clock>> clock_;
  std::optional<double> simulated_s_;
  Inputs<msgs::StageEvent> stories_;
  Inputs<msgs::JointState> joints_;
  Inputs<msgs::Touch> touch_;
  std::deque<nlohmann::json> log_lines_;
  std::uint64_t log_number_ = 0;  // of the last line
  std::uint64_t log_told_ = 0;    // number of the last line that new_log() told
  std::deque<nlohmann::json> story_;
  std::uint64_t story_number_ = 0;
  std::uint64_t story_told_ = 0;
  std::set<std::string> story_known_;
};

}  // namespace nido
