#include "local_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fastdds/rtps/common/LocatorSelector.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fd.h"

namespace nido {

namespace {

namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;
using Steady = std::chrono::steady_clock;

// what UDP allows: the library cuts messages for the smallest of its transports
constexpr std::uint32_t kLongestMessage = 65500;
constexpr int kSendBuffer_bytes = 4 << 20;
// a process that does not read its messages for so long is not waited for any more, until it reads again
constexpr auto kPatience = std::chrono::milliseconds(100);
// how long nobody is taken in when there were no files for one more
constexpr auto kPause = std::chrono::milliseconds(100);
// bytes of a locator's address: 'U', host number in two, mark
constexpr std::size_t kHostAt = 1;
constexpr std::size_t kMarkAt = 3;
constexpr std::array<rtps::octet, 4> kMark{'n', 'i', 'd', 'o'};

bool is_marked(const rtps::Locator_t& locator) {
  return std::equal(kMark.begin(), kMark.end(), locator.address + kMarkAt);
}

// how the library numbers this host: only its own shared memory transport tells
rtps::Locator_t library_locator() {
  const transport::SharedMemTransportDescriptor descriptor;
  const std::unique_ptr<transport::TransportInterface> plain(descriptor.create_transport());
  rtps::LocatorList_t locators;
  plain->getDefaultUnicastLocators(locators, 1);
  return *locators.begin();
}

struct Address {
  sockaddr_un value{};
  socklen_t length = 0;
  explicit Address(std::uint32_t port) {
    const std::string name = "nido-dds/" + std::to_string(port);
    value.sun_family = AF_UNIX;
    std::memcpy(value.sun_path + 1, name.data(), name.size());
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }
  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&value); }
};

// A thread that delivers messages may not wait for others to read theirs: two could wait for each other.
thread_local bool t_delivers = false;

// One port that is listened at: a thread that delivers what others send there, in the order of each sender.
class Inlet {
 public:
  // Null if another process or participant has the port.
  static std::unique_ptr<Inlet> open(const rtps::Locator_t& locator,
                                     transport::TransportReceiverInterface* receiver) {
    std::unique_ptr<Inlet> self(new Inlet(locator, receiver));
    const Address address(locator.port);
    self->listener_ = Fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    self->events_ = Fd(epoll_create1(EPOLL_CLOEXEC));
    self->end_ = Fd(eventfd(0, EFD_CLOEXEC));
    if (!self->listener_.is_open() || !self->events_.is_open() || !self->end_.is_open() ||
        bind(self->listener_.get(), address.get(), address.length) != 0 ||
        listen(self->listener_.get(), 1024) != 0) {
      return nullptr;
    }
    self->add(self->listener_.get());
    self->add(self->end_.get());
    self->thread_ = std::thread([raw = self.get()] { raw->deliver(); });
    return self;
  }
  ~Inlet() {
    if (thread_.joinable()) {
      const std::uint64_t one = 1;
      // an eventfd takes eight bytes or none
      [[maybe_unused]] const ssize_t written = write(end_.get(), &one, sizeof one);
      thread_.join();
    }
  }
  Inlet(const Inlet&) = delete;
  Inlet& operator=(const Inlet&) = delete;

 private:
  Inlet(const rtps::Locator_t& locator, transport::TransportReceiverInterface* receiver)
      : local_(locator), receiver_(receiver) {
    remote_.kind = LOCATOR_KIND_SHM;
  }
  void add(int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = fd;
    epoll_ctl(events_.get(), EPOLL_CTL_ADD, fd, &event);
  }
  void deliver() {
    t_delivers = true;
    std::array<epoll_event, 32> ready{};
    for (;;) {
      const int count = epoll_wait(events_.get(), ready.data(), static_cast<int>(ready.size()),
                                   is_full_ ? static_cast<int>(kPause.count()) : -1);
      if (std::exchange(is_full_, false)) {
        watch_newcomers(true);
      }
      for (int i = 0; i < count; ++i) {
        const int fd = ready[static_cast<std::size_t>(i)].data.fd;
        if (fd == end_.get()) {
          return;
        }
        if (fd == listener_.get()) {
          accept_all();
        } else {
          read_some(fd);
        }
      }
    }
  }
  void watch_newcomers(bool watched) {
    epoll_event event{};
    event.events = watched ? std::uint32_t{EPOLLIN} : 0U;
    event.data.fd = listener_.get();
    epoll_ctl(events_.get(), EPOLL_CTL_MOD, listener_.get(), &event);
  }
  void accept_all() {
    for (;;) {
      Fd sender(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!sender.is_open()) {
        if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
          // no more files: the others wait at the door until there are
          is_full_ = true;
          watch_newcomers(false);
        }
        return;
      }
      const int fd = sender.get();
      senders_.emplace(fd, std::move(sender));
      add(fd);
    }
  }
  void read_some(int fd) {
    // bounded: the others have their turn too
    for (int round = 0; round < 16; ++round) {
      const ssize_t size = recv(fd, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
        return;
      }
      if (size <= 0) {  // the sender has ended
        // closing is not enough: a process that this one starts has a copy of each file for a moment, and the
        // kernel goes on telling of this one under a number that is somebody else's by then
        epoll_ctl(events_.get(), EPOLL_CTL_DEL, fd, nullptr);
        senders_.erase(fd);
        return;
      }
      receiver_->OnDataReceived(buffer_.data(), static_cast<std::uint32_t>(size), local_, remote_);
    }
  }

  const rtps::Locator_t local_;
  rtps::Locator_t remote_;
  transport::TransportReceiverInterface* const receiver_;
  Fd listener_;
  Fd events_;
  Fd end_;
  std::map<int, Fd> senders_;
  bool is_full_ = false;  // no newcomers for a while
  std::vector<rtps::octet> buffer_ = std::vector<rtps::octet>(kLongestMessage + 64);
  std::thread thread_;
};

// The connections to the ports of others.
class Outlets {
 public:
  void send(std::uint32_t port, const rtps::octet* data, std::uint32_t size, Steady::time_point deadline) {
    const std::lock_guard lock(mutex_);
    // a second time if the process behind the port was started again
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (!outlets_.contains(port)) {
        close_dead();
        if (!connect_to(port, outlets_[port])) {
          outlets_.erase(port);
          return;
        }
      }
      Outlet& outlet = outlets_[port];
      if (try_send(outlet, data, size, deadline)) {
        return;
      }
      outlets_.erase(port);
    }
  }

 private:
  struct Outlet {
    Fd fd;
    bool is_read = true;  // false: it was full for too long
  };

  static bool connect_to(std::uint32_t port, Outlet& outlet) {
    const Address address(port);
    Fd fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    // the kernel gives what its settings allow
    setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer_bytes, sizeof kSendBuffer_bytes);
    if (!fd.is_open() || connect(fd.get(), address.get(), address.length) != 0) {
      return false;
    }
    outlet.fd = std::move(fd);
    return true;
  }
  // Those whose process is gone.
  void close_dead() {
    std::erase_if(outlets_, [](const auto& entry) {
      pollfd end{entry.second.fd.get(), 0, 0};
      return poll(&end, 1, 0) > 0 && (end.revents & POLLHUP) != 0;
    });
  }

  // False when the other end is gone. A message for which there is no room is dropped: what must arrive is
  // asked for again by the protocol above.
  static bool try_send(Outlet& outlet, const rtps::octet* data, std::uint32_t size,
                       Steady::time_point deadline) {
    const int fd = outlet.fd.get();
    for (bool waited = false;;) {
      if (::send(fd, data, size, MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) {
        outlet.is_read = true;
        return true;
      }
      if (errno == EINTR) {
        continue;
      }
      if (errno != EAGAIN) {
        return false;
      }
      if (t_delivers || !outlet.is_read || waited) {
        return true;
      }
      waited = true;
      const auto left = std::min<Steady::duration>(deadline - Steady::now(), kPatience);
      pollfd room{fd, POLLOUT, 0};
      const auto wait_ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
      outlet.is_read = wait_ms > 0 && poll(&room, 1, static_cast<int>(wait_ms)) > 0;
    }
  }

  std::mutex mutex_;
  std::map<std::uint32_t, Outlet> outlets_;
};

class LocalTransport final : public transport::TransportInterface {
 public:
  explicit LocalTransport(const LocalTransportDescriptor& descriptor)
      : TransportInterface(LOCATOR_KIND_SHM), descriptor_(descriptor), library_(library_locator()) {}

  bool init(const rtps::PropertyPolicy* /*properties*/) override { return true; }
  transport::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }
  std::uint32_t max_recv_buffer_size() const override { return kLongestMessage; }
  void shutdown() override {}

  bool IsLocatorSupported(const rtps::Locator_t& locator) const override {
    return locator.kind == LOCATOR_KIND_SHM && is_marked(locator);
  }
  bool is_locator_allowed(const rtps::Locator_t& locator) const override {
    return IsLocatorSupported(locator);
  }
  bool is_local_locator(const rtps::Locator_t& /*locator*/) const override { return true; }
  rtps::Locator_t RemoteToMainLocal(const rtps::Locator_t& remote) const override { return remote; }
  rtps::LocatorList_t NormalizeLocator(const rtps::Locator_t& locator) override {
    rtps::LocatorList_t list;
    list.push_back(locator);
    return list;
  }
  bool DoInputLocatorsMatch(const rtps::Locator_t& left, const rtps::Locator_t& right) const override {
    return left.kind == right.kind && left.port == right.port;
  }
  // from here on the library may take it for one of its own
  bool transform_remote_locator(const rtps::Locator_t& remote, rtps::Locator_t& result) const override {
    if (!IsLocatorSupported(remote) ||
        !std::equal(remote.address, remote.address + kMarkAt, marked(0).address)) {
      return false;
    }
    result = remote;
    std::copy_n(library_.address, kMarkAt, result.address);
    return true;
  }

  bool OpenInputChannel(const rtps::Locator_t& locator, transport::TransportReceiverInterface* receiver,
                        std::uint32_t /*longest*/) override {
    const std::lock_guard lock(inlets_mutex_);
    if (!IsLocatorSupported(locator) || inlets_.contains(locator.port)) {
      return false;
    }
    auto inlet = Inlet::open(locator, receiver);
    if (!inlet) {
      return false;
    }
    inlets_[locator.port] = std::move(inlet);
    return true;
  }
  bool IsInputChannelOpen(const rtps::Locator_t& locator) const override {
    const std::lock_guard lock(inlets_mutex_);
    return IsLocatorSupported(locator) && inlets_.contains(locator.port);
  }
  bool CloseInputChannel(const rtps::Locator_t& locator) override {
    std::unique_ptr<Inlet> closed;
    const std::lock_guard lock(inlets_mutex_);
    const auto found = inlets_.find(locator.port);
    if (found == inlets_.end()) {
      return false;
    }
    closed = std::move(found->second);
    inlets_.erase(found);
    return true;
  }

  bool OpenOutputChannel(transport::SendResourceList& resources, const rtps::Locator_t& locator) override {
    if (!IsLocatorSupported(locator)) {
      return false;
    }
    // one for all ports
    const bool exists = std::any_of(resources.begin(), resources.end(), [](const auto& resource) {
      return dynamic_cast<const Resource*>(resource.get()) != nullptr;
    });
    if (!exists) {
      resources.push_back(std::make_unique<Resource>(*this));
    }
    return true;
  }

  void select_locators(rtps::LocatorSelector& selector) const override {
    auto& entries = selector.transport_starts();
    for (std::size_t i = 0; i < entries.size(); ++i) {
      rtps::LocatorSelectorEntry& entry = *entries[i];
      for (std::size_t j = 0; j < entry.unicast.size() && entry.transport_should_process; ++j) {
        if (IsLocatorSupported(entry.unicast[j]) && !selector.is_selected(entry.unicast[j])) {
          entry.state.unicast.push_back(j);
          selector.select(i);
        }
      }
    }
  }

  void AddDefaultOutputLocator(rtps::LocatorList_t& /*list*/) override {}
  // discovery goes over UDP
  bool getDefaultMetatrafficMulticastLocators(rtps::LocatorList_t& /*list*/,
                                              std::uint32_t /*port*/) const override {
    return false;
  }
  bool getDefaultMetatrafficUnicastLocators(rtps::LocatorList_t& /*list*/,
                                            std::uint32_t /*port*/) const override {
    return false;
  }
  bool getDefaultUnicastLocators(rtps::LocatorList_t& list, std::uint32_t port) const override {
    list.push_back(marked(port));
    return true;
  }
  bool fillMetatrafficMulticastLocator(rtps::Locator_t& /*locator*/, std::uint32_t /*port*/) const override {
    return false;
  }
  bool fillMetatrafficUnicastLocator(rtps::Locator_t& /*locator*/, std::uint32_t /*port*/) const override {
    return false;
  }
  bool configureInitialPeerLocator(rtps::Locator_t& /*locator*/, const rtps::PortParameters& /*ports*/,
                                   std::uint32_t /*domain*/, rtps::LocatorList_t& /*list*/) const override {
    return false;
  }
  bool fillUnicastLocator(rtps::Locator_t& locator, std::uint32_t port) const override {
    locator.port = locator.port == 0 ? port : locator.port;
    return true;
  }

 private:
  class Resource final : public rtps::SenderResource {
   public:
    explicit Resource(LocalTransport& owner) : SenderResource(LOCATOR_KIND_SHM) {
      send_lambda_ = [&owner](const rtps::octet* data, std::uint32_t size, rtps::LocatorsIterator* begin,
                              rtps::LocatorsIterator* end, const Steady::time_point& deadline) {
        for (rtps::LocatorsIterator& it = *begin; it != *end; ++it) {
          if (owner.IsLocatorSupported(*it)) {
            owner.outlets_.send((*it).port, data, size, deadline);
          }
        }
        return true;
      };
    }
  };

  // as others see it
  [[nodiscard]] rtps::Locator_t marked(std::uint32_t port) const {
    rtps::Locator_t locator = library_;
    locator.port = port;
    locator.address[kHostAt] ^= 0xffU;
    locator.address[kHostAt + 1] ^= 0xffU;
    std::copy(kMark.begin(), kMark.end(), locator.address + kMarkAt);
    return locator;
  }

  LocalTransportDescriptor descriptor_;
  const rtps::Locator_t library_;
  Outlets outlets_;
  mutable std::mutex inlets_mutex_;
  std::map<std::uint32_t, std::unique_ptr<Inlet>> inlets_;
};

}  // namespace

LocalTransportDescriptor::LocalTransportDescriptor() {
  maxMessageSize = kLongestMessage;
  segment_size(kLongestMessage);
}

transport::TransportInterface* LocalTransportDescriptor::create_transport() const {
  return new LocalTransport(*this);
}

}  // namespace nido
