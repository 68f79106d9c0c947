#pragma once

#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// The keys of a system that encrypts what it says (DDS Security 1.1: PKI-DH, signed permissions, AES-GCM). A
// folder:
//   authority/            the certificate authority; its key.pem makes new identities and stays at home
//   certificate.pem       the authority's certificate
//   governance.smime      what is protected: everything
//   identities/NAME/      certificate.pem, key.pem, permissions.smime of one node; `anybody` for all others
// Processes read all of it but authority/, so that folder is not copied to other computers.

// Makes the folder with an authority and the identity `anybody`, which may write and read every port. Fails
// with kTaken when there is something at that place already.
Status make_key_store(const std::string& folder);

// What an identity may do: names of ports and services ("/icubSim/head/rpc:i", "/vision/*").
struct KeyPermissions {
  std::vector<std::string> write{};
  std::vector<std::string> read{};
  std::vector<std::string> serve{};  // answer calls of these services
  std::vector<std::string> call{};
};

// Makes the identity of the node `name`: this node may do no more than that, and what every node does (tell
// of itself, its log, its control service, /clock). The authority's key must be there. kNotFound without it,
// kTaken when the identity is there already, kInvalidArgument for a name or port that is none.
Status add_identity(const std::string& folder, const std::string& name, const KeyPermissions& permissions);

}  // namespace nido
