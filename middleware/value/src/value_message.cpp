#include "nido/value/value_message.h"

namespace nido {

msgs::Values message_of(const Values& values) {
  const std::string bytes = encode(values, Dialect::k3);
  msgs::Values message;
  message.data().assign(bytes.begin(), bytes.end());
  return message;
}

Result<Values> values_of(const msgs::Values& message, const ValueLimits& limits) {
  const auto& data = message.data();
  if (data.empty()) return Values();  // a message that nobody has filled
  return decode({reinterpret_cast<const char*>(data.data()), data.size()}, Dialect::k3, limits);
}

}  // namespace nido
