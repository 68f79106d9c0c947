#include "nido/yarp/port_host.h"

namespace nido::yarp {

Content Content::of_bytes(std::string bytes) {
  Content content;
  content.encoded_[0] = std::move(bytes);
  return content;
}

const std::string& Content::bytes(Dialect dialect) const {
  if (!bottle_) return *encoded_[0];
  std::optional<std::string>& encoded = encoded_[dialect == Dialect::k3 ? 0 : 1];
  if (!encoded) encoded = encode(*bottle_, dialect);
  return *encoded;
}

const std::string& Content::text() const {
  if (!text_) {
    if (bottle_) {
      text_ = to_text(*bottle_);
    } else {
      const Result<Bottle> decoded = decode(*encoded_[0], Dialect::k3);
      text_ = decoded ? to_text(*decoded) : std::string();
    }
  }
  return *text_;
}

std::string& Content::refill() {
  text_.reset();
  return *encoded_[0];
}

Result<Decoded> Incoming::content() const {
  if (!is_text) return decode_any(bytes, dialect);
  Result<Bottle> bottle = parse_bottle(bytes);
  if (!bottle) return bottle.error();
  return Decoded{std::move(*bottle), dialect};
}

}  // namespace nido::yarp
