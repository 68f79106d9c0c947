#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/kinematics/robot_model.h"
#include "nido/simulator/faults.h"
#include "nido/simulator/skin.h"

namespace nido::sim {

// Reads the <skin> elements of the <nido> block of a URDF; docs/skin.md. A robot may have none. Refuses, with
// file and line, what is no patch, a triangle beyond its values, one named twice, a link that the model does
// not have, and a second patch on a link.
[[nodiscard]] Result<std::vector<SkinPatch>> read_skin(const RobotModel& model,
                                                       const std::filesystem::path& urdf_path);

// What the taxels of all patches feel. A contact presses the taxels around it: the rubber above them spreads
// its force.
class Skin {
 public:
  explicit Skin(std::vector<SkinPatch> patches);

  [[nodiscard]] const std::vector<SkinPatch>& patches() const { return patches_; }
  // Of the URDF link; -1: bare.
  [[nodiscard]] int patch_on(std::string_view urdf_link) const;

  void begin_period();
  // A contact's normal force at a point of the patch's URDF link. Beyond the taxels' reach nothing is felt.
  void press(std::size_t patch, const Eigen::Vector3d& p_Link_m, double force_N);
  // Means of the period's steps; touch() shows them.
  void end_period(int steps);

  // Taxels that feel something, in the order of their values; mostly none.
  [[nodiscard]] const std::vector<TaxelForce>& touch(std::size_t patch) const { return state_.touch[patch]; }
  void set_fault(std::size_t patch, SkinFault fault) { state_.fault[patch] = fault; }
  [[nodiscard]] SkinFault fault(std::size_t patch) const { return state_.fault[patch]; }

  // By patch.
  struct State {
    std::vector<std::vector<TaxelForce>> touch;
    std::vector<SkinFault> fault;
  };
  [[nodiscard]] const State& save() const { return state_; }
  void restore(const State& state) { state_ = state; }
  // Nothing touched, nothing broken.
  void clear();

 private:
  std::vector<SkinPatch> patches_;
  std::vector<std::vector<double>> sum_N_;  // of the period, by patch and taxel; empty: nothing touched it
  std::vector<double> weights_;             // of one contact
  State state_;
};

}  // namespace nido::sim
