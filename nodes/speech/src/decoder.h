#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/speech/phrases.h"

struct ps_decoder_s;

namespace nido {

// Where a decoder's acoustic model is.
struct AcousticModel {
  std::string folder;      // of a PocketSphinx model
  std::string adaptation;  // folder of means, variances and sendump that replace the model's; empty: none
};

// One PocketSphinx decoder. Not thread-safe.
class Decoder {
 public:
  // kWords: the phrases of a book, beside their words in any order. kPhones: sounds in any order.
  enum class Kind { kWords, kPhones };

  // A piece of what was heard.
  struct Segment {
    std::string word;    // a word of the book, or a phone; empty: silence or noise
    int frames = 0;      // of 10 ms
    double score = 0.0;  // natural logarithm of how well it fits, relative to the model's best state of every
                         // frame: <= 0
  };

  // `end_silence_frames`: frames of 10 ms.
  static Result<Decoder> create(const PhraseBook& book, const AcousticModel& model, Kind kind,
                                int end_silence_frames);

  // Listening as sound comes: start, process piece by piece (returns whether speech is going on), end.
  void start();
  bool process(const std::int16_t* samples, std::size_t count);
  void end();
  // A whole utterance at once, between end() and start(): the mean of its spectrum is known then, so that the
  // first one is understood as well as later ones. Empty: nothing fits.
  std::vector<Segment> decode(const std::vector<std::int16_t>& samples);

 private:
  struct Free {
    void operator()(ps_decoder_s* decoder) const;
  };
  explicit Decoder(std::unique_ptr<ps_decoder_s, Free> decoder) : decoder_(std::move(decoder)) {}
  std::unique_ptr<ps_decoder_s, Free> decoder_;
};

}  // namespace nido
