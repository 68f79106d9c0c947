#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/speech/phrases.h"

namespace nido {

struct SpeechSettings {
  std::string acoustic_model;  // folder of a PocketSphinx model; empty: Debian's en-us
  std::string adaptation;      // folder of what is adapted of that model, and of the network of sounds
                               // (docs/speech.md); empty: nothing, and the decoders alone judge
  std::string dictionary;      // of new words; empty: the one beside Debian's en-us
  double end_silence_s = 0.3;  // silence that ends an utterance; the answer is late by this much
  double shortest_s = 0.25;    // speech shorter than this is a click, not an utterance
  double longest_s = 8.0;      // speech longer than this is cut and rejected
  double noise_floor_db =
      -33.0;  // level of the pink noise that is added, relative to the loudest speech so far
  double lowest_confidence = 0.5;  // less sure than this is rejected, 0..1 (docs/speech.md)
  std::uint64_t seed = 1;          // of that noise
};

// A piece of sound, as it comes from a port or a file.
struct AudioBlock {
  double start_s = 0.0;                  // time of the first sample, s
  std::uint32_t sample_rate_hz = 16000;  // must be kSpeechRate_hz
  std::uint32_t channels = 1;            // 1 or 2; two are averaged
  std::vector<std::int16_t> samples;     // interleaved
};
inline constexpr std::uint32_t kSpeechRate_hz = 16000;

// How well a text fits the sounds of an utterance, as the network of sounds tells them (docs/speech.md). The
// margin of a sound is the mean logarithm of its probability while it would be said, less that of the best
// other one.
struct SoundEvidence {
  double worst_sound = 0.0;   // smallest margin of a sound
  double second_worst = 0.0;  // the next one
  double mean_sound = 0.0;    // mean margin, of which none counts more than 2
  double worst_word = 0.0;    // the same of the word where it is least
  double gap = 0.0;           // by which the best sound of a frame is better than the text's, mean: >= 0
  double unexplained = 0.0;   // speech where the text has silence, about in tenths of a second: >= 0
};

// What was made of one utterance.
struct HeardPhrase {
  double end_s = 0.0;       // time of the end of the speech, s
  std::string text;         // phrase of the book; empty when rejected
  double confidence = 0.0;  // 0..1
  bool accepted = false;
  std::string reason;  // why it was rejected, a sentence; empty when accepted
  // What the confidence rests upon (docs/speech.md).
  std::string nearest;                  // phrase or words that fit best
  double misfit = 0.0;                  // by which they fit worse than the best sounds
  double loudness_db = 0.0;             // of the loudest moment over the background
  std::optional<SoundEvidence> sounds;  // without a network of sounds, or words: nothing
};

// Understands the phrases of a book in a stream of sound (PocketSphinx). The nearest phrase is accepted only
// if it fits about as well as the best sequence of sounds would, whatever that may mean: other speech does
// not. Deterministic: the same blocks give the same answers. Not thread-safe.
class SpeechCore {
 public:
  // kNotFound with a sentence if the acoustic model is not installed; kInvalidArgument for settings out of
  // range.
  static Result<std::unique_ptr<SpeechCore>> create(const PhraseBook& book, const SpeechSettings& settings);
  ~SpeechCore();
  SpeechCore(const SpeechCore&) = delete;
  SpeechCore& operator=(const SpeechCore&) = delete;

  // Listens to one block of any length and returns the utterances that ended in it. Blocks must follow each
  // other; a gap in time of more than 0.1 s ends the utterance that was going on. A block with another rate,
  // more channels or a ragged length is refused with kInvalidArgument and changes nothing.
  Result<std::vector<HeardPhrase>> feed(const AudioBlock& block);
  // Ends the utterance that is going on, as at the end of a file.
  std::vector<HeardPhrase> flush();
  // Takes another book; an utterance that is going on is forgotten. On an error the old one stays.
  Status set_book(const PhraseBook& book);
  // Fills in pronunciations of words from the dictionary, so that they can be added to a book. kNotFound
  // names the words that it does not have.
  Result<std::map<std::string, std::vector<std::string>>> pronunciations(
      const std::vector<std::string>& words) const;
  // Adds a name for things that are taught to a book, with what its words sound like. kNotFound and
  // kInvalidArgument as above and as PhraseBook::add_name(), changing nothing.
  Status add_name(const std::string& name, PhraseBook& book) const;
  // Speech is going on now.
  [[nodiscard]] bool in_speech() const;

 private:
  struct Impl;
  explicit SpeechCore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace nido
