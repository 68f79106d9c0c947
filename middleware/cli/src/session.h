#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nido/cli/any_type.h"
#include "nido/interfaces/result.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"

namespace nido::cli {

// Options that every verb has.
struct Common {
  int domain = 0;
  bool json = false;
  double wait_s = 3.0;                // wall time that a thing is waited for
  std::vector<std::string> idl = {};  // files that define message types
};

// A tool's look into a domain: a hidden node and the directory.
struct Session {
  std::unique_ptr<Node> node;
  std::unique_ptr<Directory> directory;
};
// What Ctrl-C means to a verb that looks or asks: it has a second to end, whatever it waits for then; or to
// one that has something to finish.
enum class Ending { kSoon, kWhenDone };
// Joins, and catches signals.
Result<Session> join(const Common& common, Ending ending = Ending::kSoon);
// Waits until the picture of the directory has not changed for a while.
void settle(Directory& directory);

// From here on Ctrl-C and SIGTERM only set interrupted(); join() does that, too.
void catch_signals();
// Ctrl-C was pressed since.
bool interrupted();

// Prints a failure as one sentence on stderr, with --json also as an object on stdout, and returns its exit
// code.
int fail(const Common& common, const Error& error);
// A node by its name, waited for; kNotFound suggests a near name.
Result<NodeDescription> find_node(const Session& session, const Common& common, const std::string& name);
// The port's owner, waited for; kNotFound suggests a near name.
Result<Directory::Owner> find_port(const Session& session, const Common& common, const std::string& port);
// The type of a port: one that nido was built with, or one that a file of --idl defines, or that the port's
// node tells the definition of. nullptr if nobody knows it; kInvalidArgument if a file is no IDL.
Result<std::shared_ptr<const AnyType>> type_named(const Session& session, const Common& common,
                                                  const std::string& port, const std::string& name);
// Type and profile of an output port, of a nido process or of any DDS program.
struct Source {
  std::shared_ptr<const AnyType> type;  // of a type that is not known here: its bytes
  Profile profile = Profile::kSensor;
};
Result<Source> find_source(const Session& session, const Common& common, const std::string& port);

}  // namespace nido::cli
