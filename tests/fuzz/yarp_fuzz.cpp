// Any bytes on a connection: nothing may break, and what is understood must survive being written again.
// The first byte chooses what is tried and the size of the pieces in which the rest comes.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include "nido/yarp/bottle.h"
#include "nido/yarp/image.h"
#include "nido/yarp/names.h"
#include "nido/yarp/stream.h"

namespace nido::yarp {
namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void try_bottle(std::string_view bytes) {
  for (const Dialect dialect : {Dialect::k3, Dialect::k4}) {
    const Result<Bottle> bottle = decode(bytes, dialect);
    if (!bottle) continue;
    const Result<Bottle> again = decode(encode(*bottle, dialect), dialect);
    require(again.ok());
    // by text, since nan is not equal to itself
    require(to_text(*again) == to_text(*bottle));
  }
}

void try_text(std::string_view text) {
  const Result<Bottle> bottle = parse_bottle(text);
  (void)continues(text);
  (void)parse_stamp(text);
  (void)contact_from_line(text);
  if (!bottle) return;
  const std::string written = to_text(*bottle);
  const Result<Bottle> again = parse_bottle(written);
  require(again.ok());
  require(to_text(*again) == written);
}

void try_connection(std::string_view bytes, std::size_t piece) {
  ReceivingStream stream({.message = 1 << 16, .line = 1 << 12});
  Image image;
  Sound sound;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size()))) {
    if (!stream.hungry()) break;
    stream.feed(bytes.substr(0, piece));
    while (const std::optional<Event> event = stream.next()) {
      if (const auto* data = std::get_if<Data>(&*event)) {
        if (is_text(stream.carrier())) {
          try_text(data->bytes);
        } else {
          try_bottle(data->bytes);
          (void)decode_image(data->bytes, image);
          (void)decode_sound(data->bytes, sound);
        }
        (void)stream.answer(Bottle{Value::word("ok")}, Dialect::k3);
      }
      if (const auto* admin = std::get_if<Admin>(&*event)) (void)decode_any(admin->bytes, Dialect::k3);
    }
  }
}

void try_names(std::string_view bytes) {
  NameRegistry::Options options;
  options.names = 8;
  NameRegistry names(options);
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    (void)names.answer(bytes.substr(0, end), "127.0.0.1");
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
}

void try_datagrams(std::string_view bytes, std::size_t piece) {
  DatagramReader reader;
  ReceivingStream stream;
  stream.feed(greeting(Carrier::kUdp, "/fuzz"));
  while (stream.next()) {
  }
  // whole ones first, so that some pass the checksum
  for (const std::string& datagram : to_datagrams(bytes)) {
    const auto part = reader.take(datagram);
    if (part && part->restarts) stream.restart_message();
    if (part) stream.feed(part->bytes);
    while (stream.next()) {
    }
  }
  for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size())))
    (void)reader.take(bytes.substr(0, piece));
}

void try_answers(std::string_view bytes, std::size_t piece) {
  for (const Carrier carrier : {Carrier::kTcp, Carrier::kTextAck}) {
    AnswerReader reader(carrier, 1 << 16);
    for (std::string_view rest = bytes; !rest.empty(); rest.remove_prefix(std::min(piece, rest.size()))) {
      reader.feed(rest.substr(0, piece));
      if (const auto reply = reader.reply(Dialect::k3); !reply) break;
      if (const auto ack = reader.ack(); !ack) break;
    }
  }
}

}  // namespace
}  // namespace nido::yarp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace nido::yarp;
  if (size < 1) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::size_t piece = 1U + (data[0] >> 3U) * 8U;
  switch (data[0] & 7U) {
    case 0:
      try_bottle(bytes);
      break;
    case 1:
      try_text(bytes);
      break;
    case 2:
      try_names(bytes);
      break;
    case 3:
      try_datagrams(bytes, piece);
      break;
    case 4:
      try_answers(bytes, piece);
      break;
    case 5: {
      nido::Image image;
      nido::Sound sound;
      (void)decode_image(bytes, image);
      (void)decode_sound(bytes, sound);
      break;
    }
    default:
      try_connection(bytes, piece);
  }
  return 0;
}
