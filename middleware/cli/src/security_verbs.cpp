#include "security_verbs.h"

#include <fmt/format.h>

#include <memory>

#include "nido/middleware/key_store.h"
#include "verbs.h"

namespace nido::cli {

namespace {

int init(const Common& common, const std::string& folder) {
  if (auto status = make_key_store(folder); !status) return fail(common, status.error());
  if (common.json) {
    fmt::print("{}\n", Json{{"folder", folder}}.dump());
    return 0;
  }
  fmt::print(
      "{0}: keys for everybody who has this folder.\n"
      "Copy it, without {0}/authority, to the other computers, and write 'security: {0}' into the network "
      "file of "
      "each\n(docs/network.md).\n",
      folder);
  return 0;
}

struct AddRequest {
  std::string folder;
  std::string node;
  KeyPermissions permissions;
};

int add(const Common& common, const AddRequest& request) {
  if (auto status = add_identity(request.folder, request.node, request.permissions); !status)
    return fail(common, status.error());
  const std::string identity = request.folder + "/identities/" + request.node;
  if (common.json) {
    fmt::print("{}\n", Json{{"node", request.node}, {"identity", identity}}.dump());
    return 0;
  }
  fmt::print("{}: node {} may do what was said, and nothing else.\n", identity, request.node);
  return 0;
}

}  // namespace

void add_security(CLI::App& root, Common& common) {
  CLI::App* group = root.add_subcommand("security", "keys for a network that is not trusted");
  group->require_subcommand(1)->footer("example\n  nido security init keys");

  const auto folder = std::make_shared<std::string>();
  CLI::App* first =
      group->add_subcommand("init", "make a folder of keys: an authority and an identity for everybody");
  first->footer("example\n  nido security init keys");
  first->add_option("folder", *folder, "where; it may not be there yet")->required();
  first->add_flag("--json", common.json, "print JSON");
  first->callback([&common, folder] { throw CLI::RuntimeError(init(common, *folder)); });

  const auto request = std::make_shared<AddRequest>();
  CLI::App* second =
      group->add_subcommand("add", "make the identity of one node, which may do no more than is said");
  second->footer("example\n  nido security add keys watcher --read '/icubSim/*' --call /icubSim/world");
  second->add_option("folder", request->folder, "made by init, with its authority")->required();
  second->add_option("node", request->node, "name of the node")->required();
  const auto ports = [&](const char* option, const char* meaning, std::vector<std::string>& place) {
    second->add_option(option, place, meaning)->expected(1)->take_all()->type_name("PORT");
  };
  ports("--write", "an output that it may have; * at the end stands for anything",
        request->permissions.write);
  ports("--read", "an output of others that it may read", request->permissions.read);
  ports("--serve", "a service that it may answer", request->permissions.serve);
  ports("--call", "a service that it may call", request->permissions.call);
  second->add_flag("--json", common.json, "print JSON");
  second->callback([&common, request] { throw CLI::RuntimeError(add(common, *request)); });
}

}  // namespace nido::cli
