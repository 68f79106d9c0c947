// Who listens for lanes, and brings each to its output.
#include <sys/epoll.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <map>

#include "lane_writer.h"

namespace nido {

namespace {

// how long nobody is taken in when there were no files for one more
constexpr auto kPause = std::chrono::milliseconds(100);

}  // namespace

// The listening socket, and those that have connected but not said hello yet.
class LaneServer::Listener final : public LaneLoop::Served, public std::enable_shared_from_this<Listener> {
 public:
  Listener(std::shared_ptr<LaneLoop> loop, Fd fd) : loop_(std::move(loop)), fd_(std::move(fd)) {}
  bool start() {
    id_ = loop_->add(fd_.get(), shared_from_this(), EPOLLIN);
    return id_ != 0;
  }
  void stop();
  void on_ready(std::uint32_t /*epoll_events*/) override;
  void introduce(const std::shared_ptr<Guest>& guest, const FrameHeader& hello);
  void forget(const std::shared_ptr<Guest>& guest);
  void enter(const std::shared_ptr<LaneWriter>& writer);
  void leave(const Guid& writer);

 private:
  const std::shared_ptr<LaneLoop> loop_;
  const Fd fd_;
  std::uint64_t id_ = 0;
  std::mutex mutex_;
  std::map<Guid, std::weak_ptr<LaneWriter>> writers_;
  std::vector<std::shared_ptr<Guest>> guests_;
};

// Somebody who has connected and not said hello yet.
class LaneServer::Guest final : public LaneLoop::Served, public std::enable_shared_from_this<Guest> {
 public:
  Guest(std::weak_ptr<Listener> host, std::shared_ptr<LaneLoop> loop, Fd socket)
      : fd(std::move(socket)), host_(std::move(host)), loop_(std::move(loop)) {}
  bool start() {
    id_ = loop_->add(fd.get(), shared_from_this(), EPOLLIN);
    return id_ != 0;
  }
  void on_ready(std::uint32_t /*epoll_events*/) override {
    FrameHeader hello;
    const ssize_t size = recv(fd.get(), &hello, sizeof hello, MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
      return;
    }
    loop_->remove(id_, fd.get());
    const auto host = host_.lock();
    if (!host) {
      return;
    }
    if (size == static_cast<ssize_t>(sizeof hello) && hello.kind == FrameKind::kHello) {
      host->introduce(shared_from_this(), hello);
    }
    host->forget(shared_from_this());
  }
  Fd fd;

 private:
  const std::weak_ptr<Listener> host_;
  const std::shared_ptr<LaneLoop> loop_;
  std::uint64_t id_ = 0;
};

void LaneServer::Listener::stop() { loop_->remove(id_, fd_.get()); }

void LaneServer::Listener::on_ready(std::uint32_t /*epoll_events*/) {
  for (;;) {
    Fd fd(accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd.is_open()) {
      if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
        // no more files: the others wait at the door until there are
        loop_->change(id_, fd_.get(), 0);
        loop_->post([self = shared_from_this()] { self->loop_->change(self->id_, self->fd_.get(), EPOLLIN); },
                    kPause);
      }
      return;
    }
    auto guest = std::make_shared<Guest>(weak_from_this(), loop_, std::move(fd));
    {
      const std::lock_guard lock(mutex_);
      guests_.push_back(guest);
    }
    if (!guest->start()) {
      forget(guest);
    }
  }
}

void LaneServer::Listener::forget(const std::shared_ptr<Guest>& guest) {
  const std::lock_guard lock(mutex_);
  std::erase(guests_, guest);
}

void LaneServer::Listener::introduce(const std::shared_ptr<Guest>& guest, const FrameHeader& hello) {
  const Guid writer = unpack_guid(hello.writer);
  const Guid reader = unpack_guid(hello.reader);
  std::shared_ptr<LaneWriter> host;
  {
    const std::lock_guard lock(mutex_);
    const auto found = writers_.find(writer);
    if (found == writers_.end()) {
      return;  // gone, or still being made: it asks again
    }
    host = found->second.lock();
  }
  if (host) {
    host->adopt(std::move(guest->fd), reader);
  }
}

void LaneServer::Listener::enter(const std::shared_ptr<LaneWriter>& writer) {
  const std::lock_guard lock(mutex_);
  writers_[writer->guid()] = writer;
}

void LaneServer::Listener::leave(const Guid& writer) {
  const std::lock_guard lock(mutex_);
  writers_.erase(writer);
}

std::unique_ptr<LaneServer> LaneServer::open(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) {
  const LaneAddress address(prefix);
  Fd fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd.is_open() || bind(fd.get(), address.get(), address.length) != 0 || listen(fd.get(), 4096) != 0) {
    return nullptr;
  }
  auto self = closed();
  if (!self) {
    return nullptr;
  }
  self->listener_ = std::make_shared<Listener>(self->sending_, std::move(fd));
  return self->listener_->start() ? std::move(self) : nullptr;
}

std::unique_ptr<LaneServer> LaneServer::closed() {
  std::unique_ptr<LaneServer> self(new LaneServer());
  return self->sending_->is_running() && self->receiving_->is_running() ? std::move(self) : nullptr;
}

LaneServer::~LaneServer() {
  if (listener_) {
    listener_->stop();
  }
  sending_->stop();
  receiving_->stop();
}

void LaneServer::enter(const std::shared_ptr<LaneWriter>& writer) {
  if (listener_) {
    listener_->enter(writer);
  }
}
void LaneServer::leave(const Guid& writer) {
  if (listener_) {
    listener_->leave(writer);
  }
}

std::string here() {
  static const std::string place = [] {
    std::string boot;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
    std::array<char, 64> space{};
    // what is not there is alike for all, and sockets of another place cannot be reached
    [[maybe_unused]] const ssize_t size = readlink("/proc/self/ns/net", space.data(), space.size() - 1);
    const std::string net(space.data());
    const auto begin = net.find('[');
    return boot.substr(0, 8) + "-" +
           (begin == std::string::npos ? "" : net.substr(begin + 1, net.find(']') - begin - 1));
  }();
  return place;
}

}  // namespace nido
