#pragma once

#include <cstdint>
#include <memory>

#include "nido/grasp/grasp_core.h"
#include "nido/interfaces/result.h"
#include "nido/learning/jordan.h"

namespace nido::grasp {

// What the Jordan network has learned, without chance: its output probabilities are the finger positions.
GraspCore::Policy learned_policy(learning::JordanNetwork network);

// Reads the network "grasp" of a weights file (docs/learning.md). kNotFound, kInvalidArgument with the place.
Result<learning::JordanNetwork> load_grasp_network(const std::string& path);

// Learns to close the hand, attempt by attempt: the network's stochastic outputs move the fingers, and the
// reward of the attempt makes them likelier or not (associative reward-penalty, docs/grasp.md). Not
// thread-safe.
class GraspLearner {
 public:
  struct Options {
    double rate = 2.0;           // of the reward-penalty rule
    double penalty_ratio = 0.1;  // lambda
    int draws = 1;               // a joint position is the mean of so many on/off draws
    // Share of a new reward in the reward that is expected next; the reward is compared with what was
    // expected, so that learning ends by itself where every attempt gets the same. 0: not compared.
    double expectation_share = 0.25;
  };
  GraspLearner(Options options, std::uint64_t seed);

  // To be given to a GraspCore that does not outlive this object.
  GraspCore::Policy policy();
  // Ends the attempt: `reward` from 0 (the object fell at once) to 1 (held for the whole test).
  void reward(double reward);
  [[nodiscard]] const learning::JordanNetwork& network() const { return learner_.network(); }

 private:
  double expectation_share_;
  double expected_ = 0;
  learning::RewardPenaltyLearner learner_;
};

}  // namespace nido::grasp
