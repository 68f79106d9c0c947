#pragma once

#include <cstdint>
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
  enum class Model { kGrammar, kTrigram };
  struct Hypothesis {
    std::string text;         // empty: nothing found
    double confidence = 0.0;  // 0..1
  };

  // `end_silence_frames`: frames of 10 ms.
  static Result<Decoder> create(const PhraseBook& book, const std::string& acoustic_model, Model model,
                                int end_silence_frames);

  void start();
  // Returns whether speech is going on.
  bool process(const std::int16_t* samples, std::size_t count);
  Hypothesis end();

 private:
  struct Free {
    void operator()(ps_decoder_s* decoder) const;
  };
  explicit Decoder(std::unique_ptr<ps_decoder_s, Free> decoder) : decoder_(std::move(decoder)) {}
  std::unique_ptr<ps_decoder_s, Free> decoder_;
};

}  // namespace nido
