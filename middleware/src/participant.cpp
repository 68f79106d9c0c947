#include "participant.h"

#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <algorithm>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>

#include "guarded_transport.h"
#include "local_transport.h"
#include "user_data.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;

namespace {

dds::DomainParticipantQos participant_qos(const std::string& node_name, int lease_s) {
  dds::DomainParticipantQos qos;
  qos.name("nido/" + node_name);
  qos.transport().use_builtin_transports = false;

  qos.transport().user_transports.push_back(std::make_shared<LocalTransportDescriptor>());
  // for other programs, this machine only
  auto udp = std::make_shared<GuardedUdpDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().user_transports.push_back(udp);

  // discovery over UDP only
  auto& builtin = qos.wire_protocol().builtin;
  rtps::Locator_t unicast;
  rtps::IPLocator::setIPv4(unicast, "127.0.0.1");
  unicast.kind = LOCATOR_KIND_UDPv4;
  unicast.port = 0;
  builtin.metatrafficUnicastLocatorList.push_back(unicast);
  rtps::Locator_t multicast;
  rtps::IPLocator::setIPv4(multicast, "239.255.0.1");
  multicast.kind = LOCATOR_KIND_UDPv4;
  multicast.port = 0;
  builtin.metatrafficMulticastLocatorList.push_back(multicast);
  builtin.avoid_builtin_multicast = false;

  builtin.discovery_config.leaseDuration = {lease_s, 0};
  builtin.discovery_config.leaseDuration_announcementperiod = {0, 500'000'000};
  builtin.discovery_config.initial_announcements.count = 5;
  builtin.discovery_config.initial_announcements.period = {0, 50'000'000};
  return qos;
}

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

  std::shared_ptr<Participant> self(new Participant(domain, node_name));
  self->participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<dds::DomainId_t>(domain), participant_qos(node_name, lease_s), self->listener_.get(),
      dds::StatusMask::none());
  if (self->participant_ == nullptr) {
    return Error{ErrorCode::kFailed, "node " + node_name + " cannot join DDS domain " +
                                         std::to_string(domain) + ": is the loopback interface up?"};
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

dds::Topic* Participant::acquire_topic(const std::string& topic, const MessageType& type) {
  const std::lock_guard lock(topics_mutex_);
  TopicUse& use = topics_[topic];
  if (use.users > 0) {
    if (use.type != type.dds_name) {
      return nullptr;
    }
    ++use.users;
    return use.topic;
  }
  if (participant_->find_type(type.dds_name).empty()) {
    dds::TypeSupport support(type.make_support());
    support.register_type(participant_, type.dds_name);
  }
  use.topic = participant_->create_topic(topic, type.dds_name, dds::TOPIC_QOS_DEFAULT);
  use.type = type.dds_name;
  use.users = use.topic == nullptr ? 0 : 1;
  return use.topic;
}

void Participant::release_topic(dds::Topic* topic) {
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

std::vector<std::pair<Guid, EndpointInfo>> Participant::endpoints_of(const std::string& topic) const {
  const std::lock_guard lock(endpoints_mutex_);
  std::vector<std::pair<Guid, EndpointInfo>> found;
  for (const auto& entry : endpoints_) {
    if (entry.second.topic == topic) {
      found.emplace_back(entry);
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
  }
  endpoints_changed();
}

void Participant::remove_endpoint(const Guid& guid) {
  {
    const std::lock_guard lock(endpoints_mutex_);
    endpoints_.erase(guid);
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

void Participant::keep(std::shared_ptr<void> listener) {
  const std::lock_guard lock(endpoints_mutex_);
  kept_.push_back(std::move(listener));
}

}  // namespace nido
