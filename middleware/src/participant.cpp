#include "participant.h"

#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <algorithm>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>

#include "guarded_transport.h"
#include "lane_writer.h"
#include "local_transport.h"
#include "nido/middleware/network.h"
#include "security.h"
#include "user_data.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;

namespace {

// Pictures of two cameras come at once; the system gives as much of this as net.core.rmem_max allows.
constexpr std::uint32_t kReceiveBuffer_bytes = 4 << 20;

rtps::Locator_t udp_locator(const std::string& address, std::uint32_t port = 0) {
  rtps::Locator_t locator;
  rtps::IPLocator::setIPv4(locator, address);
  locator.kind = LOCATOR_KIND_UDPv4;
  locator.port = port;
  return locator;
}

// This computer only: discovery by multicast on the loopback interface.
void stay_on_this_computer(dds::DomainParticipantQos& qos) {
  auto udp = std::make_shared<GuardedUdpDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().user_transports.push_back(udp);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficUnicastLocatorList.push_back(udp_locator("127.0.0.1"));
  builtin.metatrafficMulticastLocatorList.push_back(udp_locator("239.255.0.1"));
  builtin.avoid_builtin_multicast = false;
}

// The named computers: discovery by messages to each place where a process may listen.
void talk_to_peers(dds::DomainParticipantQos& qos, const NetworkSettings& network) {
  auto udp = std::make_shared<GuardedUdpDescriptor>();
  udp->interfaceWhiteList.push_back(network.address);
  udp->maxInitialPeersRange = static_cast<std::uint32_t>(network.processes_per_computer);
  udp->maxMessageSize = static_cast<std::uint32_t>(network.largest_packet_bytes);
  udp->receiveBufferSize = kReceiveBuffer_bytes;
  qos.transport().user_transports.push_back(udp);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficUnicastLocatorList.push_back(udp_locator(network.address));
  builtin.avoid_builtin_multicast = true;
  builtin.initialPeersList.push_back(udp_locator(network.address));
  for (const std::string& peer : network.peers) {
    builtin.initialPeersList.push_back(udp_locator(peer));
  }
}

dds::DomainParticipantQos participant_qos(const std::string& node_name, int lease_s,
                                          const std::optional<NetworkSettings>& network) {
  dds::DomainParticipantQos qos;
  qos.name("nido/" + node_name);
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(std::make_shared<LocalTransportDescriptor>());
  // discovery over UDP only; user messages, too, to other computers and programs of others
  if (network) {
    talk_to_peers(qos, *network);
  } else {
    stay_on_this_computer(qos);
  }
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = {lease_s, 0};
  discovery.leaseDuration_announcementperiod = {0, 500'000'000};
  discovery.initial_announcements.count = 5;
  discovery.initial_announcements.period = {0, 50'000'000};
  return qos;
}

// The library may be about to call a listener when its endpoint is deleted, and does not wait for that. It is
// done long before so many others have been made and deleted.
constexpr std::size_t kMostClosed = 256;

std::vector<unsigned char> user_data_of(const dds::UserDataQosPolicy& policy) {
  return {policy.data_vec().begin(), policy.data_vec().end()};
}

template <class Proxy>
EndpointInfo describe(const Proxy& proxy, bool is_writer) {
  EndpointInfo info;
  info.is_writer = is_writer;
  info.topic = proxy.topicName().c_str();
  info.dds_type = proxy.typeName().c_str();
  info.reliable = proxy.m_qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS;
  info.transient_local = proxy.m_qos.m_durability.kind >= dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  unpack_user_data(user_data_of(proxy.m_qos.m_userData), info);
  return info;
}

}  // namespace

class Participant::Listener final : public dds::DomainParticipantListener {
 public:
  explicit Listener(Participant& owner) : owner_(owner) {}

  void on_publisher_discovery(dds::DomainParticipant* /*participant*/,
                              rtps::WriterDiscoveryInfo&& info) override {
    if (info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) {
      owner_.remove_endpoint(info.info.guid());
    } else {
      owner_.add_endpoint(info.info.guid(), describe(info.info, true));
    }
  }
  void on_subscriber_discovery(dds::DomainParticipant* /*participant*/,
                               rtps::ReaderDiscoveryInfo&& info) override {
    if (info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER) {
      owner_.remove_endpoint(info.info.guid());
    } else {
      owner_.add_endpoint(info.info.guid(), describe(info.info, false));
    }
  }

 private:
  Participant& owner_;
};

Participant::Participant(int domain, std::string node_name)
    : domain_(domain), node_name_(std::move(node_name)), listener_(std::make_unique<Listener>(*this)) {}

Result<std::shared_ptr<Participant>> Participant::join(int domain, const std::string& node_name,
                                                       int lease_s) {
  const auto network = network_settings_from_environment();
  if (!network) {
    return network.error();
  }
  if (domain < 0 || domain > 230) {
    return Error{ErrorCode::kInvalidArgument,
                 "DDS domain " + std::to_string(domain) + " is not within 0..230"};
  }
  // NIDO_DDS_LOG=1 shows what the DDS library itself has to say; it is noise to users
  if (std::getenv("NIDO_DDS_LOG") ==
      nullptr) {  // NOLINT(concurrency-mt-unsafe): nobody sets the environment here
    dds::Log::ClearConsumers();
  }
  dds::Log::SetVerbosity(dds::Log::Kind::Error);

  // Between nodes of one process messages take the same way as between processes. The library's short cut
  // loses a message when only one of two ends knows the other yet, and does not send it again.
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);

  dds::DomainParticipantQos qos = participant_qos(node_name, lease_s, *network);
  if (*network && !(*network)->security_folder.empty()) {
    if (auto status = use_keys((*network)->security_folder, node_name, qos); !status) {
      return status.error();
    }
  }
  std::shared_ptr<Participant> self(new Participant(domain, node_name));
  self->is_on_network_ = network->has_value();
  self->repairs_pictures_ = *network && (*network)->repair_pictures;
  self->participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<dds::DomainId_t>(domain), qos, self->listener_.get(), dds::StatusMask::none());
  if (self->participant_ == nullptr) {
    return Error{ErrorCode::kFailed, "node " + node_name + " cannot join DDS domain " +
                                         std::to_string(domain) + ": is the interface of " +
                                         (*network ? (*network)->address : "127.0.0.1") + " up?"};
  }
  self->publisher_ = self->participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  self->subscriber_ = self->participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (self->publisher_ == nullptr || self->subscriber_ == nullptr) {
    return Error{ErrorCode::kFailed, "node " + node_name + " cannot make its DDS publisher and subscriber"};
  }
  return self;
}

Participant::~Participant() {
  if (participant_ != nullptr) {
    participant_->set_listener(nullptr);
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
}

std::shared_ptr<dds::Topic> Participant::topic(const std::string& name, const MessageType& type) {
  const std::lock_guard lock(topics_mutex_);
  const auto give = [this](dds::Topic* topic) {
    return std::shared_ptr<dds::Topic>(topic, [this](dds::Topic* used) { release(used); });
  };
  TopicUse& use = topics_[name];
  if (use.users > 0) {
    if (use.type != type.dds_name) {
      return nullptr;
    }
    ++use.users;
    return give(use.topic);
  }
  if (participant_->find_type(type.dds_name).empty()) {
    dds::TypeSupport support(type.make_support());
    support.register_type(participant_, type.dds_name);
  }
  use.topic = participant_->create_topic(name, type.dds_name, dds::TOPIC_QOS_DEFAULT);
  use.type = type.dds_name;
  use.users = use.topic == nullptr ? 0 : 1;
  return use.topic == nullptr ? nullptr : give(use.topic);
}

void Participant::release(dds::Topic* topic) {
  const std::lock_guard lock(topics_mutex_);
  const auto found = topics_.find(topic->get_name());
  if (found != topics_.end() && --found->second.users == 0) {
    participant_->delete_topic(topic);
    topics_.erase(found);
  }
}

std::optional<EndpointInfo> Participant::endpoint(const Guid& guid) const {
  const std::lock_guard lock(endpoints_mutex_);
  const auto found = endpoints_.find(guid);
  return found == endpoints_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<std::pair<Guid, EndpointInfo>> Participant::writers_of(const std::string& topic) const {
  const std::lock_guard lock(endpoints_mutex_);
  std::vector<std::pair<Guid, EndpointInfo>> found;
  if (const auto writers = writers_.find(topic); writers != writers_.end()) {
    for (const Guid& guid : writers->second) {
      found.emplace_back(*endpoints_.find(guid));
    }
  }
  return found;
}

std::vector<EndpointInfo> Participant::endpoints() const {
  const std::lock_guard lock(endpoints_mutex_);
  std::vector<EndpointInfo> all;
  all.reserve(endpoints_.size());
  for (const auto& entry : endpoints_) {
    all.push_back(entry.second);
  }
  return all;
}

void Participant::add_endpoint(const Guid& guid, const EndpointInfo& info) {
  {
    const std::lock_guard lock(endpoints_mutex_);
    endpoints_[guid] = info;
    if (info.is_writer) {
      writers_[info.topic].insert(guid);
    }
  }
  endpoints_changed();
}

void Participant::remove_endpoint(const Guid& guid) {
  {
    const std::lock_guard lock(endpoints_mutex_);
    const auto gone = endpoints_.find(guid);
    if (gone == endpoints_.end()) {
      return;
    }
    if (const auto writers = writers_.find(gone->second.topic); writers != writers_.end()) {
      writers->second.erase(guid);
      if (writers->second.empty()) {
        writers_.erase(writers);
      }
    }
    endpoints_.erase(gone);
  }
  endpoints_changed();
}

void Participant::endpoints_changed() {
  std::vector<std::shared_ptr<ChangeSignal>> told;
  {
    const std::lock_guard lock(endpoints_mutex_);
    for (const auto& weak : watchers_) {
      if (auto signal = weak.lock()) {
        told.push_back(std::move(signal));
      }
    }
  }
  for (const auto& signal : told) {
    signal->notify();
  }
}

void Participant::watch(const std::shared_ptr<ChangeSignal>& signal) {
  const std::lock_guard lock(endpoints_mutex_);
  std::erase_if(watchers_, [](const auto& weak) { return weak.expired(); });
  watchers_.push_back(signal);
}

void Participant::close(dds::DataWriter* end, std::shared_ptr<void> listener) {
  close_end(end, std::move(listener), [this](dds::DataWriter* gone) { publisher_->delete_datawriter(gone); });
}

void Participant::close(dds::DataReader* end, std::shared_ptr<void> listener) {
  close_end(end, std::move(listener),
            [this](dds::DataReader* gone) { subscriber_->delete_datareader(gone); });
}

template <class End, class Delete>
void Participant::close_end(End* end, std::shared_ptr<void> listener, const Delete& delete_it) {
  const Guid guid = end->guid();
  end->set_listener(nullptr);
  {
    const auto making = one_endpoint_at_a_time();
    delete_it(end);
  }
  remove_endpoint(guid);
  std::shared_ptr<void> oldest;  // goes without the lock
  const std::lock_guard lock(endpoints_mutex_);
  closed_.push_back(std::move(listener));
  if (closed_.size() > kMostClosed) {
    oldest = std::move(closed_.front());
    closed_.pop_front();
  }
}

std::string Participant::lane_place() const {
  const bool is_secure = rtps::PropertyPolicyHelper::find_property(participant_->get_qos().properties(),
                                                                   "dds.sec.auth.plugin") != nullptr;
  return is_secure ? "" : here();
}

std::shared_ptr<LaneServer> Participant::lanes() {
  const std::lock_guard lock(lanes_mutex_);
  if (!lanes_) {
    lanes_ = lane_place().empty() ? LaneServer::closed() : LaneServer::open(participant_->guid().guidPrefix);
  }
  return lanes_;
}

bool Participant::is_near(const Guid& guid) const {
  const std::string place = lane_place();
  if (place.empty()) {
    return false;
  }
  if (guid.guidPrefix == participant_->guid().guidPrefix) {
    return true;
  }
  const std::lock_guard lock(endpoints_mutex_);
  const auto found = endpoints_.find(guid);
  return found != endpoints_.end() && found->second.lane_place == place;
}

}  // namespace nido
