#include "nido/yarp/names.h"

#include <fmt/format.h>

#include <algorithm>

namespace nido::yarp {
namespace {

constexpr std::size_t kLongestName = 500;
constexpr std::size_t kNumbersKept = 10'000;

constexpr const char* kHelp[] = {"Here are some ways to use the name server:",
                                 "+ help",
                                 "+ list [$prefix]",
                                 "+ register $portname",
                                 "+ register $portname $carrier $ipAddress $portNumber",
                                 "  (if you want a field set automatically, write '...')",
                                 "+ unregister $portname",
                                 "+ query $portname",
                                 "+ set $portname $property $value",
                                 "+ get $portname $property",
                                 "+ check $portname $property $value",
                                 "+ route $port1 $port2"};

Error wrong(std::string what) { return {ErrorCode::kInvalidArgument, std::move(what)}; }

// a name, a carrier, a host: one word without blanks
bool is_plain(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName && std::all_of(text.begin(), text.end(), [](char c) {
    return c > ' ' && c < 127 && c != '"' && c != '\\';
  });
}

// what a request has at a place, as text; "...", -1 and nothing are the same
std::string word_at(const Bottle& request, std::size_t at) {
  if (at >= request.size()) return {};
  const Value& value = request[at];
  std::string text = value.is_text() ? value.text : to_text(value);
  return text == "..." || text == "-1" ? std::string() : text;
}

}  // namespace

std::string to_line(const Contact& contact) {
  return fmt::format("registration name {} ip {} port {} type {}", contact.name, contact.host, contact.port,
                     contact.carrier);
}

std::optional<Contact> contact_from_line(std::string_view line) {
  const Result<Bottle> words = parse_bottle(line, {32, 4});
  if (!words || words->size() < 9 || !(*words)[0].is_word("registration")) return std::nullopt;
  Contact contact;
  for (std::size_t i = 1; i + 1 < words->size(); i += 2) {
    const Value& value = (*words)[i + 1];
    if ((*words)[i].is_word("name")) contact.name = value.is_text() ? value.text : to_text(value);
    if ((*words)[i].is_word("ip") && value.is_text()) contact.host = value.text;
    if ((*words)[i].is_word("port") && value.is_integer() && value.integer > 0 && value.integer < 65'536) {
      contact.port = static_cast<int>(value.integer);
    }
    if ((*words)[i].is_word("type") && value.is_text()) contact.carrier = value.text;
  }
  if (contact.name.empty() || contact.host.empty() || contact.port == 0) return std::nullopt;
  return contact;
}

NameRegistry::NameRegistry(Options options) : options_(std::move(options)), next_port_(options_.first_port) {
  add_own({options_.own_name, options_.host, options_.own_port, "tcp"});
}

void NameRegistry::add_own(const Contact& contact) {
  remove_own(contact.name);
  Entry entry;
  entry.contact = contact;
  entry.own = true;
  taken_.insert(contact.port);
  entries_[contact.name] = std::move(entry);
}

void NameRegistry::remove_own(const std::string& name) {
  const auto found = entries_.find(name);
  if (found == entries_.end()) return;
  if (const auto port = taken_.find(found->second.contact.port); port != taken_.end()) taken_.erase(port);
  entries_.erase(found);
}

std::optional<Contact> NameRegistry::find(const std::string& name) const {
  const auto found = entries_.find(name);
  if (found == entries_.end()) return std::nullopt;
  return found->second.contact;
}

std::vector<Contact> NameRegistry::list(const std::string& prefix) const {
  std::vector<Contact> out;
  for (auto entry = entries_.lower_bound(prefix); entry != entries_.end(); ++entry) {
    if (!entry->first.starts_with(prefix)) break;
    out.push_back(entry->second.contact);
  }
  return out;
}

int NameRegistry::free_port() {
  for (int tried = 0; tried <= options_.last_port - options_.first_port; ++tried) {
    const int port = next_port_;
    next_port_ = next_port_ == options_.last_port ? options_.first_port : next_port_ + 1;
    if (!taken_.contains(port)) return port;
  }
  return 0;
}

Result<Contact> NameRegistry::enter(const Bottle& request, const std::string& from_host) {
  Contact contact;
  contact.name = word_at(request, 1);
  if (contact.name.empty()) contact.name = fmt::format("/tmp/port/{}", next_anonymous_++);
  if (!is_plain(contact.name)) return wrong("a name is one word of printable letters");
  if (const std::string carrier = word_at(request, 2); !carrier.empty()) contact.carrier = carrier;
  contact.host = word_at(request, 3);
  if (contact.host.empty()) contact.host = from_host;
  if (!is_plain(contact.carrier) || !is_plain(contact.host))
    return wrong("carrier and address are one word each");
  const auto known = entries_.find(contact.name);
  if (known != entries_.end() && known->second.own) {
    return wrong(contact.name + " is a port of the program that serves the names");
  }
  if (known == entries_.end() && entries_.size() >= options_.names) {
    return wrong(fmt::format("there are {} names already", options_.names));
  }
  if (const std::string port = word_at(request, 4); !port.empty()) {
    const Value& value = request[4];
    if (!value.is_integer() || value.integer < 1 || value.integer > 65'535)
      return wrong("a port is 1..65535");
    contact.port = static_cast<int>(value.integer);
  } else if (known != entries_.end()) {
    contact.port = known->second.contact.port;
  } else if (const auto before = numbers_before_.find(contact.name);
             before != numbers_before_.end() && !taken_.contains(before->second)) {
    contact.port = before->second;
  } else {
    contact.port = free_port();
    if (contact.port == 0) return wrong("no port number is free");
  }
  if (known != entries_.end()) remove_own(contact.name);
  taken_.insert(contact.port);
  entries_[contact.name].contact = contact;
  return contact;
}

Result<std::vector<std::string>> NameRegistry::lines(const Bottle& request, const std::string& from_host) {
  const std::string verb = word_at(request, 0);
  const std::string name = word_at(request, 1);
  std::vector<std::string> out;
  if (verb == "register") {
    const Result<Contact> entered = enter(request, from_host);
    if (!entered) return entered.error();
    return std::vector{to_line(*entered)};
  }
  if (verb == "unregister") {
    const auto found = entries_.find(name);
    if (found == entries_.end()) return out;
    if (found->second.own) return wrong(name + " is a port of the program that serves the names");
    if (numbers_before_.size() >= kNumbersKept) numbers_before_.clear();
    numbers_before_[name] = found->second.contact.port;
    remove_own(name);
    return out;
  }
  if (verb == "query") {
    if (const std::optional<Contact> contact = find(name)) out.push_back(to_line(*contact));
    return out;
  }
  if (verb == "list") {
    for (const Contact& contact : list(name)) out.push_back(to_line(contact));
    if (name.empty()) out.push_back(to_line({"fallback", "224.2.1.1", 10000, "mcast"}));
    return out;
  }
  if (verb == "set" || verb == "get" || verb == "check") {
    const auto found = entries_.find(name);
    const std::string key = word_at(request, 2);
    if (found == entries_.end() || key.empty()) return out;
    auto& properties = found->second.properties;
    if (verb == "set") {
      Bottle values(request.begin() + 3, request.end());
      if (to_text(values).size() > options_.property_bytes || key.size() > options_.property_bytes ||
          (!properties.contains(key) && properties.size() >= options_.properties)) {
        return wrong(fmt::format("a name has at most {} properties of {} bytes", options_.properties,
                                 options_.property_bytes));
      }
      properties[key] = std::move(values);
    }
    const Bottle values = properties.contains(key) ? properties[key] : Bottle();
    if (verb == "check") {
      const std::string wanted = word_at(request, 3);
      const bool present = std::any_of(values.begin(), values.end(), [&](const Value& value) {
        return value.is_text() ? value.text == wanted : to_text(value) == wanted;
      });
      out.push_back(fmt::format("port {} property {} value {} present {}", name, key, wanted, present));
    } else {
      out.push_back(
          fmt::format("port {} property {} ={}{}", name, key, values.empty() ? "" : " ", to_text(values)));
    }
    return out;
  }
  if (verb == "route") {
    const std::string to = word_at(request, 2);
    const std::string_view path = std::string_view(to).substr(to.starts_with('/') ? 1 : 0);
    return std::vector{fmt::format("port {} route {} = tcp://{}", name, to, path)};
  }
  if (verb == "gc") return std::vector<std::string>{"garbage collection done."};
  if (verb == "help") return std::vector<std::string>(std::begin(kHelp), std::end(kHelp));
  return out;
}

std::string NameRegistry::answer(std::string_view request, const std::string& from_host) {
  std::string out;
  const Result<Bottle> words = parse_bottle(request, {256, 8});
  if (words && !words->empty() && (*words)[0].is_word("bot")) {
    // as YARP's own server does it, without an end mark
    return to_text(answer_bottle(Bottle(words->begin() + 1, words->end()), from_host)) + "\r\n";
  }
  if (!words) {
    out = "error: " + words.error().message + "\r\n";
  } else {
    const Result<std::vector<std::string>> found = lines(*words, from_host);
    if (!found) {
      out = "error: " + found.error().message + "\r\n";
    } else {
      for (const std::string& line : *found) out += line + "\r\n";
    }
  }
  return out + std::string(kEndOfAnswer) + "\r\n";
}

Bottle NameRegistry::answer_bottle(const Bottle& request, const std::string& from_host) {
  const std::string verb = word_at(request, 0);
  const auto port_of = [](const Contact& contact) {
    const auto pair = [](const char* key, Value value) {
      return Value::list({Value::string(key), std::move(value)});
    };
    return Bottle{Value::string("port"), pair("name", Value::string(contact.name)),
                  pair("ip", Value::string(contact.host)),
                  pair("port_number", Value::of(static_cast<std::int64_t>(contact.port))),
                  pair("carrier", Value::string(contact.carrier))};
  };
  if (verb == "list") {
    Bottle out{Value::string("ports")};
    for (const Contact& contact : list(word_at(request, 1))) out.push_back(Value::list(port_of(contact)));
    return out;
  }
  if (verb == "register") {
    const Result<Contact> entered = enter(request, from_host);
    if (!entered) return {Value::string("error"), Value::string(entered.error().message)};
    return port_of(*entered);
  }
  if (verb == "query") {
    if (const std::optional<Contact> contact = find(word_at(request, 1))) return port_of(*contact);
    return {Value::string("port"), Value::list({Value::string("error"), Value::string("Port not found")})};
  }
  Bottle out{Value::string("old")};
  const Result<std::vector<std::string>> found = lines(request, from_host);
  if (!found) return {Value::string("error"), Value::string(found.error().message)};
  for (const std::string& line : *found) out.push_back(Value::string(line));
  return out;
}

}  // namespace nido::yarp
