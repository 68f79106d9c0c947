#pragma once

#include <span>
#include <string>
#include <vector>

#include "simulation_impl.h"
#include "world_text.h"

namespace nido::sim {

// One verb of the world port. Its row is all that there is to say about it: the port's help and the reference
// in docs/world.md are made of it.
struct WorldVerb {
  const char* name;
  // Takes the words after the verb and gives the reply; a failure changes nothing.
  std::string (*run)(Simulation::Impl& sim, Arguments& arguments);
  const char* arguments;  // "OBJECT X Y Z | mdir FOLDER"; empty: none
  const char* meaning;    // one sentence, without its stop
  const char* example;    // a whole line
};

// Verbs that belong together, each group in a file of its own.
struct WorldVerbs {
  const char* title;
  std::span<const WorldVerb> verbs;
};
[[nodiscard]] WorldVerbs making_verbs();    // world_making.cpp: make, delete, count, name
[[nodiscard]] WorldVerbs placing_verbs();   // world_placing.cpp: where things are, and their colour
[[nodiscard]] WorldVerbs motion_verbs();    // world_motion.cpp: how things weigh, touch and move
[[nodiscard]] WorldVerbs joint_verbs();     // world_joints.cpp: things that hang together
[[nodiscard]] WorldVerbs scene_verbs();     // world_scene.cpp: whole scenes, light, chance
[[nodiscard]] WorldVerbs snapshot_verbs();  // world_snapshot.cpp: going back
[[nodiscard]] WorldVerbs time_verbs();      // world_time.cpp: pause, step, rate
[[nodiscard]] WorldVerbs fault_verbs();     // world_faults.cpp: what goes wrong on purpose
[[nodiscard]] WorldVerbs judging_verbs();   // world_judging.cpp: ground truth

// The table of all verbs as it stands in docs/world.md.
[[nodiscard]] std::string world_reference();

// -- what the verbs share

// Kinds of things that the old simulator knew; it compared four letters, so "smod" is "smodel". Empty: none.
[[nodiscard]] std::string makeable_kind(const std::string& word);
[[nodiscard]] std::string object_kind(const std::string& word);
[[nodiscard]] std::vector<std::size_t> all_of_kind(const Simulation::Impl& sim, const std::string& kind);
// Reads `KIND N` or a name, quoted or as several words; index of the object.
std::size_t read_object(const Simulation::Impl& sim, Arguments& arguments);
// The objects changed: nothing of the last contacts may be used again.
void objects_changed(Simulation::Impl& sim);
// x y z qx qy qz qw
[[nodiscard]] std::string pose_text(const Eigen::Isometry3d& X);
[[nodiscard]] Eigen::Isometry3d X_PortObject(const ObjectBody& object);
// Rotates only: directions of the port's frame (x left, y up, z forward) and of the world's.
[[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& v_Port);
[[nodiscard]] Eigen::Vector3d to_port(const Eigen::Vector3d& v_World);
// Runs a change that ends in another moment of the simulation, but keeps its time: whoever listens to the
// clock must not see it run backward.
template <class Change>
void keep_time(Simulation::Impl& sim, Change change) {
  const std::int64_t now = sim.period;
  change();
  sim.period = now;
}
// A file of the scene folder by a plain name: letters, digits, '_', '-', at most 60. Fails for others. The
// folder is made when `for_writing`.
std::filesystem::path scene_file(const Simulation::Impl& sim, Arguments& arguments, const std::string& name,
                                 const char* ending, bool for_writing);
// Writes a whole file or nothing. Empty, or what went wrong.
[[nodiscard]] std::string write_file(const std::filesystem::path& path, const std::string& text);

}  // namespace nido::sim
