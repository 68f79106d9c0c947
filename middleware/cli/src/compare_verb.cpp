#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <map>
#include <set>

#include "nido/cli/idl_type.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/mcap_reader.h"
#include "nido/recorder/recorder.h"
#include "verbs.h"

namespace nido::cli {
namespace {

struct Kept {
  std::uint64_t time_ns = 0;
  std::string data;
};

// What is known of a port while both files are gone through.
struct Compared {
  std::deque<Kept> waiting[2];  // messages of one file that the other has not come to yet
  std::uint64_t same = 0;       // messages
  std::string difference;       // the first, in words; empty: none yet
  double difference_s = 0;
};

// The first place where two values differ: "position.3: 0.25, 0.26".
std::string first_difference(const Json& a, const Json& b, const std::string& path) {
  if (a.is_structured() && a.type() == b.type() && a.size() == b.size()) {
    for (auto one = a.begin(), other = b.begin(); one != a.end(); ++one, ++other) {
      const std::string key = a.is_object() ? one.key() : std::to_string(one - a.begin());
      std::string inner = first_difference(*one, *other, path.empty() ? key : path + "." + key);
      if (!inner.empty()) return inner;
    }
    return "";
  }
  if (a == b) return "";
  const auto shown = [](const Json& value) {
    const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.size() > 60 ? text.substr(0, 57) + "..." : text;
  };
  return fmt::format("{}: {} and {}", path, shown(a), shown(b));
}

class Comparison {
 public:
  Comparison(mcap::Reader& a, mcap::Reader& b, const CompareRequest& request)
      : readers_{&a, &b}, request_(request) {}

  // Goes through both files from --from to the end of the shorter one, or to --to.
  void run() {
    const std::uint64_t from_ns = readers_[0]->start_ns() + static_cast<std::uint64_t>(request_.from_s * 1e9);
    for (int side = 0; side < 2; ++side) {
      std::set<std::uint16_t> wanted;
      for (const auto& [id, channel] : readers_[side]->channels()) {
        if (!is_wanted(channel.topic)) continue;
        wanted.insert(id);
        ++(side == 0 ? only_a_ : only_b_)[channel.topic];
      }
      // without any channel all would be read
      if (wanted.empty()) return;
      readers_[side]->rewind(from_ns, wanted);
    }
    for (auto port = only_a_.begin(); port != only_a_.end();) {
      const bool is_in_both = only_b_.erase(port->first) > 0;
      if (is_in_both) ports_[port->first];
      port = is_in_both ? only_a_.erase(port) : std::next(port);
    }
    std::uint64_t end_ns = std::min(readers_[0]->end_ns(), readers_[1]->end_ns());
    if (request_.to_s >= 0) {
      end_ns = std::min(end_ns, readers_[0]->start_ns() + static_cast<std::uint64_t>(request_.to_s * 1e9));
    }
    // the two are read side by side, so that little waits
    bool is_over[2] = {false, false};
    while ((!is_over[0] || !is_over[1]) && !interrupted()) {
      const int side = is_over[0] || (!is_over[1] && at_ns_[1] < at_ns_[0]) ? 1 : 0;
      const auto message = readers_[side]->next();
      if (!message || message->log_time_ns > end_ns) {
        is_over[side] = true;
        continue;
      }
      at_ns_[side] = message->log_time_ns;
      take(side, *message);
    }
    for (const auto& [id, channel] : readers_[0]->channels()) {
      const auto port = ports_.find(channel.topic);
      if (port != ports_.end() && port->second.difference.empty()) judge(port->second, channel, end_ns + 1);
    }
    compared_s_ = static_cast<double>(end_ns - std::min(end_ns, from_ns)) * 1e-9;
  }

  [[nodiscard]] int print(bool json) const {
    std::uint64_t same = 0;
    const std::pair<const std::string, Compared>* first = nullptr;
    for (const auto& port : ports_) {
      same += port.second.same;
      if (!port.second.difference.empty() &&
          (first == nullptr || port.second.difference_s < first->second.difference_s)) {
        first = &port;
      }
    }
    const bool is_same = first == nullptr && only_a_.empty() && only_b_.empty() && !ports_.empty();
    if (json) {
      Json ports = Json::array();
      for (const auto& [name, port] : ports_) {
        Json one = {{"name", name}, {"same", port.same}};
        if (!port.difference.empty())
          one["difference"] = {{"time_s", port.difference_s}, {"what", port.difference}};
        ports.push_back(one);
      }
      fmt::print("{}\n", Json{{"same", is_same},
                              {"messages", same},
                              {"compared_s", compared_s_},
                              {"ports", ports},
                              {"only_in_first", names_of(only_a_)},
                              {"only_in_second", names_of(only_b_)}}
                             .dump(2));
      return is_same ? 0 : 1;
    }
    for (const auto& [name, count] : only_a_) fmt::print("only the first has {}\n", name);
    for (const auto& [name, count] : only_b_) fmt::print("only the second has {}\n", name);
    for (const auto& [name, port] : ports_) {
      if (port.difference.empty()) continue;
      fmt::print("{}: {} messages are the same, then at {:.3f} s: {}\n", name, port.same, port.difference_s,
                 port.difference);
    }
    if (is_same) {
      fmt::print("the same: {} messages on {} ports in {:.2f} s, bit for bit\n", same, ports_.size(),
                 compared_s_);
    } else if (first != nullptr) {
      fmt::print("not the same: first on {} at {:.3f} s; {} messages in all are the same\n", first->first,
                 first->second.difference_s, same);
    }
    return is_same ? 0 : 1;
  }

 private:
  static Json names_of(const std::map<std::string, int>& names) {
    Json list = Json::array();
    for (const auto& [name, count] : names) list.push_back(name);
    return list;
  }

  [[nodiscard]] bool is_wanted(const std::string& port) const {
    if (!request_.except.empty() && port_matches(port, request_.except)) return false;
    // what people read tells also of the machine: how long something took, who was there first
    if (request_.ports.empty()) return port != "/log";
    return port_matches(port, request_.ports);
  }

  // Messages of one moment need not come in one order: several nodes may write to one port.
  void take(int side, const mcap::Message& message) {
    const mcap::Channel& channel = readers_[side]->channels().at(message.channel_id);
    const auto found = ports_.find(channel.topic);
    if (found == ports_.end() || !found->second.difference.empty()) return;
    Compared& port = found->second;
    std::deque<Kept>& others = port.waiting[1 - side];
    const auto twin = std::find_if(others.begin(), others.end(), [&](const Kept& other) {
      return other.time_ns == message.log_time_ns && other.data == message.data;
    });
    if (twin == others.end()) {
      port.waiting[side].push_back({message.log_time_ns, std::string(message.data)});
    } else {
      others.erase(twin);
      ++port.same;
    }
    // what is older than both places has no twin
    judge(port, channel, std::min(at_ns_[0], at_ns_[1]));
  }

  void judge(Compared& port, const mcap::Channel& channel, std::uint64_t before_ns) {
    const auto is_late = [&](int side) {
      return !port.waiting[side].empty() && port.waiting[side].front().time_ns < before_ns;
    };
    if (!is_late(0) && !is_late(1)) return;
    const std::uint64_t none = std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t a_ns = port.waiting[0].empty() ? none : port.waiting[0].front().time_ns;
    const std::uint64_t b_ns = port.waiting[1].empty() ? none : port.waiting[1].front().time_ns;
    port.difference = a_ns == b_ns
                          ? describe(channel, port.waiting[0].front().data, port.waiting[1].front().data)
                          : fmt::format("only the {} has a message then", a_ns < b_ns ? "first" : "second");
    const std::uint64_t at = std::min(a_ns, b_ns);
    port.difference_s = static_cast<double>(at - std::min(at, readers_[0]->start_ns())) * 1e-9;
    port.waiting[0].clear();
    port.waiting[1].clear();
  }

  [[nodiscard]] std::string describe(const mcap::Channel& channel, std::string_view a,
                                     std::string_view b) const {
    const auto schema = readers_[0]->schemas().find(channel.schema_id);
    IdlTypes types;
    if (schema != readers_[0]->schemas().end() && types.add(schema->second.data)) {
      if (const auto type = types.definition(ros_name_of(schema->second.name))) {
        const auto one = json_of_cdr(*type, a);
        const auto other = json_of_cdr(*type, b);
        if (one && other) return first_difference(*one, *other, "");
      }
    }
    const auto [left, right] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
    return fmt::format("{} and {} bytes, different from byte {}", a.size(), b.size(), left - a.begin());
  }

  mcap::Reader* readers_[2];
  std::uint64_t at_ns_[2] = {0, 0};  // how far each has come
  const CompareRequest& request_;
  std::map<std::string, Compared> ports_;
  std::map<std::string, int> only_a_;
  std::map<std::string, int> only_b_;
  double compared_s_ = 0;
};

}  // namespace

int compare(const Common& common, const CompareRequest& request) {
  auto first = mcap::Reader::open(request.first);
  if (!first) return fail(common, first.error());
  auto second = mcap::Reader::open(request.second);
  if (!second) return fail(common, second.error());
  catch_signals();
  Comparison comparison(**first, **second, request);
  comparison.run();
  if (interrupted()) return 130;
  return comparison.print(common.json);
}

}  // namespace nido::cli
