#include "guarded_transport.h"

#include <fastdds/rtps/common/Locator.h>
#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <memory>
#include <mutex>
#include <set>

namespace nido {

namespace {

namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;

// what the chaining base class wants to be made from
struct Chain final : transport::ChainingTransportDescriptor {
  explicit Chain(std::shared_ptr<transport::TransportDescriptorInterface> low)
      : ChainingTransportDescriptor(std::move(low)) {}
  [[nodiscard]] transport::TransportInterface* create_transport() const override { return nullptr; }
};

class GuardedTransport final : public transport::ChainingTransport {
 public:
  explicit GuardedTransport(std::shared_ptr<transport::TransportDescriptorInterface> low)
      : ChainingTransport(Chain(std::move(low))) {}

  bool OpenOutputChannel(transport::SendResourceList& resources, const rtps::Locator_t& locator) override {
    const std::lock_guard lock(mutex_);
    if (!low_level_transport_->OpenOutputChannel(low_resources_, locator)) {
      return false;
    }
    opened_.insert(locator);
    for (; wrapped_ < low_resources_.size(); ++wrapped_) {
      resources.push_back(std::make_unique<Resource>(*this, *low_resources_[wrapped_]));
    }
    return true;
  }
  bool OpenInputChannel(const rtps::Locator_t& locator, transport::TransportReceiverInterface* receiver,
                        std::uint32_t most_bytes) override {
    return low_level_transport_->OpenInputChannel(locator, receiver, most_bytes);
  }
  void shutdown() override { low_level_transport_->shutdown(); }
  transport::TransportDescriptorInterface* get_configuration() override {
    return low_level_transport_->get_configuration();
  }

  // of the base class, not used: the resources and receivers above are
  bool send(rtps::SenderResource* low, const rtps::octet* data, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& deadline) override {
    return low->send(data, size, begin, end, deadline);
  }
  void receive(transport::TransportReceiverInterface* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    next->OnDataReceived(data, size, local, remote);
  }

 private:
  void open_if_new(const rtps::Locator_t& locator) {
    if (!opened_.contains(locator) && low_level_transport_->IsLocatorSupported(locator)) {
      low_level_transport_->OpenOutputChannel(low_resources_, locator);
      opened_.insert(locator);
    }
  }

// the library's iterator has no virtual destructor; none is destroyed through its base here
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"
  // Goes through the destinations of a message and opens each one's channel before the transport looks at it.
  class OpeningIterator final : public rtps::LocatorsIterator {
   public:
    OpeningIterator(GuardedTransport& owner, rtps::LocatorsIterator& inner) : owner_(owner), inner_(inner) {}
    rtps::LocatorsIterator& operator++() override {
      ++inner_;
      return *this;
    }
    bool operator==(const rtps::LocatorsIterator& other) const override { return inner_ == other; }
    bool operator!=(const rtps::LocatorsIterator& other) const override { return inner_ != other; }
    const rtps::Locator_t& operator*() const override {
      const rtps::Locator_t& locator = *inner_;
      owner_.open_if_new(locator);
      return locator;
    }

   private:
    GuardedTransport& owner_;
    rtps::LocatorsIterator& inner_;
  };

#pragma GCC diagnostic pop

  class Resource final : public rtps::SenderResource {
   public:
    Resource(GuardedTransport& owner, rtps::SenderResource& low) : SenderResource(low.kind()), low_(low) {
      send_lambda_ = [&owner, &low](const rtps::octet* data, std::uint32_t size,
                                    rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
                                    const std::chrono::steady_clock::time_point& deadline) {
        const std::lock_guard lock(owner.mutex_);
        OpeningIterator opening(owner, *begin);
        return low.send(data, size, &opening, end, deadline);
      };
    }
    void add_locators_to_list(rtps::LocatorList_t& locators) const override {
      low_.add_locators_to_list(locators);
    }

   private:
    rtps::SenderResource& low_;
  };

  // One sends or opens at a time. The participant has a lock of its own for that, so nobody waits here; but
  // that is a habit of the library and no promise.
  std::mutex mutex_;
  transport::SendResourceList low_resources_;
  std::size_t wrapped_ = 0;
  std::set<rtps::Locator_t> opened_;
};

}  // namespace

transport::TransportInterface* GuardedUdpDescriptor::create_transport() const {
  return new GuardedTransport(std::make_shared<transport::UDPv4TransportDescriptor>(*this));
}

}  // namespace nido
