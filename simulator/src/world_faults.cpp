// The world port's verb for what goes wrong on purpose.
#include <algorithm>
#include <array>
#include <cmath>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr std::array<const char*, 2> kSides = {"left", "right"};
constexpr std::array<const char*, kPadCount> kPads = {"thumb", "index", "middle", "ring", "little", "palm"};

// Words of the faults; the first is none.
constexpr std::array<std::pair<const char*, CameraFault>, 5> kCameraFaults = {{{"none", CameraFault::kNone},
                                                                               {"stuck", CameraFault::kStuck},
                                                                               {"off", CameraFault::kOff},
                                                                               {"noise", CameraFault::kNoise},
                                                                               {"slow", CameraFault::kSlow}}};
constexpr std::array<std::pair<const char*, JointFault>, 4> kJointFaults = {{{"none", JointFault::kNone},
                                                                             {"stuck", JointFault::kStuck},
                                                                             {"weak", JointFault::kWeak},
                                                                             {"off", JointFault::kOff}}};
constexpr std::array<std::pair<const char*, SkinFault>, 3> kSkinFaults = {
    {{"none", SkinFault::kNone}, {"stuck", SkinFault::kStuck}, {"off", SkinFault::kOff}}};

// The last word of the line.
template <class Fault, std::size_t N>
Fault read_fault(Arguments& arguments, const std::array<std::pair<const char*, Fault>, N>& known) {
  const std::string word = arguments.word("the fault");
  arguments.end();
  std::string names;
  for (const auto& [name, fault] : known) {
    if (word == name) return fault;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  arguments.fail("fault not recognized", "here there are " + names);
  return known[0].second;
}

template <class Fault, std::size_t N>
std::string word_of(Fault fault, const std::array<std::pair<const char*, Fault>, N>& known) {
  const auto* found =
      std::find_if(known.begin(), known.end(), [&](const auto& entry) { return entry.second == fault; });
  return found->first;
}

std::size_t read_side(Arguments& arguments) {
  const std::string side = arguments.word("left or right");
  if (arguments.ok() && side != kSides[0] && side != kSides[1])
    arguments.fail("side not recognized", "left or right");
  return side == kSides[0] ? 0 : 1;
}

std::string all_faults(const Impl& sim) {
  std::string text;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "(" : " (") + what + ")"; };
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    if (sim.camera_fault[side] != CameraFault::kNone)
      add(std::string("cam ") + kSides[side] + " " + word_of(sim.camera_fault[side], kCameraFaults));
    for (std::size_t pad = 0; pad < kPadCount; ++pad) {
      const SkinFault fault = sim.contacts->skin_fault(side, pad);
      if (fault != SkinFault::kNone)
        add(std::string("skin ") + kSides[side] + " " + kPads[pad] + " " + word_of(fault, kSkinFaults));
    }
  }
  for (std::size_t patch = 0; patch < sim.contacts->skin().patches().size(); ++patch) {
    const SkinFault fault = sim.contacts->skin().fault(patch);
    if (fault != SkinFault::kNone)
      add("skin " + sim.contacts->skin().patches()[patch].name + " " + word_of(fault, kSkinFaults));
  }
  for (std::size_t part = 0; part < sim.drives->parts().size(); ++part) {
    const PartInfo& info = sim.drives->parts()[part];
    for (std::size_t j = 0; j < info.joints.size(); ++j) {
      const JointFault fault = sim.drives->fault(static_cast<int>(part), static_cast<int>(j));
      if (fault != JointFault::kNone)
        add(info.name + " " + std::to_string(j) + " " + word_of(fault, kJointFaults));
    }
  }
  return text.empty() ? "[ok]" : text;
}

void clear_faults(Impl& sim) {
  sim.camera_fault.fill(CameraFault::kNone);
  sim.films.clear();
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    for (std::size_t pad = 0; pad < kPadCount; ++pad)
      sim.contacts->set_skin_fault(side, pad, SkinFault::kNone);
  }
  for (std::size_t patch = 0; patch < sim.contacts->skin().patches().size(); ++patch)
    sim.contacts->set_patch_fault(patch, SkinFault::kNone);
  for (std::size_t part = 0; part < sim.drives->parts().size(); ++part) {
    for (std::size_t j = 0; j < sim.drives->parts()[part].joints.size(); ++j)
      sim.drives->set_fault(static_cast<int>(part), static_cast<int>(j), JointFault::kNone);
  }
}

std::string camera_fault(Impl& sim, Arguments& arguments) {
  const std::size_t side = read_side(arguments);
  const CameraFault fault = read_fault(arguments, kCameraFaults);
  if (!arguments.ok()) return arguments.failure();
  // a picture of the fault before must not come back; the left eye's films have even numbers, the right one's
  // odd
  if (fault != sim.camera_fault[side]) {
    for (std::size_t camera = side; camera < sim.films.size(); camera += 2) sim.films[camera] = {};
  }
  sim.camera_fault[side] = fault;
  return "[ok]";
}

// A patch by its name: left_forearm, torso.
std::string patch_fault(Impl& sim, Arguments& arguments, std::size_t patch) {
  const SkinFault fault = read_fault(arguments, kSkinFaults);
  if (!arguments.ok()) return arguments.failure();
  sim.contacts->set_patch_fault(patch, fault);
  return "[ok]";
}

std::string skin_fault(Impl& sim, Arguments& arguments) {
  std::string patches;
  for (std::size_t patch = 0; patch < sim.contacts->skin().patches().size(); ++patch) {
    const std::string& name = sim.contacts->skin().patches()[patch].name;
    if (!arguments.done() && arguments.peek() == name) {
      arguments.skip();
      return patch_fault(sim, arguments, patch);
    }
    patches += ", " + name;
  }
  if (!arguments.done() && arguments.peek() != kSides[0] && arguments.peek() != kSides[1])
    arguments.fail("skin not recognized", "left, right" + patches);
  const std::size_t side = read_side(arguments);
  const std::string word = arguments.word("the pad");
  const SkinFault fault = read_fault(arguments, kSkinFaults);
  const bool known = word == "all" || std::find(kPads.begin(), kPads.end(), word) != kPads.end();
  if (arguments.ok() && !known)
    arguments.fail("pad not recognized", "thumb, index, middle, ring, little, palm, all");
  if (!arguments.ok()) return arguments.failure();
  for (std::size_t pad = 0; pad < kPadCount; ++pad) {
    if (word == "all" || word == kPads[pad]) sim.contacts->set_skin_fault(side, pad, fault);
  }
  return "[ok]";
}

std::string joint_fault(Impl& sim, Arguments& arguments, std::size_t part) {
  const PartInfo& info = sim.drives->parts()[part];
  const double joint =
      arguments.number("could not set joint", "the joint", 0, static_cast<double>(info.joints.size()) - 1);
  if (arguments.ok() && joint != std::floor(joint))
    arguments.fail("could not set joint", "a joint's number is whole");
  const JointFault fault = read_fault(arguments, kJointFaults);
  if (!arguments.ok()) return arguments.failure();
  sim.drives->set_fault(static_cast<int>(part), static_cast<int>(joint), fault);
  return "[ok]";
}

std::string fault(Impl& sim, Arguments& arguments) {
  if (arguments.done()) return all_faults(sim);
  const std::string what = arguments.word("cam, skin, clear or a part");
  if (what == "clear") {
    arguments.end();
    if (!arguments.ok()) return arguments.failure();
    clear_faults(sim);
    return "[ok]";
  }
  if (what == "cam") return camera_fault(sim, arguments);
  if (what == "skin") return skin_fault(sim, arguments);
  std::string names;
  for (std::size_t part = 0; part < sim.drives->parts().size(); ++part) {
    if (sim.drives->parts()[part].name == what) return joint_fault(sim, arguments, part);
    names += ", " + sim.drives->parts()[part].name;
  }
  return fail_reply("fault not recognized", "clear, or of cam, skin" + names);
}

constexpr std::array<WorldVerb, 1> kVerbs = {{
    {"fault", fault,
     "[cam left|right stuck|off|noise|slow|none | PART JOINT stuck|weak|off|none | skin left|right PAD|all "
     "stuck|off|none | skin PATCH stuck|off|none | clear]",
     "breaks an eye (one picture for ever, black, grain, every fifth picture), a joint (does not turn, has a "
     "fifth of its torque, or none), a pad of a hand (thumb, index, middle, ring, little, palm) or a patch "
     "of skin (left_forearm, right_arm, torso, ...: says what it said then, or nothing) until reset or "
     "clear; without words, what is broken",
     "world fault left_arm 3 weak"},
}};

}  // namespace

WorldVerbs fault_verbs() { return {"Faults on purpose", kVerbs}; }

}  // namespace nido::sim
