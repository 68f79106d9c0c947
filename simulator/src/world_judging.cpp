// The world port's ground truth, in the root frame, for judges and experiments: never for a node that
// perceives or acts.
#include <algorithm>
#include <array>

#include "nido/simulator/scene_labels.h"
#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

std::string where(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const ObjectBody& object = *sim.objects[index];
  const Eigen::AlignedBox3d box = bounds(object.description());
  return pose_text(object.X_WorldObject() * Eigen::Translation3d(box.center())) + " " +
         vector_text(box.sizes());
}

std::string touching(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const HoldQuery hold = sim.contacts->hold(index, sim.objects);
  const auto any = [](const auto& pads) {
    return std::any_of(pads.begin(), pads.end(), [](bool on) { return on; });
  };
  return std::string(any(hold.left) || any(hold.right) ? "1" : "0") + (hold.world ? " 1" : " 0");
}

std::string inside(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  const std::size_t basket = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  return sim.is_inside(index, basket) ? "1" : "0";
}

std::string palm(Impl& sim, Arguments& arguments) {
  const std::string side = arguments.word("left or right");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (side != "left" && side != "right") return fail_reply("hand not recognized", "left or right");
  const RobotBody::Frame frame = sim.robot->find_frame(sim.block.hands[side == "left" ? 0 : 1].frame);
  if (frame.link < 0) return fail_reply("hand not recognized", "this robot has no such hand");
  return pose_text(sim.pose(frame));
}

std::string contacts(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const std::string& name = sim.objects[index]->description().name;
  std::string reply;
  for (const ContactPair& pair : sim.contacts->pairs(sim.objects)) {
    const bool is_a = pair.a == name && !pair.a_is_robot;
    if (!is_a && pair.b != name) continue;
    reply += std::string(reply.empty() ? "" : " ") + "(" + name_text(is_a ? pair.b : pair.a) + " " +
             number_text(pair.force_N) + ")";
  }
  return reply.empty() ? "[ok]" : reply;
}

std::string link(Impl& sim, Arguments& arguments) {
  if (arguments.done()) {
    std::string names;
    for (const std::string& name : sim.link_names) names += (names.empty() ? "" : " ") + name_text(name);
    return names;
  }
  const std::string name = arguments.word("the link");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const RobotBody::Frame frame = sim.robot->find_frame(name);
  if (frame.link < 0) {
    return fail_reply("link not recognized", "the robot has no link of that name; world link lists them");
  }
  return pose_text(sim.pose(frame));
}

std::string labels(Impl& sim, Arguments& arguments) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  SceneSnapshot scene;
  sim.scene(scene);
  std::string reply;
  int label = 0;
  for (const std::string& name : scene_labels(scene))
    reply +=
        std::string(reply.empty() ? "" : " ") + "(" + std::to_string(++label) + " " + name_text(name) + ")";
  return reply.empty() ? "[ok]" : reply;
}

constexpr std::array<WorldVerb, 7> kVerbs = {{
    {"where", where, "OBJECT", "x y z qx qy qz qw sx sy sz: centre and edges of its box",
     "world where box 1"},
    {"touching", touching, "OBJECT", "1 if a hand touches it, 1 if table, floor or another object does",
     "world touching box 1"},
    {"contacts", contacts, "OBJECT", "(NAME FORCE) of everything that touches it, N", "world contacts box 1"},
    {"inside", inside, "OBJECT BASKET", "1 or 0", "world inside box 1 basket"},
    {"palm", palm, "left|right", "x y z qx qy qz qw of the palm frame", "world palm right"},
    {"link", link, "[NAME]", "x y z qx qy qz qw of any link; without a name, all names",
     "world link r_index_tip"},
    {"labels", labels, "", "(LABEL NAME) of all that segmentation images show; 0 is the room",
     "world labels"},
}};

}  // namespace

WorldVerbs judging_verbs() { return {"Ground truth, in the root frame", kVerbs}; }

}  // namespace nido::sim
