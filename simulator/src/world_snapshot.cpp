// The world port's verbs that go back: snapshots of the whole simulation, and its beginning.
#include <array>
#include <fstream>
#include <sstream>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr std::size_t kMostSnapshots = 8;
constexpr const char* kEnding = ".snapshot.json";
constexpr std::uintmax_t kLargestFile = 64U << 20U;

std::string read_name(Arguments& arguments) {
  std::string name = arguments.done() ? "default" : arguments.word("the name");
  if (arguments.ok() && (name.empty() || name.size() > 60))
    arguments.fail("could not set name", "a name has 1 to 60 characters");
  return name;
}

std::string take(Impl& sim, Arguments& arguments) {
  const std::string name = read_name(arguments);
  const bool to_file = arguments.ok() && !arguments.done();
  if (to_file && arguments.word("file") != "file")
    arguments.fail("could not use file", "after the name comes file, or nothing");
  arguments.end();
  const std::filesystem::path path =
      to_file ? scene_file(sim, arguments, name, kEnding, true) : std::filesystem::path();
  if (!arguments.ok()) return arguments.failure();
  if (sim.snapshots.size() >= kMostSnapshots && sim.snapshots.count(name) == 0) {
    return fail_reply("too many snapshots",
                      "there are " + std::to_string(kMostSnapshots) + "; use a name again");
  }
  WorldSnapshot made = sim.snapshot();
  if (to_file) {
    const std::string trouble = write_file(path, snapshot_text(made, sim.state_shape()));
    if (!trouble.empty()) return fail_reply("could not save", trouble);
  }
  sim.snapshots[name] = std::move(made);
  return "[ok]";
}

Result<WorldSnapshot> read_file(const Impl& sim, const std::filesystem::path& path) {
  std::error_code trouble;
  const auto size = std::filesystem::file_size(path, trouble);
  if (trouble) return Error{ErrorCode::kNotFound, "there is no file " + path.string()};
  if (size > kLargestFile)
    return Error{ErrorCode::kInvalidArgument, path.string() + " is too large for a snapshot"};
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return read_snapshot(text.str(), sim.state_shape(), path.string());
}

std::string restore(Impl& sim, Arguments& arguments) {
  const std::string name = read_name(arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const auto found = sim.snapshots.find(name);
  if (found != sim.snapshots.end()) {
    keep_time(sim, [&] { sim.restore(found->second); });
    return "[ok]";
  }
  std::string names;
  for (const auto& [known, snapshot] : sim.snapshots) names += (names.empty() ? "" : ", ") + known;
  const std::filesystem::path path = scene_file(sim, arguments, name, kEnding, false);
  if (!arguments.ok() || !std::filesystem::exists(path)) {
    return fail_reply("no such snapshot", (names.empty() ? "there is none" : "there are: " + names) +
                                              ", and no file " + name + kEnding + " in " +
                                              sim.options.scene_folder.string());
  }
  Result<WorldSnapshot> read = read_file(sim, path);
  if (!read) return fail_reply("could not restore", read.error().message);
  read->object_set = ++sim.last_object_set;
  keep_time(sim, [&] { sim.restore(*read); });
  return "[ok]";
}

std::string reset(Impl& sim, Arguments& arguments) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  keep_time(sim, [&] { sim.reset(); });
  return "[ok]";
}

std::string hash(Impl& sim, Arguments& arguments) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  return hash_word(hash_of(sim.snapshot()));
}

constexpr std::array<WorldVerb, 4> kVerbs = {{
    {"snapshot", take, "[NAME [file]]",
     "keeps the whole simulation (robot, drives, touch, objects, also those deleted later, faults, light) to "
     "come back to; up to eight; file: also as NAME.snapshot.json in the scene folder, for another process",
     "world snapshot before"},
    {"restore", restore, "[NAME]",
     "back to a snapshot, or to the one in NAME.snapshot.json: from there it has the same future bit for "
     "bit; "
     "the clock goes on",
     "world restore before"},
    {"hash", hash, "",
     "16 hexadecimal digits for the complete state: all that a snapshot keeps, but the time and the pictures "
     "of broken eyes; runs are the same if they are the same at every step (the port /icubSim/state_hash:o)",
     "world hash"},
    {"reset", reset, "", "robot and objects as at the start; the clock goes on", "world reset"},
}};

}  // namespace

WorldVerbs snapshot_verbs() { return {"Going back", kVerbs}; }

}  // namespace nido::sim
