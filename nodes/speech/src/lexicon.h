#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// How words sound, by a dictionary in PocketSphinx's format ("word P H O N", "word(2) P H O N"). Reads the
// file once and keeps only the wanted words. kNotFound with a sentence if there is no such file. Words that
// the dictionary does not have are missing from the result.
Result<std::map<std::string, std::vector<std::string>>> look_up_pronunciations(
    const std::string& dictionary, const std::set<std::string>& words);

// The same sounds as other accents have them, beside those that are given: the vowels of "bath", "lot" and
// "rabbit", the last one of "happy", and no R where no vowel follows (Wells: Accents of English, 1982).
std::vector<std::string> with_other_accents(const std::vector<std::string>& pronunciations);

}  // namespace nido
