#include "evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nido/speech/phrases.h"
#include "sounds.h"

namespace nido {

namespace {

constexpr float kFloor = -6.9F;  // of a logarithm of a probability: a single frame does not decide

// A text as a graph of sounds, with every pronunciation of its words and silence between them. A sound lasts
// two frames or more: two states, of which the second one may stay.
struct SoundGraph {
  struct State {
    int sound = kSilence;
    int word = -1;  // silence: none
    int place = 0;  // counts the sounds of the graph, so that each has its own
    std::vector<int> from;
  };
  std::vector<State> states;
  std::vector<int> first;  // states that an utterance can begin in, and end in
  std::vector<int> last;

  static std::optional<SoundGraph> of(const std::string& text,
                                      const std::map<std::string, std::vector<std::string>>& pronunciations) {
    SoundGraph graph;
    int places = 0;
    int word = 0;
    std::vector<int> before = {graph.add_silence({}, places++)};
    graph.first = before;
    for (const std::string& name : split_words(text)) {
      const auto sounds = pronunciations.find(name);
      if (sounds == pronunciations.end()) return std::nullopt;
      std::vector<int> ends;
      for (const std::string& pronunciation : sounds->second) {
        std::vector<int> from = before;
        for (const std::string& sound_name : split_words(pronunciation)) {
          const auto sound = sound_of(sound_name);
          if (!sound) return std::nullopt;
          const auto begin = static_cast<int>(graph.states.size());
          graph.states.push_back({*sound, word, places, from});
          graph.states.push_back({*sound, word, places, {begin, begin + 1}});
          if (word == 0 && from == before) graph.first.push_back(begin);
          from = {begin + 1};
          ++places;
        }
        ends.insert(ends.end(), from.begin(), from.end());
      }
      before = ends;
      graph.last = ends;
      const int silence = graph.add_silence(ends, places++);
      before.push_back(silence);
      graph.last.push_back(silence);
      ++word;
    }
    if (word == 0) return std::nullopt;
    return graph;
  }

 private:
  int add_silence(std::vector<int> from, int place) {
    const auto state = static_cast<int>(states.size());
    from.push_back(state);
    states.push_back({kSilence, -1, place, std::move(from)});
    return state;
  }
};

// The state of each frame on the best way through the graph; empty if no way is short enough.
std::vector<int> best_way(const SoundGraph& graph, const Eigen::MatrixXf& fit) {
  constexpr float kNever = -std::numeric_limits<float>::infinity();
  const std::size_t states = graph.states.size();
  const auto frames = static_cast<std::size_t>(fit.cols());
  if (frames == 0) return {};
  std::vector<float> score(states, kNever);
  std::vector<std::vector<int>> came(frames, std::vector<int>(states, -1));
  for (const int state : graph.first)
    score[static_cast<std::size_t>(state)] = fit(graph.states[static_cast<std::size_t>(state)].sound, 0);
  for (std::size_t frame = 1; frame < frames; ++frame) {
    std::vector<float> next(states, kNever);
    for (std::size_t state = 0; state < states; ++state) {
      for (const int from : graph.states[state].from) {
        if (score[static_cast<std::size_t>(from)] <= next[state]) continue;
        next[state] = score[static_cast<std::size_t>(from)];
        came[frame][state] = from;
      }
      next[state] += fit(graph.states[state].sound, static_cast<Eigen::Index>(frame));
    }
    score = std::move(next);
  }
  int best = -1;
  for (const int state : graph.last) {
    const float value = score[static_cast<std::size_t>(state)];
    if (value > kNever && (best < 0 || value > score[static_cast<std::size_t>(best)])) best = state;
  }
  if (best < 0) return {};
  std::vector<int> way(frames);
  for (std::size_t frame = frames; frame-- > 0;) {
    way[frame] = best;
    best = came[frame][static_cast<std::size_t>(best)];
  }
  return way;
}

}  // namespace

std::optional<SoundEvidence> weigh_sounds(
    const Eigen::MatrixXf& log_probabilities, const std::string& text,
    const std::map<std::string, std::vector<std::string>>& pronunciations) {
  const auto graph = SoundGraph::of(text, pronunciations);
  if (!graph) return std::nullopt;
  const Eigen::MatrixXf fit = log_probabilities.cwiseMax(kFloor);
  const std::vector<int> way = best_way(*graph, fit);
  if (way.empty()) return std::nullopt;

  SoundEvidence evidence;
  std::vector<double> sounds;                   // how much better each fits than the best other one
  std::map<int, std::pair<double, int>> words;  // sum and number of those of a word
  double gap = 0.0;
  int frames = 0;
  const auto state_at = [&](std::size_t frame) -> const SoundGraph::State& {
    return graph->states[static_cast<std::size_t>(way[frame])];
  };
  for (std::size_t frame = 0; frame < way.size();) {
    const SoundGraph::State& state = state_at(frame);
    std::size_t end = frame;
    while (end < way.size() && state_at(end).place == state.place) ++end;
    const auto part =
        fit.middleCols(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(end - frame));
    const Eigen::VectorXf best = part.colwise().maxCoeff().transpose();
    const Eigen::VectorXf behind = best - part.row(state.sound).transpose();
    if (state.word < 0) {
      constexpr float kMost = 3.0F;
      evidence.unexplained += behind.cwiseMin(kMost).sum() / 10.0;
    } else {
      Eigen::VectorXf mean = part.rowwise().mean();
      const double own = mean(state.sound);
      mean(state.sound) = -std::numeric_limits<float>::infinity();
      const double margin = own - mean.maxCoeff();
      sounds.push_back(margin);
      words[state.word].first += std::min(margin, 2.0);
      words[state.word].second += 1;
      gap += behind.sum();
      frames += static_cast<int>(end - frame);
    }
    frame = end;
  }
  std::sort(sounds.begin(), sounds.end());
  evidence.worst_sound = sounds[0];
  evidence.second_worst = sounds[std::min<std::size_t>(1, sounds.size() - 1)];
  double sum = 0.0;
  for (const double margin : sounds) sum += std::min(margin, 2.0);
  evidence.mean_sound = sum / static_cast<double>(sounds.size());
  evidence.worst_word = std::numeric_limits<double>::infinity();
  for (const auto& [word, margins] : words)
    evidence.worst_word = std::min(evidence.worst_word, margins.first / margins.second);
  evidence.gap = gap / frames;
  return evidence;
}

}  // namespace nido
