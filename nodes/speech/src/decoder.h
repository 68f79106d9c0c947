#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/speech/phrases.h"

struct ps_decoder_s;

namespace nido {

// One PocketSphinx decoder over the small dictionary of a phrase book. Not thread-safe.
class Decoder {
 public:
  // kOpen: the phrases beside everything else (open_grammar)
  enum class Model { kGrammar, kTrigram, kOpen };
  struct Hypothesis {
    std::string text;                     // empty: nothing found
    std::map<std::string, double> share;  // of the weight of all that might have been said, by text; sum 1
  };

  using Sounds = std::map<std::string, std::vector<std::string>>;  // word -> phones

  // `end_silence_frames`: frames of 10 ms. `rivals`: other words and how they sound, of kOpen.
  static Result<Decoder> create(const PhraseBook& book, const std::string& acoustic_model, Model model,
                                int end_silence_frames, const Sounds& rivals = {});

  // Listening as sound comes: start, process piece by piece (returns whether speech is going on), end.
  void start();
  bool process(const std::int16_t* samples, std::size_t count);
  void end();
  // A whole utterance at once, between end() and start(): the mean of its spectrum is known then, so that the
  // first one is understood as well as later ones.
  Hypothesis decode(const std::vector<std::int16_t>& samples);

 private:
  struct Free {
    void operator()(ps_decoder_s* decoder) const;
  };
  explicit Decoder(std::unique_ptr<ps_decoder_s, Free> decoder) : decoder_(std::move(decoder)) {}
  std::unique_ptr<ps_decoder_s, Free> decoder_;
};

}  // namespace nido
