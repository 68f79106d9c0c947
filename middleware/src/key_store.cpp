#include "nido/middleware/key_store.h"

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include "nido/middleware/port_name.h"

namespace nido {

namespace {

namespace fs = std::filesystem;

template <auto kFree>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Signature = std::unique_ptr<PKCS7, Freed<PKCS7_free>>;

constexpr long kValid_s = 10L * 365 * 24 * 3600;
constexpr const char* kAnybody = "anybody";

Error crypto_error(const std::string& what) {
  const unsigned long code = ERR_get_error();
  const char* const reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  return {ErrorCode::kFailed, "cannot " + what + (reason == nullptr ? "" : std::string(": ") + reason)};
}

Key new_key() { return Key(EVP_EC_gen("P-256")); }

bool set_subject(X509* certificate, const std::string& name) {
  X509_NAME* const subject = X509_get_subject_name(certificate);
  const auto add = [&](const char* field, const std::string& text) {
    return X509_NAME_add_entry_by_txt(subject, field, MBSTRING_UTF8,
                                      reinterpret_cast<const unsigned char*>(text.data()),
                                      static_cast<int>(text.size()), -1, 0) == 1;
  };
  return add("O", "nido") && add("CN", name);
}

// Signed by the authority; by itself when there is none yet.
Certificate new_certificate(EVP_PKEY* key, const std::string& name, X509* authority,
                            EVP_PKEY* authority_key) {
  Certificate certificate(X509_new());
  unsigned char serial[16];
  const bool is_authority = authority == nullptr;
  if (!certificate || RAND_bytes(serial, sizeof serial) != 1) {
    return nullptr;
  }
  serial[0] &= 0x7fU;  // positive
  std::unique_ptr<BIGNUM, Freed<BN_free>> number(BN_bin2bn(serial, sizeof serial, nullptr));
  bool good = number &&
              BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate.get())) != nullptr &&
              X509_set_version(certificate.get(), X509_VERSION_3) == 1 &&
              // a day of slack: the clocks of other computers
              X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -24L * 3600) != nullptr &&
              X509_gmtime_adj(X509_getm_notAfter(certificate.get()), kValid_s) != nullptr &&
              X509_set_pubkey(certificate.get(), key) == 1 && set_subject(certificate.get(), name) &&
              X509_set_issuer_name(certificate.get(),
                                   X509_get_subject_name(is_authority ? certificate.get() : authority)) == 1;
  if (good && is_authority) {
    std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
        X509V3_EXT_conf_nid(nullptr, nullptr, NID_basic_constraints, "critical,CA:TRUE"));
    good = extension && X509_add_ext(certificate.get(), extension.get(), -1) == 1;
  }
  good = good && X509_sign(certificate.get(), is_authority ? key : authority_key, EVP_sha256()) > 0;
  return good ? std::move(certificate) : nullptr;
}

Status write_key(const fs::path& file, EVP_PKEY* key) {
  const Bio bio(BIO_new_file(file.c_str(), "w"));
  if (!bio || chmod(file.c_str(), S_IRUSR | S_IWUSR) != 0 ||
      PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1) {
    return crypto_error("write " + file.string());
  }
  return {};
}

Status write_certificate(const fs::path& file, X509* certificate) {
  const Bio bio(BIO_new_file(file.c_str(), "w"));
  if (!bio || PEM_write_bio_X509(bio.get(), certificate) != 1) {
    return crypto_error("write " + file.string());
  }
  return {};
}

Status write_signed(const fs::path& file, const std::string& text, X509* authority, EVP_PKEY* key) {
  const Bio content(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED;
  const Signature signature(content ? PKCS7_sign(authority, key, nullptr, content.get(), kFlags) : nullptr);
  const Bio out(BIO_new_file(file.c_str(), "w"));
  const Bio again(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (!signature || !out || !again ||
      SMIME_write_PKCS7(out.get(), signature.get(), again.get(), kFlags) != 1) {
    return crypto_error("sign " + file.string());
  }
  return {};
}

Status make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return Error{ErrorCode::kFailed, "cannot make folder " + folder.string() + ": " + error.message()};
  }
  return {};
}

// Everything is protected, and nobody without keys takes part.
constexpr const char* kGovernance = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
     xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>230</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>NONE</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";

using Topics = std::vector<std::string>;

std::string rule_of(const std::string& verb, const Topics& topics) {
  std::string text = "        <" + verb + "><topics>\n";
  for (const std::string& topic : topics) {
    text += "          <topic>" + topic + "</topic>\n";
  }
  return text + "        </topics></" + verb + ">\n";
}

std::string utc(std::time_t time) {
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  return text;
}

std::string permissions_xml(const std::string& name, const Topics& publish, const Topics& subscribe) {
  const std::time_t now = std::time(nullptr);
  return R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
     xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name=")" +
         name + R"(">
      <subject_name>CN=)" +
         name + ",O=nido</subject_name>\n      <validity><not_before>" + utc(now - 24L * 3600) +
         "</not_before><not_after>" + utc(now + kValid_s) + R"(</not_after></validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>230</max></id_range></domains>
)" + rule_of("publish", publish) +
         rule_of("subscribe", subscribe) + R"(      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)";
}

struct Authority {
  Certificate certificate;
  Key key;
};

Result<Authority> read_authority(const fs::path& folder) {
  const Bio certificate(BIO_new_file((folder / "certificate.pem").c_str(), "r"));
  const Bio key(BIO_new_file((folder / "authority" / "key.pem").c_str(), "r"));
  Authority authority;
  if (certificate && key) {
    authority.certificate.reset(PEM_read_bio_X509(certificate.get(), nullptr, nullptr, nullptr));
    authority.key.reset(PEM_read_bio_PrivateKey(key.get(), nullptr, nullptr, nullptr));
  }
  if (!authority.certificate || !authority.key) {
    return Error{ErrorCode::kNotFound,
                 folder.string() +
                     " has no authority: certificate.pem and authority/key.pem, as 'nido security " +
                     "init' makes them, are not there or cannot be read"};
  }
  return authority;
}

Status write_identity(const fs::path& folder, const std::string& name, const Authority& authority,
                      const Topics& publish, const Topics& subscribe) {
  const fs::path place = folder / "identities" / name;
  if (fs::exists(place)) {
    return Error{ErrorCode::kTaken, "identity " + name + " is there already: " + place.string()};
  }
  const Key key = new_key();
  const Certificate certificate =
      key ? new_certificate(key.get(), name, authority.certificate.get(), authority.key.get()) : nullptr;
  if (!certificate) {
    return crypto_error("make a certificate for " + name);
  }
  Status status = make_folder(place);
  status = status ? write_key(place / "key.pem", key.get()) : status;
  status = status ? write_certificate(place / "certificate.pem", certificate.get()) : status;
  return status ? write_signed(place / "permissions.smime", permissions_xml(name, publish, subscribe),
                               authority.certificate.get(), authority.key.get())
                : status;
}

// A name of a port, or a part of it with * at its end, as DDS topic.
Result<std::string> topic_pattern(const std::string& port, std::string (*topic_of_name)(const std::string&)) {
  const bool is_pattern = port.ends_with("*");
  const std::string plain = is_pattern ? port.substr(0, port.size() - 1) : port;
  const std::string complete = is_pattern ? plain + "x" : plain;  // "/vision/" is the begin of a name
  if (auto status = check_port_name(complete); !status) {
    return status.error();
  }
  std::string topic = topic_of_name(complete);
  if (is_pattern) {
    topic = topic.substr(0, topic.rfind('x')) + "*";
  }
  return topic;
}

}  // namespace

Status make_key_store(const std::string& folder) {
  const fs::path place(folder);
  if (fs::exists(place)) {
    return Error{ErrorCode::kTaken, folder + " is there already; choose another folder, or remove that one"};
  }
  Authority authority;
  authority.key = new_key();
  authority.certificate =
      authority.key ? new_certificate(authority.key.get(), "nido authority", nullptr, nullptr) : nullptr;
  if (!authority.certificate) {
    return crypto_error("make a certificate authority");
  }
  Status status = make_folder(place / "authority");
  std::error_code error;
  fs::permissions(place / "authority", fs::perms::owner_all, error);
  status = status ? write_key(place / "authority" / "key.pem", authority.key.get()) : status;
  status = status ? write_certificate(place / "certificate.pem", authority.certificate.get()) : status;
  status = status ? write_signed(place / "governance.smime", kGovernance, authority.certificate.get(),
                                 authority.key.get())
                  : status;
  return status ? write_identity(place, kAnybody, authority, {"*"}, {"*"}) : status;
}

Status add_identity(const std::string& folder, const std::string& name, const KeyPermissions& permissions) {
  if (auto status = check_port_name("/" + name); !status || name == kAnybody) {
    return Error{ErrorCode::kInvalidArgument, "'" + name + "' is not the name of a node"};
  }
  // of every node
  Topics publish{"rt/log", "rt/nido/*", "rr/" + name + "/controlReply"};
  Topics subscribe{"rt/clock", "rt/nido/*", "rq/" + name + "/controlRequest"};
  const auto add = [](const std::vector<std::string>& ports, std::string (*topic)(const std::string&),
                      Topics& place) -> Status {
    for (const std::string& port : ports) {
      auto pattern = topic_pattern(port, topic);
      if (!pattern) {
        return pattern.error();
      }
      place.push_back(*pattern);
    }
    return {};
  };
  Status status = add(permissions.write, topic_of, publish);
  status = status ? add(permissions.read, topic_of, subscribe) : status;
  status = status ? add(permissions.serve, reply_topic_of, publish) : status;
  status = status ? add(permissions.serve, request_topic_of, subscribe) : status;
  status = status ? add(permissions.call, request_topic_of, publish) : status;
  status = status ? add(permissions.call, reply_topic_of, subscribe) : status;
  if (!status) {
    return status;
  }
  auto authority = read_authority(folder);
  if (!authority) {
    return authority.error();
  }
  return write_identity(folder, name, *authority, publish, subscribe);
}

}  // namespace nido
