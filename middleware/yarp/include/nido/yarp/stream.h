#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/yarp/bottle.h"

namespace nido::yarp {

// How bytes travel between two ports.
enum class Carrier { kTcp, kFastTcp, kUdp, kText, kTextAck };
[[nodiscard]] std::string_view to_string(Carrier carrier);
// The name may carry qualifiers ("tcp+send.portmonitor"): they are not looked at.
[[nodiscard]] std::optional<Carrier> carrier_from_string(std::string_view name);
[[nodiscard]] constexpr bool is_text(Carrier carrier) {
  return carrier == Carrier::kText || carrier == Carrier::kTextAck;
}
// Whether the receiver acknowledges each message.
[[nodiscard]] constexpr bool has_ack(Carrier carrier) {
  return carrier == Carrier::kTcp || carrier == Carrier::kTextAck;
}

// What one connection may take of this process. Anything beyond is refused with a sentence.
struct StreamLimits {
  std::size_t message = 1 << 20;   // bytes of one message
  std::size_t blocks = 4096;       // that a message is cut into
  std::size_t line = 64 * 1024;    // characters of a text message, with its continued lines
  std::size_t sender_name = 1000;  // characters, as YARP clamps it
};

// What has come on a connection.
struct Opened {  // the handshake is done
  Carrier carrier = Carrier::kTcp;
  std::string sender;  // "/reader", "anon"
};
struct Data {
  std::string bytes;     // binary carriers: the object; text carriers: the line
  std::string envelope;  // "seq seconds" or whatever the sender put there; may be empty
  bool wants_reply = false;
};
struct Admin {
  std::string bytes;  // as in Data
};
struct Describe {};  // '*'
struct ShowHelp {};  // '?'
struct Reverse {};   // the sender wants to read from now on
struct AddOutput {   // text only: "/port", "!/port", "~/port"
  std::string target;
  enum class What { kConnect, kDisconnectOutput, kDisconnectInput } what = What::kConnect;
};
struct Quit {};
struct NameRequest {  // the connection speaks the name server's protocol
  std::string line;   // without NAME_SERVER
};
struct HttpRequest {
  std::string path;
};
// The connection is of no more use. `farewell` may be sent before it is closed.
struct Refused {
  std::string reason;
  std::string farewell;
};
using Event = std::variant<Opened, Data, Admin, Describe, ShowHelp, Reverse, AddOutput, Quit, NameRequest,
                           HttpRequest, Refused>;

// The receiving end of one connection: bytes in, events out. Knows no sockets. Keeps at most one message plus
// what was fed after it: feed it only as long as hungry() says so. Not thread-safe.
class ReceivingStream {
 public:
  explicit ReceivingStream(const StreamLimits& limits = {}) : limits_(limits) {}

  void feed(std::string_view bytes) { buffer_.append(bytes); }
  // Whether more bytes are wanted before next() has been called again.
  [[nodiscard]] bool hungry() const { return buffer_.size() - at_ < limits_.message + 64 * 1024; }
  // Memory that this connection takes.
  [[nodiscard]] std::size_t held_bytes() const { return buffer_.capacity() + pending_text_.capacity(); }
  // The next event; nothing when more bytes are needed. After Refused and Quit there is nothing more.
  std::optional<Event> next();

  // Forgets a message that has come in part: a new one begins. For datagrams.
  void restart_message();

  [[nodiscard]] bool is_open() const { return state_ != State::kHeader && state_ != State::kSender; }
  [[nodiscard]] Carrier carrier() const { return carrier_; }

  // What is to be sent back.
  // After Opened. `own_port`: for udp the port to send to.
  [[nodiscard]] std::string welcome(const std::string& sender, int own_port) const;
  // After Data and Admin: the reply if one is wanted, and the acknowledgement if this carrier has one.
  [[nodiscard]] std::string answer(const std::optional<Bottle>& reply, Dialect dialect) const;

 private:
  enum class State { kHeader, kSender, kIndex, kPayload, kText, kNames, kHttp, kOver };
  std::optional<Event> read_header();
  std::optional<Event> read_sender();
  std::optional<Event> read_index();
  std::optional<Event> read_payload();
  std::optional<Event> read_text();
  std::optional<Event> read_text_command(std::string line);
  std::optional<Event> read_name_request();
  std::optional<Event> read_http();
  // a line without its end; nothing when it is not complete
  std::optional<std::string> take_line();
  [[nodiscard]] std::string_view rest() const { return std::string_view(buffer_).substr(at_); }
  void take(std::size_t bytes);
  Event refuse(std::string reason, std::string farewell = {});

  StreamLimits limits_;
  State state_ = State::kHeader;
  Carrier carrier_ = Carrier::kTcp;
  std::string buffer_;
  std::size_t at_ = 0;        // first byte not used yet
  std::size_t searched_ = 0;  // of the rest, known to hold no end of line
  std::size_t message_bytes_ = 0;
  std::string pending_command_;  // text: the command whose content comes in the next line
  std::string pending_text_;     // text: lines of a message that goes on
};

// The sending end: what to send, and what the far side is to answer.

// The first bytes of a connection.
[[nodiscard]] std::string greeting(Carrier carrier, const std::string& own_name);
// One message. Binary carriers: `content` is the object; text carriers: a line.
[[nodiscard]] std::string message(Carrier carrier, std::string_view content, std::string_view envelope,
                                  bool wants_reply);
// What stands before the content of a message of a binary carrier.
[[nodiscard]] std::string message_head(std::size_t content_bytes, std::string_view envelope,
                                       bool wants_reply);
// The same as message() for an administrative command.
[[nodiscard]] std::string admin_message(Carrier carrier, std::string_view content);
// The last bytes of a connection.
[[nodiscard]] std::string goodbye(Carrier carrier);

// A YARP number: 'Y' 'A', 32 bits, 'R' 'P'.
[[nodiscard]] std::string yarp_number(std::int32_t value);
[[nodiscard]] std::optional<std::int32_t> parse_yarp_number(std::string_view eight_bytes);

// Reads what a receiver sends back: welcomes, acknowledgements, replies. Bytes in, parts out.
class AnswerReader {
 public:
  explicit AnswerReader(Carrier carrier, std::size_t limit = 1 << 20) : carrier_(carrier), limit_(limit) {}
  void feed(std::string_view bytes) { buffer_.append(bytes); }
  [[nodiscard]] std::size_t buffered() const { return buffer_.size(); }
  // The number in the welcome of binary carriers (udp: where to send), 0 of text carriers.
  Result<std::optional<std::int32_t>> welcome();
  // True when an acknowledgement has come.
  Result<bool> ack();
  // A reply: of binary carriers a Bottle of either dialect, of text carriers a line.
  Result<std::optional<Decoded>> reply(Dialect preferred);

 private:
  std::optional<std::string> take_line();
  Carrier carrier_;
  std::size_t limit_;
  std::string buffer_;
};

// Datagrams of the carrier udp: a message cut into pieces with a checksum and a count each.
[[nodiscard]] std::vector<std::string> to_datagrams(std::string_view message);
// Puts them together again; a piece that is missing or broken drops its message.
class DatagramReader {
 public:
  // The stream's bytes that this datagram completes or continues; empty when it was not used. `restarts`: a
  // message begins here, whatever came before is to be forgotten.
  struct Piece {
    std::string_view bytes;
    bool restarts = false;
  };
  std::optional<Piece> take(std::string_view datagram);

 private:
  std::int32_t expected_ = 0;
  bool broken_ = false;
};
// zlib's CRC-32.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes);

}  // namespace nido::yarp
