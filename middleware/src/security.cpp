#include "security.h"

#include <filesystem>
#include <fstream>

namespace nido {

namespace fs = std::filesystem;

Status use_keys(const std::string& folder, const std::string& node_name,
                eprosima::fastdds::dds::DomainParticipantQos& qos) {
  const fs::path store = fs::absolute(folder);
  fs::path identity = store / "identities" / node_name;
  if (!fs::exists(identity)) {
    identity = store / "identities" / "anybody";
  }
  const std::string authority = store / "certificate.pem";
  const std::string governance = store / "governance.smime";
  const std::string certificate = identity / "certificate.pem";
  const std::string key = identity / "key.pem";
  const std::string permissions = identity / "permissions.smime";
  for (const std::string& file : {authority, governance, certificate, key, permissions}) {
    if (!std::ifstream(file)) {
      return Error{ErrorCode::kNotFound,
                   "node " + node_name + " has no keys: " + file +
                       " is not there or cannot be read; 'nido security init' makes them"};
    }
  }
  auto& properties = qos.properties().properties();
  const auto set = [&](const std::string& name, const std::string& value) {
    properties.emplace_back(name, value);
  };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set("dds.sec.auth.builtin.PKI-DH.identity_ca", "file://" + authority);
  set("dds.sec.auth.builtin.PKI-DH.identity_certificate", "file://" + certificate);
  set("dds.sec.auth.builtin.PKI-DH.private_key", "file://" + key);
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set("dds.sec.access.builtin.Access-Permissions.permissions_ca", "file://" + authority);
  set("dds.sec.access.builtin.Access-Permissions.governance", "file://" + governance);
  set("dds.sec.access.builtin.Access-Permissions.permissions", "file://" + permissions);
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  return {};
}

}  // namespace nido
