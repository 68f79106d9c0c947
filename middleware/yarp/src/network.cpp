#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "nido/yarp/devices.h"
#include "nido/yarp/names.h"
#include "nido/yarp/port_host.h"
#include "nido/yarp/secret_handshake.h"
#include "remote_stamps.h"
#include "sockets.h"

namespace nido::yarp {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kRetry = std::chrono::milliseconds(500);  // between attempts to connect

// One connection on which questions are asked, blocking. Not thread-safe.
class Asker {
 public:
  // `secret`: that both ends show each other first; empty: none.
  Asker(Carrier carrier, double timeout_s, std::string secret)
      : carrier_(carrier), timeout_s_(timeout_s), secret_(std::move(secret)) {}

  Status open(const std::string& host, int port, const std::string& name) {
    if (Status connected = connect(host, port); !connected) return connected;
    answers_ = AnswerReader(carrier_, 16 << 20);
    if (Status sent = send(greeting(carrier_, name)); !sent) return sent;
    for (;;) {
      const auto welcome = answers_.welcome();
      if (!welcome) return welcome.error();
      if (*welcome) return {};
      if (Status got = receive(); !got) return got;
    }
  }
  [[nodiscard]] bool is_open() const { return fd_.is_open(); }
  void close() { fd_.reset(); }

  Result<Bottle> ask(const std::string& framed) {
    deadline_ =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s_));
    if (Status sent = send(framed); !sent) return sent.error();
    Bottle reply;
    for (;;) {
      auto found = answers_.reply(Dialect::k3);
      if (!found) return found.error();
      if (*found) {
        reply = std::move((*found)->bottle);
        break;
      }
      if (Status got = receive(); !got) return got.error();
    }
    for (;;) {
      const Result<bool> acknowledged = answers_.ack();
      if (!acknowledged) return acknowledged.error();
      if (*acknowledged) return reply;
      if (Status got = receive(); !got) return got.error();
    }
  }

  // lines up to the end mark of a name server
  Result<std::vector<std::string>> ask_names(const std::string& host, int port, const std::string& request) {
    if (Status connected = connect(host, port); !connected) return connected.error();
    if (Status sent = send("NAME_SERVER " + request + "\n"); !sent) return sent.error();
    std::string text;
    std::vector<std::string> lines;
    for (;;) {
      char bytes[4096];
      if (!wait(POLLIN)) return no_answer();
      const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
      if (count <= 0) return Error{ErrorCode::kNotFound, "the name server closed the connection"};
      text.append(bytes, static_cast<std::size_t>(count));
      for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
        std::string line = text.substr(0, end);
        text.erase(0, end + 1);
        if (line.starts_with(kEndOfAnswer)) return lines;
        lines.push_back(std::move(line));
      }
      constexpr std::size_t kMost = 1 << 20;
      if (text.size() + lines.size() > kMost)
        return Error{ErrorCode::kFailed, "the name server's answer has no end"};
    }
  }

 private:
  // To the end of the handshake.
  Status connect(const std::string& host, int port) {
    deadline_ =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s_));
    Result<Fd> fd = connect_tcp(host, port);
    if (!fd) return fd.error();
    fd_ = std::move(*fd);
    if (!wait(POLLOUT)) return no_answer();
    if (Status outcome = connect_outcome(fd_.get()); !outcome) return outcome;
    if (secret_.empty()) return {};
    SecretHandshake handshake(secret_, SecretHandshake::End::kConnects);
    std::string told;
    while (!handshake.is_done()) {
      // the far end says nothing more before it is greeted, so all of it is of the handshake
      char bytes[256];
      if (!wait(POLLIN)) {
        return Error{ErrorCode::kTimeout, "the far side shows no secret: has it an auth.conf, too?"};
      }
      const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
      if (count <= 0) {
        return Error{ErrorCode::kNotFound, "the far side closed the connection: is its secret another one?"};
      }
      told.append(bytes, static_cast<std::size_t>(count));
      std::string proof;
      if (Status shown = handshake.feed(told, proof); !shown) return shown;
      if (Status sent = send(proof); !sent) return sent;
    }
    return {};
  }
  static Error no_answer() { return {ErrorCode::kTimeout, "no answer in time"}; }
  bool wait(short events) {
    for (;;) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
      pollfd entry{fd_.get(), events, 0};
      const int ready = poll(&entry, 1, left < 0 ? 0 : static_cast<int>(left));
      if (ready > 0) return true;
      if (ready == 0 || errno != EINTR) return false;
    }
  }
  Status send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count < 0 && errno == EAGAIN) {
        if (!wait(POLLOUT)) return no_answer();
        continue;
      }
      if (count < 0) return Error{ErrorCode::kNotFound, "the far side closed the connection"};
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return {};
  }
  Status receive() {
    char bytes[16 * 1024];
    if (!wait(POLLIN)) return no_answer();
    const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
    if (count <= 0) return Error{ErrorCode::kNotFound, "the far side closed the connection"};
    answers_.feed(std::string_view(bytes, static_cast<std::size_t>(count)));
    return {};
  }

  Carrier carrier_;
  double timeout_s_;
  std::string secret_;
  Fd fd_;
  AnswerReader answers_{Carrier::kTcp};
  Clock::time_point deadline_;
};

class NetworkImpl final : public Network, public std::enable_shared_from_this<NetworkImpl> {
 public:
  explicit NetworkImpl(NetworkOptions options) : options_(std::move(options)) {}

  ~NetworkImpl() override {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    if (keeper_.joinable()) keeper_.join();
    if (loop_) loop_->stop();
    if (sockets_.joinable()) sockets_.join();
  }

  Status open() {
    auto loop = EventLoop::create();
    if (!loop) return loop.error();
    loop_ = std::move(*loop);
    Asker names(Carrier::kTcp, options_.timeout_s, options_.secret);
    const auto known = names.ask_names(options_.names_host, options_.names_port, "query /root");
    if (!known) {
      return Error{ErrorCode::kNotFound,
                   fmt::format("no name server of YARP on {}:{}: {}", options_.names_host,
                               options_.names_port, known.error().message)};
    }
    PortHostOptions ports;
    ports.host = options_.own_host;
    ports.secret = options_.secret;
    ports.network = !is_loopback(options_.own_host) && options_.secret.empty();
    ports.names_host = options_.names_host;
    ports.names_port = options_.names_port;
    ports.names = PortHostOptions::Names::kRegister;
    ports.log = options_.log;
    auto host = PortHost::open(*loop_, ports);
    if (!host) return host.error();
    host_ = std::move(*host);
    sockets_ = std::thread([this] { loop_->run(); });
    keeper_ = std::thread([this] { keep_connected(); });
    return {};
  }

  Result<std::unique_ptr<Subscription>> subscribe(const std::string& remote, const std::string& local,
                                                  std::size_t longest_message,
                                                  OnMessage on_message) override {
    PortSpec spec;
    spec.name = options_.local + local;
    spec.takes = true;
    spec.about = "takes from " + remote;
    spec.limits.message = longest_message;
    auto handler = std::make_shared<OnMessage>(std::move(on_message));
    spec.on_message = [handler](Incoming incoming) {
      if (!incoming.is_text) (*handler)(incoming.bytes, incoming.envelope);
      incoming.answer(std::nullopt);
    };
    return keep<Subscription>(std::move(spec), remote, local, true);
  }

  Result<std::unique_ptr<Stream>> stream_to(const std::string& remote, const std::string& local) override {
    PortSpec spec;
    spec.name = options_.local + local;
    spec.gives = true;
    spec.about = "gives to " + remote;
    spec.queue = 64;
    return keep<Stream>(std::move(spec), remote, local, false);
  }

  std::int64_t to_own_clock(std::int64_t remote_ns, std::int64_t now_ns) override {
    const std::lock_guard lock(clock_mutex_);
    const std::int64_t followed_ns = followed_.to_own(remote_ns, now_ns);
    if (!followed_.is_started()) return clock_offset_.to_own(remote_ns, now_ns);
    time_came_.notify_all();
    return followed_ns;
  }

  void follow_time(std::int64_t now_ns) override {
    const std::lock_guard lock(clock_mutex_);
    followed_.start(now_ns);
  }

  std::int64_t wait_for_time(std::int64_t own_ns, double timeout_s) override {
    std::unique_lock lock(clock_mutex_);
    time_came_.wait_for(lock, std::chrono::duration<double>(timeout_s),
                        [&] { return followed_.newest_own_ns() >= own_ns; });
    return followed_.newest_own_ns();
  }

  Result<Bottle> ask(const std::string& remote, const Bottle& request) override {
    std::shared_ptr<Line> line;
    {
      const std::lock_guard lock(lines_mutex_);
      std::shared_ptr<Line>& known = lines_[remote];
      if (!known) known = std::make_shared<Line>(options_);
      line = known;
    }
    const std::lock_guard lock(line->mutex);
    const std::string framed = message(Carrier::kTcp, encode(request, Dialect::k3), {}, true);
    for (const bool first : {true, false}) {
      const bool fresh = !line->asker.is_open();
      if (fresh) {
        const Result<Contact> contact = look_up(remote);
        if (!contact) return contact.error();
        if (Status opened = line->asker.open(contact->host, contact->port, "anon_rpc"); !opened) {
          line->asker.close();
          return Error{opened.error().code, remote + ": " + opened.error().message};
        }
      }
      Result<Bottle> reply = line->asker.ask(framed);
      if (reply) return reply;
      line->asker.close();
      // a connection that had gone before is no answer yet
      if (fresh || !first || reply.error().code == ErrorCode::kTimeout) {
        return Error{reply.error().code, remote + ": " + reply.error().message};
      }
    }
    return Error{ErrorCode::kNotFound, remote + ": no answer"};
  }

 private:
  struct Line {
    explicit Line(const NetworkOptions& options) : asker(Carrier::kTcp, options.timeout_s, options.secret) {}
    std::mutex mutex;
    Asker asker;
  };
  // a connection that is to be there
  struct Wanted {
    std::string remote;
    std::string local;     // with the network's name
    bool incoming = true;  // from there to here
    std::atomic<bool> live = false;
    std::atomic<bool> told = false;
  };

  class Kept final : public Subscription, public Stream {
   public:
    Kept(std::shared_ptr<NetworkImpl> network, std::shared_ptr<Wanted> wanted)
        : network_(std::move(network)), wanted_(std::move(wanted)) {}
    ~Kept() override { network_->forget(wanted_); }
    Status send(Bottle bottle) override {
      if (!wanted_->live) return Error{ErrorCode::kNotFound, wanted_->remote + " is not connected"};
      network_->host_->publish(wanted_->local, std::make_shared<const Content>(std::move(bottle)), {});
      return {};
    }

    void flush() override {
      (void)network_->on_loop([] { return Status(); });
    }

   private:
    std::shared_ptr<NetworkImpl> network_;
    std::shared_ptr<Wanted> wanted_;
  };

  template <class Kind>
  Result<std::unique_ptr<Kind>> keep(PortSpec spec, const std::string& remote, const std::string&,
                                     bool incoming) {
    auto wanted = std::make_shared<Wanted>();
    wanted->remote = remote;
    wanted->local = spec.name;
    wanted->incoming = incoming;
    const auto note = [wanted](std::size_t connections) { wanted->live = connections > 0; };
    if (incoming) {
      spec.on_writers = note;
    } else {
      spec.on_readers = note;
    }
    Status opened = on_loop([&] { return host_->open_port(std::move(spec)); });
    if (!opened) return opened.error();
    {
      const std::lock_guard lock(mutex_);
      wanted_.insert(wanted);
    }
    changed_.notify_all();
    auto kept = std::make_unique<Kept>(shared_from_this(), wanted);
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(options_.timeout_s));
    while (!wanted->live) {
      if (Clock::now() > end) {
        return Error{ErrorCode::kNotFound,
                     fmt::format("{} cannot be connected: is it on the name server {}:{}?", remote,
                                 options_.names_host, options_.names_port)};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return std::unique_ptr<Kind>(std::move(kept));
  }

  void forget(const std::shared_ptr<Wanted>& wanted) {
    {
      const std::lock_guard lock(mutex_);
      wanted_.erase(wanted);
    }
    (void)on_loop([&] {
      host_->close_port(wanted->local);
      return Status();
    });
  }

  template <class Work>
  Status on_loop(Work work) {
    std::promise<Status> done;
    loop_->post([&] { done.set_value(work()); });
    return done.get_future().get();
  }

  Result<Contact> look_up(const std::string& name) const {
    Asker names(Carrier::kTcp, options_.timeout_s, options_.secret);
    const auto lines = names.ask_names(options_.names_host, options_.names_port, "query " + name);
    if (!lines) return lines.error();
    const std::optional<Contact> contact = lines->empty() ? std::nullopt : contact_from_line(lines->front());
    if (!contact)
      return Error{ErrorCode::kNotFound, fmt::format("there is no port {} on the YARP network", name)};
    return *contact;
  }

  // makes the connections that are not there, again and again
  void keep_connected() {
    for (;;) {
      std::set<std::shared_ptr<Wanted>> wanted;
      {
        const std::lock_guard lock(mutex_);
        if (ends_) return;
        wanted = wanted_;
      }
      for (const auto& one : wanted) {
        if (!one->live) make(*one);
      }
      std::unique_lock lock(mutex_);
      const std::size_t before = wanted_.size();
      changed_.wait_for(lock, kRetry, [&] { return ends_ || wanted_.size() > before; });
    }
  }

  void make(Wanted& wanted) {
    Status made;
    if (wanted.incoming) {
      made = [&]() -> Status {
        const Result<Contact> contact = look_up(wanted.remote);
        if (!contact) return contact.error();
        Asker admin(Carrier::kTextAck, options_.timeout_s, options_.secret);
        if (Status opened = admin.open(contact->host, contact->port, "admin"); !opened) return opened;
        const Result<Bottle> reply =
            admin.ask(admin_message(Carrier::kTextAck, fmt::format("[add] \"fast_tcp:/{}\"", wanted.local)));
        if (!reply) return reply.error();
        if (!reply->empty() && reply->front().is_integer() && reply->front().integer == 0) return {};
        return Error{ErrorCode::kFailed, to_text(*reply)};
      }();
    } else {
      std::promise<Status> done;
      loop_->post([&] {
        host_->connect(wanted.local, wanted.remote, Carrier::kFastTcp,
                       [&done](const Status& outcome) { done.set_value(outcome); });
      });
      made = done.get_future().get();
    }
    if (!made && !wanted.told.exchange(true)) {
      options_.log(fmt::format("{} is not connected yet: {}", wanted.remote, made.error().message));
    } else if (made && wanted.told.exchange(false)) {
      options_.log(wanted.remote + " is connected again");
    }
  }

  NetworkOptions options_;
  std::unique_ptr<EventLoop> loop_;
  std::unique_ptr<PortHost> host_;
  std::thread sockets_;
  std::thread keeper_;
  std::mutex clock_mutex_;
  ClockOffset clock_offset_;
  FollowedTime followed_;
  std::condition_variable time_came_;
  std::mutex lines_mutex_;
  std::map<std::string, std::shared_ptr<Line>> lines_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<std::shared_ptr<Wanted>> wanted_;
  bool ends_ = false;
};

}  // namespace

Result<std::shared_ptr<Network>> Network::open(NetworkOptions options) {
  auto network = std::make_shared<NetworkImpl>(std::move(options));
  if (Status opened = network->open(); !opened) return opened.error();
  return std::shared_ptr<Network>(std::move(network));
}

}  // namespace nido::yarp
