// The world port: finds the verb of a line, and tells about all of them.
#include <array>

#include "ode_library.h"
#include "world_verbs.h"

namespace nido::sim {
namespace {

std::array<WorldVerbs, 9> all_verbs() {
  return {making_verbs(), placing_verbs(),  motion_verbs(), joint_verbs(),  scene_verbs(),
          time_verbs(),   snapshot_verbs(), fault_verbs(),  judging_verbs()};
}

const WorldVerb* find_verb(const std::string& name) {
  for (const WorldVerbs& group : all_verbs()) {
    for (const WorldVerb& verb : group.verbs) {
      if (name == verb.name) return &verb;
    }
  }
  return nullptr;
}

std::string usage(const WorldVerb& verb) {
  return std::string("world ") + verb.name + (*verb.arguments == 0 ? "" : " ") + verb.arguments;
}

std::string help() {
  std::string text = "OBJECT is KIND N (box 1) or a name. x left, y up, z forward, m.";
  for (const WorldVerbs& group : all_verbs()) {
    text += std::string("\n") + group.title + ":";
    for (const WorldVerb& verb : group.verbs) text += "\n" + usage(verb) + ": " + verb.meaning;
  }
  return text + "\nworld help [VERB]: this, or one verb with an example";
}

std::string unknown_verb() {
  std::string known;
  for (const WorldVerbs& group : all_verbs()) {
    for (const WorldVerb& verb : group.verbs) known += std::string(verb.name) + ", ";
  }
  return fail_reply("unrecognized command", "world knows " + known + "help");
}

std::string help(Arguments& arguments) {
  if (arguments.done()) return help();
  const std::string name = arguments.word("the verb");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const WorldVerb* verb = find_verb(name);
  if (verb == nullptr) return unknown_verb();
  return usage(*verb) + ": " + verb->meaning + "\nexample: " + verb->example;
}

// safe inside a cell of a table
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? "\\|" : std::string(1, c);
  return out;
}

}  // namespace

std::string world_reference() {
  std::string text;
  for (const WorldVerbs& group : all_verbs()) {
    text += std::string("#### ") + group.title + "\n| line | does | example |\n|---|---|---|\n";
    for (const WorldVerb& verb : group.verbs) {
      text += "| `" + cell(usage(verb)) + "` | " + cell(verb.meaning) + " | `" + cell(verb.example) + "` |\n";
    }
    text += "\n";
  }
  return text;
}

std::string run_world_command(Simulation::Impl& simulation, const std::string& line) {
  Words split = split_words(line);
  if (!split.trouble.empty()) return fail_reply("cannot read the line", split.trouble);
  if (split.words.empty()) return fail_reply("unrecognized command", "say world help");
  // the first word may be left out: `nido world list`; a vocabulary word of YARP has four letters
  Arguments arguments(std::move(split.words));
  if (arguments.peek() == "world" || arguments.peek() == "worl") arguments.skip();
  const std::string name = arguments.peek();
  arguments.skip();
  if (name == "help") return help(arguments);
  const WorldVerb* verb = find_verb(name);
  if (verb == nullptr) return unknown_verb();
  arguments.set_usage(usage(*verb));
  try {
    return verb->run(simulation, arguments);
  } catch (const OdeError& e) {
    return fail_reply("cannot create object of requested type", e.what());
  }
}

}  // namespace nido::sim
