#include <fmt/format.h>

#include <sstream>

#include "verbs.h"

namespace nido::cli {

int clock(const Common& common, const std::vector<std::string>& words) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  const std::string command = words.empty() ? "get" : fmt::format("{}", fmt::join(words, " "));
  const auto answer = session->node->call("/clock/rpc:i", command, common.wait_s);
  if (interrupted()) return 130;
  if (!answer) {
    if (answer.error().code != ErrorCode::kNotFound) return fail(common, answer.error());
    return fail(common,
                {ErrorCode::kNotFound,
                 fmt::format("nobody owns a simulated clock in domain {}: a simulator does, while it runs",
                             common.domain)});
  }
  if (!answer->starts_with("[ok] ")) {
    return fail(common,
                {ErrorCode::kInvalidArgument, answer->substr(answer->starts_with("[fail] ") ? 7 : 0)});
  }
  // time_s=12.34 state=running rate=max
  Json json = Json::object();
  std::istringstream fields(answer->substr(5));
  for (std::string field; fields >> field;) {
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) continue;
    const std::string value = field.substr(equals + 1);
    const Json number = Json::parse(value, nullptr, false);
    json[field.substr(0, equals)] = number.is_number() ? number : Json(value);
  }
  if (common.json) {
    fmt::print("{}\n", json.dump());
  } else {
    fmt::print("{} at {} s, rate {}\n", json.value("state", "?"), json.value("time_s", 0.0),
               json["rate"].is_string() ? json["rate"].get<std::string>() : json["rate"].dump());
  }
  return 0;
}

}  // namespace nido::cli
