#include <algorithm>
#include <array>

#include "nido/value/bytes.h"
#include "nido/yarp/stream.h"

namespace nido::yarp {
namespace {

constexpr std::int32_t kIndexBytes = 10;
constexpr std::int32_t kSpecifierBase = 7777;
constexpr std::int32_t kWantsAck = 128;
constexpr std::size_t kDatagramBytes = 65'507;  // of UDP over IPv4
constexpr std::size_t kDatagramHeaderBytes = 8;

// the index of a message and its command; so many bytes follow
std::string framed(std::string_view command, std::size_t content_bytes) {
  std::string out = yarp_number(kIndexBytes);
  out += '\x02';  // blocks: the command and the content
  out += '\x01';  // outputs
  out.append(8, '\xff');
  put(out, static_cast<std::int32_t>(command.size()));
  put(out, static_cast<std::int32_t>(content_bytes));
  put(out, std::int32_t{0});
  out += command;
  return out;
}

// a command of one letter, or one with text behind it
std::string command_of(char letter) {
  std::string out(4, '\0');
  out += '~';
  out += letter;
  out += '\0';
  out += '\x01';
  return out;
}
std::string command_of(const std::string& text) {
  std::string out;
  put(out, static_cast<std::int32_t>(text.size() + 1));
  out += '~';
  out += '\0';
  out += '\0';
  out += '\x01';
  return out + text + '\0';
}

}  // namespace

std::string greeting(Carrier carrier, const std::string& own_name) {
  if (is_text(carrier)) return (carrier == Carrier::kText ? "CONNECT " : "CONNACK ") + own_name + "\r\n";
  const std::int32_t number = carrier == Carrier::kTcp ? 3 + kWantsAck : carrier == Carrier::kFastTcp ? 3 : 0;
  std::string out = yarp_number(kSpecifierBase + number);
  put(out, static_cast<std::int32_t>(own_name.size() + 1));
  return out + own_name + '\0';
}

std::string message_head(std::size_t content_bytes, std::string_view envelope, bool wants_reply) {
  const char letter = wants_reply ? 'd' : 'D';
  if (envelope.empty()) return framed(command_of(letter), content_bytes);
  return framed(command_of(std::string(1, letter) + ' ' + std::string(envelope)), content_bytes);
}

std::string message(Carrier carrier, std::string_view content, std::string_view envelope, bool wants_reply) {
  if (!is_text(carrier)) return message_head(content.size(), envelope, wants_reply) += content;
  std::string command(1, wants_reply ? 'd' : 'D');
  if (!envelope.empty()) command += ' ' + std::string(envelope);
  return command + "\r\n" + std::string(content) + "\r\n";
}

std::string admin_message(Carrier carrier, std::string_view content) {
  if (is_text(carrier)) return "a\r\n" + std::string(content) + "\r\n";
  return framed(command_of('a'), content.size()) += content;
}

std::string goodbye(Carrier carrier) {
  if (is_text(carrier)) return "q\r\n";
  return framed(command_of(std::string("q")), 0);
}

std::optional<std::string> AnswerReader::take_line() {
  const std::size_t end = buffer_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

Result<std::optional<std::int32_t>> AnswerReader::welcome() {
  if (is_text(carrier_)) {
    if (!take_line()) return std::optional<std::int32_t>();
    return std::optional<std::int32_t>(0);
  }
  if (buffer_.size() < 8) return std::optional<std::int32_t>();
  const std::optional<std::int32_t> number = parse_yarp_number(std::string_view(buffer_).substr(0, 8));
  if (!number) return Error{ErrorCode::kFailed, "the far side did not answer in YARP's protocol"};
  buffer_.erase(0, 8);
  return number;
}

Result<bool> AnswerReader::ack() {
  if (carrier_ == Carrier::kTextAck) {
    // replies that nobody asked for may stand before it
    while (const std::optional<std::string> line = take_line()) {
      if (*line == "<ACK>") return true;
    }
    return false;
  }
  if (buffer_.size() < 8) return false;
  if (!parse_yarp_number(std::string_view(buffer_).substr(0, 8))) {
    return Error{ErrorCode::kFailed, "the far side did not acknowledge in YARP's protocol"};
  }
  buffer_.erase(0, 8);
  return true;
}

Result<std::optional<Decoded>> AnswerReader::reply(Dialect preferred) {
  if (is_text(carrier_)) {
    const std::optional<std::string> line = take_line();
    if (!line) return std::optional<Decoded>();
    Result<Bottle> bottle = parse_bottle(*line);
    if (!bottle) return bottle.error();
    return std::optional<Decoded>(Decoded{std::move(*bottle), preferred});
  }
  // nothing says how long a reply is: the Bottle itself does, and the acknowledgement behind it
  std::string_view bytes = buffer_;
  if (carrier_ == Carrier::kTcp) {
    if (bytes.size() < 16 || !parse_yarp_number(bytes.substr(bytes.size() - 8))) {
      if (bytes.size() > limit_) return Error{ErrorCode::kFailed, "the reply is too long"};
      return std::optional<Decoded>();
    }
    bytes.remove_suffix(8);
  }
  Result<Decoded> decoded = decode_any(bytes, preferred);
  if (!decoded) {
    if (buffer_.size() > limit_) return Error{ErrorCode::kFailed, "the reply is too long"};
    return std::optional<Decoded>();
  }
  // the acknowledgement stays for ack()
  buffer_.erase(0, bytes.size());
  return std::optional<Decoded>(std::move(*decoded));
}

std::uint32_t crc32(std::string_view bytes) {
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = (value & 1U) != 0 ? 0xedb88320U ^ (value >> 1U) : value >> 1U;
      table[i] = value;
    }
    return table;
  }();
  std::uint32_t crc = 0xffffffffU;
  for (const char c : bytes) {
    crc = kTable[(crc ^ static_cast<unsigned char>(c)) & 0xffU] ^ (crc >> 8U);
  }
  return ~crc;
}

std::vector<std::string> to_datagrams(std::string_view message) {
  constexpr std::size_t kPiece = kDatagramBytes - kDatagramHeaderBytes;
  std::vector<std::string> out;
  for (std::int32_t count = 0; !message.empty(); ++count) {
    const std::string_view piece = message.substr(0, kPiece);
    message.remove_prefix(piece.size());
    std::string datagram;
    put(datagram, crc32(piece));
    put(datagram, count);
    datagram += piece;
    out.push_back(std::move(datagram));
  }
  return out;
}

std::optional<DatagramReader::Piece> DatagramReader::take(std::string_view datagram) {
  if (datagram.size() < kDatagramHeaderBytes) return std::nullopt;
  const auto count = get_at<std::int32_t>(datagram, 4);
  if (count == -1) return std::nullopt;  // only wakes the receiver up
  if (crc32(datagram.substr(kDatagramHeaderBytes)) != get_at<std::uint32_t>(datagram, 0) || count < 0) {
    broken_ = true;
    return std::nullopt;
  }
  const bool restarts = count == 0;
  if (restarts) {
    broken_ = false;
    expected_ = 0;
  }
  if (broken_ || count != expected_) {
    broken_ = true;
    return std::nullopt;
  }
  ++expected_;
  return Piece{datagram.substr(kDatagramHeaderBytes), restarts};
}

}  // namespace nido::yarp
