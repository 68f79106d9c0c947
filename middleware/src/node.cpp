#include "nido/middleware/node.h"

#include <sys/resource.h>

#include <cstdio>
#include <iostream>
#include <string_view>

#include "node_impl.h"

namespace nido {

namespace {

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kTaken:
      return 2;
    case ErrorCode::kNotFound:
    case ErrorCode::kTimeout:
    case ErrorCode::kUnsupported:
      return 3;
    case ErrorCode::kInterrupted:
      return 130;
    default:
      return 1;
  }
}

// Each connection takes an open file: as many of these as the system grants, not the few that it begins with.
void allow_many_files() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0) {
    files.rlim_cur = files.rlim_max;
    (void)setrlimit(RLIMIT_NOFILE, &files);
  }
}

}  // namespace

Result<std::unique_ptr<Node>> Node::create(NodeOptions options) {
  auto node = NodeImpl::make(std::move(options));
  if (!node) {
    return node.error();
  }
  return std::unique_ptr<Node>(std::move(node).value());
}

int node_main(int argc, char** argv, const std::string& default_name,
              const std::function<Status(Node&)>& body) {
  if (argc == 2 && std::string_view(argv[1]) == "--help") {
    std::cout << "nido-" << default_name << ": a process of a nido system; 'nido launch' starts it.\n"
              << "  --node FILE          name, domain, clock, parameters and connections from a YAML file\n"
              << "  --name NAME          default " << default_name << "\n"
              << "  --domain N           DDS domain, default ROS_DOMAIN_ID or 0\n"
              << "  --clock wall|simulated|lockstep\n"
              << "  --period SECONDS     between two calls, default 0.01\n"
              << "  --seed N             of its random generators, default 1\n"
              << "  --set KEY=VALUE      a parameter, may come several times\n"
              << "  --connect OUT=IN     a connection to an own input, may come several times\n";
    return 0;
  }
  auto options = Node::options_from_args(argc, argv, default_name);
  if (!options) {
    std::cerr << default_name << ": " << options.error().message << "\n";
    return exit_code_of(options.error().code);
  }
  allow_many_files();
  const std::string name = options->name;
  auto node = Node::create(std::move(options).value());
  if (!node) {
    std::cerr << name << ": " << node.error().message << "\n";
    return exit_code_of(node.error().code);
  }
  const Status status = body(**node);
  if (status) {
    return 0;
  }
  // being stopped is a good end for a node
  if (status.error().code == ErrorCode::kInterrupted) {
    return 0;
  }
  (*node)->set_failed(status.error().message);
  return exit_code_of(status.error().code);
}

}  // namespace nido
