#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/speech/speech_core.h"

namespace nido {

// Holds a text against the probabilities of sounds in an utterance (SoundNetwork::log_probabilities): finds
// when each of its sounds would have been said and how well it fits there. `pronunciations` has every word of
// the text. Nothing if the utterance is too short for the text or a sound has no name in kSounds.
std::optional<SoundEvidence> weigh_sounds(
    const Eigen::MatrixXf& log_probabilities, const std::string& text,
    const std::map<std::string, std::vector<std::string>>& pronunciations);

}  // namespace nido
