#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/yarp/event_loop.h"
#include "nido/yarp/names.h"
#include "nido/yarp/stream.h"

namespace nido::yarp {

// What an output gives: one object that many connections send, encoded once for each notation that is asked
// for. For the loop's thread, once published.
class Content {
 public:
  explicit Content(Bottle bottle) : bottle_(std::move(bottle)) {}
  // An object that is bytes already, the same in both dialects: an image.
  static Content of_bytes(std::string bytes);
  // A vector of numbers, without the detour over a Bottle for dialect 3.
  [[nodiscard]] const std::string& bytes(Dialect dialect) const;
  [[nodiscard]] const std::string& text() const;
  // The bytes of one that was made of bytes, to be written anew: nobody else may hold it.
  [[nodiscard]] std::string& refill();

 private:
  Content() = default;
  std::optional<Bottle> bottle_;
  mutable std::optional<std::string> encoded_[2];
  mutable std::optional<std::string> text_;
};

// A message that came for a port.
struct Incoming {
  std::string bytes;  // the object, or a line when is_text
  bool is_text = false;
  std::string envelope;  // "seq seconds", or empty
  std::string sender;    // "/writer", "anon"
  bool wants_reply = false;
  Dialect dialect = Dialect::k3;  // that the sender spoke last
  // As long as the connection is there: expires when the sender ends it or dies. Empty for datagrams, which
  // tell nothing of it.
  std::weak_ptr<const void> connection{};
  // Its content, whatever the notation. kInvalidArgument says what is wrong with it.
  [[nodiscard]] Result<Decoded> content() const;
  // To be called once, from any thread: the sender is not listened to before. Nothing: no reply.
  std::function<void(std::optional<Bottle>)> answer;
  // Its part of the host's memory, given back with the last copy of this message.
  std::shared_ptr<const void> held{};
};

// One port of this process, as YARP sees it.
struct PortSpec {
  std::string name;
  bool gives = false;   // has outputs
  bool takes = false;   // reads messages
  std::string about;    // one line for people
  StreamLimits limits;  // of messages to it
  // Messages that a slow connection lets wait. The newest one wins; when more wait, the oldest go.
  std::size_t queue = 1;
  std::function<void(Incoming)> on_message;
  // How many connections there are to send to; called at every change.
  std::function<void(std::size_t)> on_readers;
  // How many ports are connected to this one to write; called at every change.
  std::function<void(std::size_t)> on_writers;
  // Connections that are made in another way than YARP's (both ends are ours): `[add]` and `[del]` ask here
  // first. Nothing: the ordinary way.
  using Done = std::function<void(Status)>;
  std::function<bool(const std::string& target, bool connect, Done done)> connect_natively;
  std::function<std::vector<std::string>()> native_outputs;
};

struct PortHostOptions {
  std::string host = "127.0.0.1";  // listened on and announced; a loopback address, or any with a secret
  // Shown by both ends of every connection before anything is taken (secret_handshake.h); empty: none.
  std::string secret{};
  // Other computers may connect, and are connected to: only for ports that take no commands, since there is
  // no secret between the two ends.
  bool network = false;
  std::string names_host{};  // of the name server that is registered at; empty: host
  int names_port = 10000;    // name server
  // Serve names here; or register at the server that answers there.
  enum class Names { kServe, kRegister } names = Names::kServe;
  int first_port = 0;              // of the ports: counted up from here; 0: the system chooses
  Dialect dialect = Dialect::k3;   // spoken where nobody has spoken yet
  std::size_t connections = 1000;  // at most, in and out, of all ports
  // Bytes of messages that have come in part or wait to be sent, of all connections together: beyond it the
  // connection that keeps most is ended. As many again may wait to be worked on.
  std::size_t memory = 64 << 20;
  double handshake_s = 10;  // time to say what one wants
  double connect_s = 3;     // time for a connection to another port
  std::function<void(const std::string&)> log = [](const std::string&) {};
};

// Ports that speak YARP's protocol on one event loop. For the loop's thread, except publish().
class PortHost {
 public:
  static Result<std::unique_ptr<PortHost>> open(EventLoop& loop, PortHostOptions options);
  virtual ~PortHost() = default;

  // Listens and registers. kTaken if this host has the name already.
  virtual Status open_port(PortSpec spec) = 0;
  virtual void close_port(const std::string& name) = 0;
  [[nodiscard]] virtual bool has_port(const std::string& name) const = 0;
  // TCP port on which a port listens; 0 if there is no such port.
  [[nodiscard]] virtual int number_of(const std::string& name) const = 0;

  // Sends to all connections of an output. From any thread.
  virtual void publish(const std::string& name, std::shared_ptr<const Content> content,
                       std::string envelope) = 0;
  // Connects an output of this host, as `[add]` does.
  virtual void connect(const std::string& output, const std::string& target, Carrier carrier,
                       std::function<void(Status)> done) = 0;
  // Asks the name server.
  virtual void find(const std::string& name, std::function<void(std::optional<Contact>)> done) = 0;

  struct Figures {
    std::size_t ports = 0;
    std::size_t connections = 0;
    std::uint64_t refused = 0;  // connections that broke a rule
    std::uint64_t lost = 0;     // messages that a slow connection did not get
    std::size_t held = 0;       // bytes that messages take now
  };
  [[nodiscard]] virtual Figures figures() const = 0;
};

}  // namespace nido::yarp
