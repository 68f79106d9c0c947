#include "user_data.h"

#include <algorithm>
#include <iterator>
#include <map>

namespace nido {

namespace {

struct TypeHash {
  const char* dds_type;
  const char* hash;
};
#include "type_hashes.inc"

std::map<std::string, std::string> pairs_of(const std::string& text) {
  std::map<std::string, std::string> pairs;
  std::size_t begin = 0;
  for (auto end = text.find(';'); end != std::string::npos; end = text.find(';', begin)) {
    const auto equals = text.find('=', begin);
    if (equals != std::string::npos && equals < end) {
      pairs[text.substr(begin, equals - begin)] = text.substr(equals + 1, end - equals - 1);
    }
    begin = end + 1;
  }
  return pairs;
}

}  // namespace

std::string type_hash_of(const std::string& dds_type) {
  const auto* const found =
      std::find_if(std::begin(kTypeHashes), std::end(kTypeHashes),
                   [&](const TypeHash& candidate) { return dds_type == candidate.dds_type; });
  return found == std::end(kTypeHashes) ? "" : found->hash;
}

std::vector<unsigned char> pack_user_data(const EndpointUserData& data) {
  std::string text = "nido=1;node=" + data.node + ";port=" + data.port + ";profile=" + data.profile + ";";
  if (!data.lane_place.empty()) {
    text += "lane=" + data.lane_place + ";";
  }
  if (const std::string hash = type_hash_of(data.dds_type); !hash.empty()) {
    text += "typehash=" + hash + ";";
  }
  return {text.begin(), text.end()};
}

void unpack_user_data(const std::vector<unsigned char>& data, EndpointInfo& info) {
  auto pairs = pairs_of(std::string(data.begin(), data.end()));
  if (pairs.contains("nido")) {
    info.node = pairs["node"];
    info.port = pairs["port"];
    info.profile = pairs["profile"];
    info.lane_place = pairs["lane"];
  }
}

}  // namespace nido
