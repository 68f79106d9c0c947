// The world port's verbs about things that hang together.
#include <array>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr std::size_t kMostShapes = 64;
constexpr std::size_t kMostJoints = 64;
constexpr double kFarthest_m = 100;

std::string join(Impl& sim, Arguments& arguments) {
  constexpr const char* kReason = "could not join";
  const std::size_t first = read_object(sim, arguments);
  const std::size_t second = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (first == second) return fail_reply(kReason, "an object cannot be joined to itself");
  ObjectDescription whole = sim.objects[first]->description();
  const ObjectDescription& part = sim.objects[second]->description();
  if (whole.is_static != part.is_static)
    return fail_reply(kReason, "a static object does not move with another");
  if (whole.shapes.size() + part.shapes.size() > kMostShapes)
    return fail_reply(kReason, "an object has at most " + std::to_string(kMostShapes) + " shapes");
  whole.X_WorldObject = sim.objects[first]->X_WorldObject();
  const Eigen::Isometry3d X_WholePart = whole.X_WorldObject.inverse() * sim.objects[second]->X_WorldObject();
  for (PlacedShape shape : part.shapes) {
    shape.X_OwnerShape = X_WholePart * shape.X_OwnerShape;
    whole.shapes.push_back(shape);
  }
  whole.touches_robot = whole.touches_robot || part.touches_robot;
  auto made = std::make_unique<ObjectBody>(sim.world.id(), std::move(whole));
  sim.contacts->forget();
  sim.objects[first] = std::move(made);
  sim.erase_object(second);
  objects_changed(sim);
  return "[ok]";
}

std::string all_joints(const Impl& sim) {
  std::string text;
  for (const ObjectJoint& joint : sim.joints) {
    const ObjectJointDescription d = describe(joint, sim.objects);
    text += std::string(text.empty() ? "(" : " (") + to_string(d.kind) + " " + name_text(d.a) + " " +
            name_text(d.b) + " " + vector_text(X_WorldPort().inverse() * d.p_World_m) + " " +
            vector_text(to_port(d.axis_World)) + ")";
  }
  return text.empty() ? "[ok]" : text;
}

// index, or -1 for the world
int read_partner(const Impl& sim, Arguments& arguments) {
  if (arguments.peek() == "world") {
    arguments.skip();
    return -1;
  }
  return static_cast<int>(read_object(sim, arguments));
}

std::string take_apart(Impl& sim, Arguments& arguments) {
  const auto a = static_cast<int>(read_object(sim, arguments));
  const int b = read_partner(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const auto gone = std::erase_if(sim.joints, [&](const ObjectJoint& joint) {
    return (joint.a == a && joint.b == b) || (joint.a == b && joint.b == a);
  });
  if (gone == 0) return fail_reply("no such joint", "world joint lists those that there are");
  sim.wake_all();
  return "[ok]";
}

std::string joint(Impl& sim, Arguments& arguments) {
  constexpr const char* kReason = "could not set joint";
  if (arguments.done()) return all_joints(sim);
  const std::string kind = arguments.word("the kind");
  if (kind == "none") return take_apart(sim, arguments);
  ObjectJointDescription wanted;
  bool known = false;
  for (const ObjectJointKind each :
       {ObjectJointKind::kBall, ObjectJointKind::kHinge, ObjectJointKind::kFixed}) {
    if (kind != to_string(each)) continue;
    wanted.kind = each;
    known = true;
  }
  if (!known) return fail_reply("joint not recognized", "ball, hinge, fixed, none");
  const std::size_t a = read_object(sim, arguments);
  const int b = read_partner(sim, arguments);
  if (!arguments.ok()) return arguments.failure();
  wanted.a = sim.objects[a]->description().name;
  wanted.b = b < 0 ? "world" : sim.objects[static_cast<std::size_t>(b)]->description().name;
  wanted.p_World_m = sim.objects[a]->X_WorldObject().translation();
  if (wanted.kind != ObjectJointKind::kFixed)
    wanted.p_World_m = X_WorldPort() * arguments.vector(kReason, "the place", -kFarthest_m, kFarthest_m);
  if (wanted.kind == ObjectJointKind::kHinge)
    wanted.axis_World = to_world(arguments.vector(kReason, "the axis", -1000, 1000));
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (sim.joints.size() >= kMostJoints)
    return fail_reply("too many joints", "there are " + std::to_string(kMostJoints));
  Result<ObjectJoint> made = make_joint(wanted, sim.objects);
  if (!made) return fail_reply(kReason, made.error().message);
  sim.joints.push_back(*made);
  sim.contacts->forget();
  sim.wake_all();
  return "[ok]";
}

constexpr std::array<WorldVerb, 2> kVerbs = {{
    {"join", join, "OBJECT OBJECT", "the second becomes a part of the first: a compound object",
     "world join box 1 sph 1"},
    {"joint", joint,
     "[ball OBJECT OBJECT|world X Y Z | hinge OBJECT OBJECT|world X Y Z AX AY AZ | fixed OBJECT OBJECT|world "
     "| "
     "none OBJECT OBJECT|world]",
     "hangs a thing on another or on the world where they are now: at a point, about an axis through a "
     "point, "
     "or firmly; none takes them apart; without words, (KIND A B X Y Z AX AY AZ) of all",
     "world joint hinge box 1 world 0 0.9 0.4 1 0 0"},
}};

}  // namespace

WorldVerbs joint_verbs() { return {"Things that hang together", kVerbs}; }

}  // namespace nido::sim
