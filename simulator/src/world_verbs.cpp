// What the verbs of the world port share.
#include "world_verbs.h"

#include <algorithm>
#include <array>
#include <fstream>

namespace nido::sim {
namespace {

constexpr std::array<const char*, 8> kMakeable = {"box", "sbox", "cyl",   "scyl",
                                                  "sph", "ssph", "model", "smodel"};
constexpr std::array<const char*, 12> kKinds = {"box",   "sbox",   "cyl",    "scyl", "sph",   "ssph",
                                                "model", "smodel", "basket", "bear", "table", "stand"};

template <std::size_t N>
std::string known_kind(const std::string& word, const std::array<const char*, N>& kinds) {
  for (const std::string kind : kinds) {
    if (word == kind || (word.size() >= 4 && kind.size() > 4 && kind.starts_with(word))) return kind;
  }
  return {};
}

}  // namespace

std::string makeable_kind(const std::string& word) { return known_kind(word, kMakeable); }

std::string object_kind(const std::string& word) { return known_kind(word, kKinds); }

std::vector<std::size_t> all_of_kind(const Simulation::Impl& sim, const std::string& kind) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < sim.objects.size(); ++i) {
    if (sim.objects[i]->description().kind == kind) found.push_back(i);
  }
  return found;
}

std::size_t read_object(const Simulation::Impl& sim, Arguments& arguments) {
  if (!arguments.ok()) return 0;
  if (arguments.done()) {
    arguments.fail("too few words", "which object? give KIND N or a name");
    return 0;
  }
  // the longest run of words that is a name
  std::string name;
  std::size_t best = sim.objects.size();
  std::size_t best_words = 0;
  for (std::size_t w = 0; w < std::min<std::size_t>(arguments.left(), 8); ++w) {
    name += (w == 0 ? "" : " ") + arguments.peek(w);
    const int index = sim.find_object(name);
    if (index >= 0) {
      best = static_cast<std::size_t>(index);
      best_words = w + 1;
    }
  }
  const std::string kind = object_kind(arguments.peek());
  if (best_words > 0 &&
      (kind.empty() || best_words > 1 || arguments.left() == 1 || all_of_kind(sim, kind).empty())) {
    arguments.skip(best_words);
    return best;
  }
  if (kind.empty()) {
    arguments.fail("unrecognized object type",
                   "no object and no kind is called \"" + arguments.peek() + "\"");
    return 0;
  }
  arguments.skip();
  // a kind of which there is one needs no number
  const std::vector<std::size_t> found = all_of_kind(sim, kind);
  if (arguments.done()) {
    if (found.size() == 1) return found[0];
    arguments.fail("could not set index",
                   "there are " + std::to_string(found.size()) + " of kind " + kind + "; say which");
    return 0;
  }
  const int n = arguments.index("the index");
  if (!arguments.ok()) return 0;
  if (n > static_cast<int>(found.size())) {
    arguments.fail("out of range", "there are " + std::to_string(found.size()) + " of kind " + kind);
    return 0;
  }
  return found[static_cast<std::size_t>(n) - 1];
}

void objects_changed(Simulation::Impl& sim) {
  ++sim.revision;
  sim.object_set = ++sim.last_object_set;
  sim.contacts->forget();
  sim.wake_all();
}

std::string pose_text(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return vector_text(X.translation()) + " " + number_text(q.x()) + " " + number_text(q.y()) + " " +
         number_text(q.z()) + " " + number_text(q.w());
}

Eigen::Isometry3d X_PortObject(const ObjectBody& object) {
  return X_WorldPort().inverse() * object.X_WorldObject();
}

Eigen::Vector3d to_world(const Eigen::Vector3d& v_Port) { return X_WorldPort().linear() * v_Port; }

Eigen::Vector3d to_port(const Eigen::Vector3d& v_World) {
  return X_WorldPort().linear().transpose() * v_World;
}

std::filesystem::path scene_file(const Simulation::Impl& sim, Arguments& arguments, const std::string& name,
                                 const char* ending, bool for_writing) {
  constexpr const char* kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (!arguments.ok()) return {};
  if (name.empty() || name.size() > 60 || name.find_first_not_of(kAllowed) != std::string::npos) {
    arguments.fail("could not use file",
                   "a file is called by letters, digits, _ and -, at most 60; it is kept in " +
                       std::filesystem::absolute(sim.options.scene_folder).string());
    return {};
  }
  std::error_code trouble;
  if (for_writing) std::filesystem::create_directories(sim.options.scene_folder, trouble);
  if (trouble)
    arguments.fail("could not use file", sim.options.scene_folder.string() + ": " + trouble.message());
  return std::filesystem::absolute(sim.options.scene_folder / (name + ending));
}

std::string write_file(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path half = path.string() + ".part";
  {
    std::ofstream file(half, std::ios::trunc | std::ios::binary);
    file << text;
    if (!file.flush()) return "cannot write " + half.string();
  }
  std::error_code trouble;
  std::filesystem::rename(half, path, trouble);
  return trouble ? path.string() + ": " + trouble.message() : "";
}

}  // namespace nido::sim
