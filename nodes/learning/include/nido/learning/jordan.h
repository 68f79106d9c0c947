#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/learning/mlp.h"

namespace nido::learning {

// A Jordan network (Jordan 1986; the paper's Fig. 11): a feed-forward network whose own last outputs come
// back as extra inputs, the state units. It produces sequences, and its next output depends on what it did
// before. A value, thread-compatible.
class JordanNetwork {
 public:
  struct Sizes {
    int inputs = 6;  // touch pads
    int hidden = 5;
    int outputs = 8;  // finger joints, and as many state units
  };
  // `state_decay` in [0, 1): state' = decay * state + (1 - decay) * output; 0 copies the outputs, as in the
  // paper.
  static JordanNetwork random(Sizes sizes, double state_decay, std::uint64_t seed, double range = 0.0);
  static Result<JordanNetwork> read_from(const WeightsFile& file, const std::string& name);
  void write_to(WeightsFile& file, const std::string& name) const;

  [[nodiscard]] int input_size() const { return network_.input_size() - network_.output_size(); }
  [[nodiscard]] int output_size() const { return network_.output_size(); }
  [[nodiscard]] const Eigen::VectorXd& state() const { return state_; }
  [[nodiscard]] const Mlp& network() const { return network_; }
  [[nodiscard]] Mlp& network() { return network_; }

  // State units to `state` (0..1); all zero at the start of an attempt.
  void reset();
  void set_state(const Eigen::VectorXd& state);

  // Output for this input and the present state; then the state takes the output in.
  Eigen::VectorXd step(const Eigen::VectorXd& input);
  // Output for this input and the present state; the state stays.
  [[nodiscard]] Eigen::VectorXd peek(const Eigen::VectorXd& input) const;
  // Lets the state take in what was really done (joint positions, which a touch may have stopped early).
  void feed_back(const Eigen::VectorXd& output);
  // Input and state as the feed-forward network sees them.
  [[nodiscard]] Eigen::VectorXd joined(const Eigen::VectorXd& input) const;

  // Supervised: one pass over a sequence (inputs and targets one step a column), from reset, the state fed
  // with the targets. The state counts as an input: errors are not propagated back through time. Returns the
  // mean squared error a unit before the steps.
  double train_sequence(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets, double rate);

 private:
  JordanNetwork(Mlp network, double state_decay);
  Mlp network_;
  double state_decay_;
  Eigen::VectorXd state_;
};

// Associative reward-penalty learning (A_R-P, Barto & Anandan 1985; graded reward and layers: Barto & Jordan
// 1987). Output units are stochastic; a reward makes what they did likelier in that situation, a penalty its
// opposite.
struct RewardPenaltyOptions {
  double rate = 0.5;            // rho
  double penalty_ratio = 0.05;  // lambda: step of penalised against rewarded actions
  int draws = 1;  // a unit's action is the mean of so many on/off draws: 1 is Barto's binary unit, more
                  // give joint positions between 0 and 1
  bool stochastic_hidden =
      false;  // true: hidden units draw on/off and learn by the same rule (Barto & Jordan);
              // false: they are deterministic, the output's error signal is propagated back
};

// One attempt's memory and the rule for the Jordan network. Use: begin(); act() each step; learn(reward).
// Thread-compatible.
class RewardPenaltyLearner {
 public:
  // Keeps a copy of the network; take it back with network().
  RewardPenaltyLearner(JordanNetwork network, RewardPenaltyOptions options, std::uint64_t seed);

  void begin();  // a new attempt: state units to zero, memory empty
  // Draws the output units' actions (0..1 each) for this input, remembers them and feeds them back into the
  // state.
  Eigen::VectorXd act(const Eigen::VectorXd& input);
  // As act(), but the state will be fed with what is given to executed() instead.
  Eigen::VectorXd act_without_feedback(const Eigen::VectorXd& input);
  void executed(const Eigen::VectorXd& output);
  // Changes the weights for every remembered step and forgets them. `reward` 0 (failed) to 1 (best).
  void learn(double reward);
  // Same with one reward a remembered step.
  void learn_each(const std::vector<double>& rewards);
  // Same, compared with the reward that was expected (reinforcement comparison): only what is better than
  // that makes the actions likelier, only what is worse their opposite; as expected changes nothing.
  void learn_compared(double reward, double expected);

  [[nodiscard]] const JordanNetwork& network() const { return network_; }

 private:
  struct Step {
    std::vector<Eigen::VectorXd> activities;  // input, hidden as used, output probabilities
    Eigen::VectorXd hidden_probability;       // of the hidden units
    Eigen::VectorXd action;
  };
  // One step's share of learning: `better` towards the action, lambda * `worse` towards its opposite.
  void change(const Step& step, double better, double worse);
  JordanNetwork network_;
  RewardPenaltyOptions options_;
  std::mt19937_64 random_;
  std::vector<Step> steps_;
};

}  // namespace nido::learning
