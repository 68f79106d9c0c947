#include <fmt/format.h>

#include <algorithm>

#include "nido/gateway/conversions.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

Value value_of(const Json& value) {
  switch (value.type()) {
    case Json::value_t::boolean:
      return Value::word(value.get<bool>() ? "1" : "");
    case Json::value_t::number_integer:
      return Value::of(value.get<std::int64_t>());
    case Json::value_t::number_unsigned:
      return Value::of(static_cast<std::int64_t>(value.get<std::uint64_t>()));
    case Json::value_t::number_float:
      return Value::of(value.get<double>());
    case Json::value_t::string:
      return Value::string(value.get<std::string>());
    case Json::value_t::array: {
      Bottle items;
      for (const Json& item : value) items.push_back(value_of(item));
      return Value::list(std::move(items));
    }
    case Json::value_t::object:
      return Value::list(bottle_of(value));
    default:
      return Value::string("");
  }
}

// "(name value)"
bool is_pair(const Value& value) {
  return value.is_list() && value.items.size() == 2 && value.items.front().is_text();
}

Result<Json> json_value(const Value& value, const Json& example) {
  if (value.is_list()) {
    // a list of pairs is an object, unless a sequence is expected here
    const bool pairs = !value.items.empty() && std::all_of(value.items.begin(), value.items.end(), is_pair);
    if (example.is_object() || (pairs && !example.is_array())) return json_of(value.items, example);
    Json out = Json::array();
    const Json inner = example.is_array() && !example.empty() ? example.front() : Json();
    for (const Value& item : value.items) {
      Result<Json> converted = json_value(item, inner);
      if (!converted) return converted.error();
      out.push_back(std::move(*converted));
    }
    return out;
  }
  if (value.kind == Value::Kind::kWord && example.is_boolean()) {
    return Json(value.text == "1" || value.text == "ok");
  }
  if (value.is_text()) return Json(value.text);
  if (value.kind == Value::Kind::kBlob) {
    Json out = Json::array();
    for (const char byte : value.text) out.push_back(static_cast<unsigned char>(byte));
    return out;
  }
  if (value.is_integer()) {
    if (example.is_boolean()) return Json(value.integer != 0);
    return Json(value.integer);
  }
  return Json(value.number);
}

}  // namespace

Bottle bottle_of(const Json& value) {
  Bottle out;
  for (const auto& [key, item] : value.items()) {
    out.push_back(Value::list({Value::string(key), value_of(item)}));
  }
  return out;
}

Result<Json> json_of(const Bottle& bottle, const Json& example) {
  Json out = Json::object();
  // a type of one field takes its value without the name
  const bool bare = !std::all_of(bottle.begin(), bottle.end(), is_pair);
  if (bare) {
    if (!example.is_object() || example.size() != 1) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("pairs (NAME VALUE) are expected, not '{}'",
                                                            yarp::to_text(bottle).substr(0, 80))};
    }
    const std::string field = example.begin().key();
    if (bottle.size() == 1) {
      Result<Json> converted = json_value(bottle.front(), example.front());
      if (!converted) return converted.error();
      out[field] = std::move(*converted);
    } else {
      out[field] = yarp::to_text(bottle);
    }
    return out;
  }
  for (const Value& item : bottle) {
    const std::string& key = item.items[0].text;
    const Json inner = example.is_object() && example.contains(key) ? example[key] : Json();
    Result<Json> converted = json_value(item.items[1], inner);
    if (!converted) return converted.error();
    out[key] = std::move(*converted);
  }
  return out;
}

}  // namespace nido::gateway
