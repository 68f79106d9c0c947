#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "nido/value/bytes.h"
#include "nido/yarp/stream.h"

namespace nido::yarp {
namespace {

constexpr std::size_t kHeaderBytes = 8;
constexpr std::int32_t kSpecifierBase = 7777;  // the carrier's number is what a header says beyond this
constexpr std::int32_t kIndexBytes = 10;       // the YARP number that begins an index
constexpr std::size_t kLongestEnvelope = 4096;

constexpr std::string_view kNoProtocol =
    "* Error. Protocol not found.\r\n"
    "* This is a port that speaks YARP's protocol. By hand, begin with a line\r\n"
    "*   CONNECT me\r\n"
    "* then 'd', a new line, and a message: d\\nget encs. A line '?' tells more.\r\n";

// which carrier a header of eight bytes names
std::optional<Carrier> carrier_of_header(std::string_view header) {
  if (header == "CONNECT ") return Carrier::kText;
  if (header == "CONNACK ") return Carrier::kTextAck;
  const std::optional<std::int32_t> number = parse_yarp_number(header);
  if (!number) return std::nullopt;
  const std::int32_t specifier = *number - kSpecifierBase;
  if (specifier < 0 || specifier > 0xff) return std::nullopt;
  switch (specifier % 16) {
    case 0:
      return Carrier::kUdp;
    case 3:
      return (specifier & 128) != 0 ? Carrier::kTcp : Carrier::kFastTcp;
    default:
      return std::nullopt;
  }
}

std::string printable(std::string_view bytes) {
  std::string out;
  for (const char c : bytes) {
    if (c >= ' ' && c < 127) {
      out += c;
    } else {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
  }
  return out;
}

}  // namespace

std::string_view to_string(Carrier carrier) {
  switch (carrier) {
    case Carrier::kTcp:
      return "tcp";
    case Carrier::kFastTcp:
      return "fast_tcp";
    case Carrier::kUdp:
      return "udp";
    case Carrier::kText:
      return "text";
    case Carrier::kTextAck:
      return "text_ack";
  }
  return "tcp";
}

std::optional<Carrier> carrier_from_string(std::string_view name) {
  name = name.substr(0, name.find('+'));
  for (const Carrier carrier :
       {Carrier::kTcp, Carrier::kFastTcp, Carrier::kUdp, Carrier::kText, Carrier::kTextAck}) {
    if (name == to_string(carrier)) return carrier;
  }
  return std::nullopt;
}

std::string yarp_number(std::int32_t value) {
  std::string out = "YA";
  put(out, value);
  return out + "RP";
}

std::optional<std::int32_t> parse_yarp_number(std::string_view bytes) {
  if (bytes.size() != kHeaderBytes || bytes.substr(0, 2) != "YA" || bytes.substr(6) != "RP")
    return std::nullopt;
  return get_at<std::int32_t>(bytes, 2);
}

void ReceivingStream::take(std::size_t bytes) {
  at_ += bytes;
  searched_ = 0;
  // what was used goes when it is the larger part, so that the copying costs no more than the reading
  if (at_ > buffer_.size() / 2) {
    buffer_.erase(0, at_);
    at_ = 0;
    constexpr std::size_t kKept = 64 * 1024;
    if (buffer_.capacity() > kKept && buffer_.size() < kKept / 4) buffer_.shrink_to_fit();
  }
}

Event ReceivingStream::refuse(std::string reason, std::string farewell) {
  state_ = State::kOver;
  buffer_ = {};
  at_ = 0;
  pending_text_ = {};
  return Refused{std::move(reason), std::move(farewell)};
}

void ReceivingStream::restart_message() {
  if (state_ != State::kIndex && state_ != State::kPayload) return;
  state_ = State::kIndex;
  buffer_.clear();
  at_ = 0;
  searched_ = 0;
}

std::optional<std::string> ReceivingStream::take_line() {
  const std::string_view bytes = rest();
  const std::size_t end = bytes.find('\n', searched_);
  if (end == std::string_view::npos) {
    searched_ = bytes.size();
    return std::nullopt;
  }
  std::string line(bytes.substr(0, end));
  take(end + 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

std::optional<Event> ReceivingStream::next() {
  for (;;) {
    const State before = state_;
    const std::size_t bytes_before = rest().size();
    std::optional<Event> event;
    switch (state_) {
      case State::kHeader:
        event = read_header();
        break;
      case State::kSender:
        event = read_sender();
        break;
      case State::kIndex:
        event = read_index();
        break;
      case State::kPayload:
        event = read_payload();
        break;
      case State::kText:
        event = read_text();
        break;
      case State::kNames:
        event = read_name_request();
        break;
      case State::kHttp:
        event = read_http();
        break;
      case State::kOver:
        return std::nullopt;
    }
    if (event) return event;
    if (state_ == before && rest().size() == bytes_before) return std::nullopt;
  }
}

std::optional<Event> ReceivingStream::read_header() {
  if (rest().size() < kHeaderBytes) {
    // somebody who types a short line by hand is told, not left waiting
    if (rest().find('\n') != std::string_view::npos) {
      return refuse("no carrier of YARP: '" + printable(rest()) + "'", std::string(kNoProtocol));
    }
    return std::nullopt;
  }
  const std::string_view header = rest().substr(0, kHeaderBytes);
  if (header == "NAME_SER") {
    state_ = State::kNames;
    return std::nullopt;
  }
  if (header.substr(0, 5) == "GET /" || header.substr(0, 6) == "POST /") {
    state_ = State::kHttp;
    return std::nullopt;
  }
  const std::optional<Carrier> carrier = carrier_of_header(header);
  if (!carrier) {
    return refuse("no carrier of YARP: '" + printable(header) + "'", std::string(kNoProtocol));
  }
  carrier_ = *carrier;
  state_ = State::kSender;
  take(kHeaderBytes);
  return std::nullopt;
}

std::optional<Event> ReceivingStream::read_sender() {
  if (is_text(carrier_)) {
    const std::optional<std::string> line = take_line();
    if (!line) {
      if (rest().size() > limits_.sender_name) return refuse("the sender's name does not end");
      return std::nullopt;
    }
    if (line->size() > limits_.sender_name) return refuse("the sender's name is too long");
    state_ = State::kText;
    return Opened{carrier_, *line};
  }
  if (rest().size() < 4) return std::nullopt;
  const auto length = get_at<std::int32_t>(rest(), 0);
  if (length < 1 || static_cast<std::size_t>(length) > limits_.sender_name) {
    return refuse(
        fmt::format("a sender's name of {} bytes: 1 to {} are allowed", length, limits_.sender_name));
  }
  const auto size = static_cast<std::size_t>(length);
  if (rest().size() < 4 + size) return std::nullopt;
  std::string name(rest().substr(4, size));
  take(4 + size);
  name.resize(std::min(name.size(), name.find('\0')));
  // qualifiers travel as "name (k v)"
  if (const std::size_t qualifiers = name.find(" ("); qualifiers != std::string::npos)
    name.resize(qualifiers);
  state_ = State::kIndex;
  return Opened{carrier_, std::move(name)};
}

std::optional<Event> ReceivingStream::read_index() {
  const std::string_view bytes = rest();
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  const std::optional<std::int32_t> number = parse_yarp_number(bytes.substr(0, kHeaderBytes));
  if (number != kIndexBytes) return refuse("a message does not begin with an index");
  if (bytes.size() < kHeaderBytes + kIndexBytes) return std::nullopt;
  const std::string_view counts = bytes.substr(kHeaderBytes, kIndexBytes);
  const auto blocks = static_cast<std::size_t>(static_cast<unsigned char>(counts[0]));
  const auto outputs = static_cast<std::size_t>(static_cast<unsigned char>(counts[1]));
  std::size_t at = kHeaderBytes + kIndexBytes;
  if (bytes.size() < at + 4 * (blocks + outputs)) return std::nullopt;
  std::size_t total = 0;
  for (std::size_t block = 0; block < blocks; ++block, at += 4) {
    const auto length = get_at<std::int32_t>(bytes, at);
    if (length < 0) return refuse(fmt::format("a block of {} bytes", length));
    total += static_cast<std::size_t>(length);
    if (total > limits_.message) {
      return refuse(fmt::format("a message of {} bytes or more: {} are allowed", total, limits_.message));
    }
  }
  message_bytes_ = total;
  state_ = State::kPayload;
  take(at + 4 * outputs);
  return std::nullopt;
}

std::optional<Event> ReceivingStream::read_payload() {
  if (rest().size() < message_bytes_) return std::nullopt;
  const std::string_view message = rest().substr(0, message_bytes_);
  if (message.size() < kHeaderBytes || message[4] != '~') {
    // an empty message is passed over
    if (message.empty()) {
      state_ = State::kIndex;
      return std::nullopt;
    }
    return refuse("a message does not begin with a command");
  }
  const auto length = get_at<std::int32_t>(message, 0);
  char command = message[5];
  std::size_t begin = kHeaderBytes;
  std::string_view text;
  if (command == 0) {
    if (length < 1 || static_cast<std::size_t>(length) > std::min(message.size() - begin, kLongestEnvelope)) {
      return refuse(fmt::format("a command of {} bytes", length));
    }
    text = message.substr(begin, static_cast<std::size_t>(length) - 1);
    text = text.substr(0, std::min(text.size(), text.find('\0')));
    begin += static_cast<std::size_t>(length);
    command = text.empty() ? '\0' : text.front();
  }
  std::optional<Event> event;
  switch (command) {
    case 'd':
    case 'D': {
      Data data;
      data.wants_reply = command == 'd' && !text.starts_with("do");
      if (const std::size_t blank = text.find(' '); blank != std::string_view::npos)
        data.envelope = text.substr(blank + 1);
      data.bytes = message.substr(begin);
      event = std::move(data);
      break;
    }
    case 'a':
      event = Admin{std::string(message.substr(begin))};
      break;
    case 'r':
      event = Reverse{};
      break;
    case 'q':
      state_ = State::kOver;
      buffer_ = {};
      at_ = 0;
      return Quit{};
    case '*':
      event = Describe{};
      break;
    case '?':
      event = ShowHelp{};
      break;
    case '/':
      event = AddOutput{std::string(text), AddOutput::What::kConnect};
      break;
    case '!':
    case '~':
      event =
          AddOutput{std::string(text.substr(std::min<std::size_t>(1, text.size()))),
                    command == '!' ? AddOutput::What::kDisconnectOutput : AddOutput::What::kDisconnectInput};
      break;
    default:
      return refuse(fmt::format("'{}' is no command", printable(std::string_view(&command, 1))));
  }
  state_ = State::kIndex;
  take(message_bytes_);
  return event;
}

std::optional<Event> ReceivingStream::read_text() {
  std::optional<std::string> line = take_line();
  if (!line) {
    if (rest().size() + pending_text_.size() > limits_.line) {
      return refuse(fmt::format("a line of more than {} characters", limits_.line));
    }
    return std::nullopt;
  }
  if (pending_command_.empty()) return read_text_command(std::move(*line));

  pending_text_ += *line;
  if (pending_text_.size() > limits_.line) {
    return refuse(fmt::format("a message of more than {} characters", limits_.line));
  }
  if (continues(pending_text_)) {
    if (pending_text_.back() == '\\') pending_text_.pop_back();
    pending_text_ += ' ';
    return std::nullopt;
  }
  const std::string command = std::move(pending_command_);
  std::string text = std::move(pending_text_);
  pending_command_.clear();
  pending_text_.clear();
  if (command.front() == 'a') return Admin{std::move(text)};
  Data data;
  data.bytes = std::move(text);
  data.wants_reply = command.front() == 'd' && !command.starts_with("do");
  if (const std::size_t blank = command.find(' '); blank != std::string::npos) {
    data.envelope = command.substr(blank + 1);
  }
  return data;
}

std::optional<Event> ReceivingStream::read_text_command(std::string line) {
  if (line.empty()) return std::nullopt;
  const char command = line.front();
  switch (command) {
    case 'd':
    case 'D':
    case 'a':
      // only these letters, with an envelope: a whole word is somebody's mistake
      if (line.size() == 1 || line[1] == ' ' || line == "do") {
        pending_command_ = std::move(line);
        return std::nullopt;
      }
      break;
    case '*':
      return Describe{};
    case '?':
      return ShowHelp{};
    case 'r':
      if (line.size() == 1) return Reverse{};
      break;
    case 'q':
      if (line.size() == 1) {
        state_ = State::kOver;
        return Quit{};
      }
      break;
    case '/':
      return AddOutput{std::move(line), AddOutput::What::kConnect};
    case '!':
    case '~':
      return AddOutput{line.substr(1), command == '!' ? AddOutput::What::kDisconnectOutput
                                                      : AddOutput::What::kDisconnectInput};
    default:
      break;
  }
  // what is no command is taken as a message: a person who types `get encs` gets the encoders
  return Data{std::move(line), {}, true};
}

std::optional<Event> ReceivingStream::read_name_request() {
  const std::optional<std::string> line = take_line();
  if (!line) {
    if (rest().size() > limits_.line) return refuse("a request to the name server does not end");
    return std::nullopt;
  }
  constexpr std::string_view kPrefix = "NAME_SERVER ";
  if (line->starts_with(kPrefix)) return NameRequest{line->substr(kPrefix.size())};
  return NameRequest{*line};
}

std::optional<Event> ReceivingStream::read_http() {
  // the first line says all; the rest of the request is passed over
  const std::optional<std::string> line = take_line();
  if (!line) {
    if (rest().size() > limits_.line) return refuse("a request of a browser does not end");
    return std::nullopt;
  }
  const std::size_t begin = line->find('/');
  const std::size_t end = line->find(' ', begin);
  state_ = State::kOver;
  return HttpRequest{line->substr(begin, end == std::string::npos ? end : end - begin)};
}

std::string ReceivingStream::welcome(const std::string& sender, int own_port) const {
  if (is_text(carrier_)) return "Welcome " + sender + "\r\n";
  return yarp_number(own_port);
}

std::string ReceivingStream::answer(const std::optional<Bottle>& reply, Dialect dialect) const {
  std::string out;
  if (carrier_ == Carrier::kUdp) return out;
  if (reply) {
    out = is_text(carrier_) ? to_text(*reply) + "\r\n" : encode(*reply, dialect);
  }
  if (carrier_ == Carrier::kTextAck) out += "<ACK>\r\n";
  if (carrier_ == Carrier::kTcp) out += yarp_number(0);
  return out;
}

}  // namespace nido::yarp
