#pragma once

#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/speech/speech_core.h"

namespace nido {

// One utterance of the experiment and what was made of it: a line of answers.tsv.
struct SpeechAnswer {
  std::string voice;
  int speed = 0;  // words a minute
  std::string noise;
  std::string kind;  // "phrase", or of OtherSpeech
  std::string text;  // what was said; empty: a sound
  // "right", "wrong" (another phrase was heard), "missed"; of other speech "taken" (for a phrase),
  // "rejected".
  std::string outcome = {};
  std::string heard = {};       // what was accepted, or why nothing was
  HeardPhrase answer = {};      // the most confident one
  double end_pointing_s = 0.0;  // end of the speech to the answer, without the time that the work took
  double decode_s = 0.0;        // wall time of the block that brought the answer
  double sound_s = 0.0;         // length of the sound
  double work_s = 0.0;          // wall time of all of it
};

// Writes and reads them, with the names of the columns in the first line. kFailed, kNotFound or
// kInvalidArgument with the file and line.
Status save_answers(const std::string& path, const std::vector<SpeechAnswer>& answers);
Result<std::vector<SpeechAnswer>> load_answers(const std::string& path);

}  // namespace nido
