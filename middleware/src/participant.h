#pragma once

#include <deque>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "change_signal.h"
#include "nido/interfaces/result.h"
#include "nido/middleware/raw_port.h"

namespace nido {

namespace dds = eprosima::fastdds::dds;
using Guid = eprosima::fastrtps::rtps::GUID_t;

// A writer or reader that some process of the domain has, as discovered.
struct EndpointInfo {
  bool is_writer = false;
  std::string topic;     // "rt/vision/objects"
  std::string dds_type;  // "nido_msgs::msg::dds_::Percepts_"
  std::string node;      // of nido's endpoints: the node's name
  std::string port;      // of nido's endpoints: the port's name
  std::string profile;   // of nido's endpoints: "sensor", ...
  bool reliable = false;
  bool transient_local = false;
  std::string lane_place;  // of nido's endpoints: where lanes reach them
};

class LaneServer;

// A process's membership in a DDS domain: this machine only, discovery over UDP on loopback (which finds
// restarted processes at once), user traffic over Unix sockets. Thread-safe.
class Participant {
 public:
  // The others forget this process when they have heard nothing of it for lease_s of wall time.
  static Result<std::shared_ptr<Participant>> join(int domain, const std::string& node_name, int lease_s);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] const std::string& node_name() const { return node_name_; }
  [[nodiscard]] int domain() const { return domain_; }

  // A topic with its type registered; shared by all endpoints of this process, which hold it as long as they
  // live. Null when the process uses the topic with another type already.
  std::shared_ptr<dds::Topic> topic(const std::string& name, const MessageType& type);
  [[nodiscard]] dds::Publisher* publisher() const { return publisher_; }
  [[nodiscard]] dds::Subscriber* subscriber() const { return subscriber_; }

  // As the network file says (network.h).
  [[nodiscard]] bool is_on_network() const { return is_on_network_; }
  [[nodiscard]] bool repairs_pictures() const { return repairs_pictures_; }

  // Every endpoint known in the domain, own ones too.
  [[nodiscard]] std::optional<EndpointInfo> endpoint(const Guid& guid) const;
  [[nodiscard]] std::vector<std::pair<Guid, EndpointInfo>> writers_of(const std::string& topic) const;
  [[nodiscard]] std::vector<EndpointInfo> endpoints() const;
  void add_endpoint(const Guid& guid, const EndpointInfo& info);
  void remove_endpoint(const Guid& guid);
  // Told at every change of the endpoints.
  void watch(const std::shared_ptr<ChangeSignal>& signal);

  // The direct way to ports of this machine (lane_wire.h); made at the first call, which is before others can
  // know of any endpoint. Null when there are no sockets.
  std::shared_ptr<LaneServer> lanes();
  // Where lanes can reach this process; empty with DDS-Security, which they would go round.
  [[nodiscard]] std::string lane_place() const;
  // True if a lane can lead to this endpoint: it is nido's, on this machine.
  [[nodiscard]] bool is_near(const Guid& endpoint) const;

  // To be held while an endpoint is made or deleted: Fast DDS 2.9.1 keeps lists of a participant's endpoints
  // (those of its WLP) that two threads may not change at once.
  [[nodiscard]] std::unique_lock<std::mutex> one_endpoint_at_a_time() {
    return std::unique_lock<std::mutex>(making_mutex_);
  }
  // Deletes an endpoint. DDS may still be calling its listener, which is kept until many more have come, or
  // the participant is gone.
  void close(dds::DataWriter* end, std::shared_ptr<void> listener);
  void close(dds::DataReader* end, std::shared_ptr<void> listener);

 private:
  class Listener;
  Participant(int domain, std::string node_name);
  void release(dds::Topic* topic);
  void endpoints_changed();
  template <class End, class Delete>
  void close_end(End* end, std::shared_ptr<void> listener, const Delete& delete_it);

  const int domain_;
  const std::string node_name_;
  bool is_on_network_ = false;
  bool repairs_pictures_ = false;
  std::unique_ptr<Listener> listener_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;

  std::mutex topics_mutex_;
  struct TopicUse {
    dds::Topic* topic = nullptr;
    std::string type;
    int users = 0;
  };
  std::map<std::string, TopicUse> topics_;

  mutable std::mutex endpoints_mutex_;
  std::map<Guid, EndpointInfo> endpoints_;
  std::map<std::string, std::set<Guid>> writers_;  // of these, by topic
  std::vector<std::weak_ptr<ChangeSignal>> watchers_;
  std::deque<std::shared_ptr<void>> closed_;

  std::mutex making_mutex_;
  std::mutex lanes_mutex_;
  std::shared_ptr<LaneServer> lanes_;
};

}  // namespace nido
