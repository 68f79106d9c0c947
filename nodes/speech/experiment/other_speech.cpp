#include "other_speech.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "nido/speech/phrases.h"

namespace nido {

namespace {

using Words = std::vector<std::string>;

// Words that near misses are made with, and whole sentences.
struct Vocabulary {
  Words colours;
  Words shapes;
  Words verbs;
  Words places;
  Words sentences;
};

const Vocabulary kTest = {
    .colours = {"orange", "pink", "brown", "white", "violet", "tiny", "broken", "shiny", "wet", "cold"},
    .shapes = {"plate", "bottle", "book", "apple", "hammer", "phone", "flower", "pencil", "basket", "ladder",
               "ticket", "candle", "window", "fish", "sock"},
    .verbs = {"lift", "pull", "give me", "bring", "touch", "drag", "hide", "show me", "count", "paint"},
    .places = {"bag", "garden", "cupboard", "fire", "hole", "car", "sink", "corner"},
    .sentences = {"how old is your sister",
                  "we had a long walk along the beach",
                  "close the window please",
                  "i will call you after lunch",
                  "the cat sleeps on the sofa",
                  "eleven twelve thirteen",
                  "could you say that again",
                  "there is nobody at home",
                  "my shoes are full of water",
                  "play some music",
                  "they painted the wall yesterday",
                  "it is half past six",
                  "the children run to school",
                  "never mind",
                  "that was not what i said",
                  "turn around and look at me",
                  "bread and butter",
                  "he forgot his umbrella",
                  "let us go home now",
                  "a bird sings in the tree",
                  "what is the capital of italy",
                  "i am very tired today",
                  "the soup is too hot",
                  "please speak a little louder",
                  "we need more paper",
                  "nice to meet you",
                  "all the best for the new year",
                  "where did you put the keys",
                  "the bus is late again",
                  "goodbye",
                  "perhaps",
                  "excuse me",
                  "of course",
                  "this robot has two hands",
                  "watch your step",
                  "she reads the newspaper",
                  "you should drink more water",
                  "the lamp does not work",
                  "open sesame",
                  "i think so",
                  "too many people",
                  "send a message to my mother",
                  "who is at the door",
                  "the moon is bright tonight",
                  "one more time"}};

// None of kTest: to choose bounds and costs with.
const Vocabulary kTuning = {
    .colours = {"yellow", "purple", "black", "silver", "crimson", "huge", "wooden", "clean", "glad", "round"},
    .shapes = {"cup", "bowl", "board", "chair", "doll", "tube", "bell", "spoon", "bucket", "button", "pear",
               "coat", "mirror", "coin", "lamp"},
    .verbs = {"drive", "trap", "grab", "push", "raise", "find", "look at", "rub", "throw", "wash"},
    .places = {"box", "casket", "pocket", "river", "oven", "kitchen", "drawer", "tent"},
    .sentences = {"what time is it", "the weather is nice", "turn left at the bridge",
                  "good morning everybody", "my brother plays the guitar", "see you tomorrow",
                  "wait a moment", "the train leaves at noon", "i cannot find my glasses",
                  "thank you very much", "twenty one", "it rains again", "who wants some tea",
                  "the dog is asleep", "read this letter", "do not worry"}};

const Words kOwn = {"blue", "red",   "green", "ball", "cube", "teddy",
                    "bear", "reach", "grasp", "drop", "into", "basket"};
class Chooser {
 public:
  explicit Chooser(std::uint64_t seed) : generator_(seed) {}
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(generator_() % count); }
  const std::string& of(const Words& words) { return words[below(words.size())]; }
  std::string object() {
    static const Words objects = {"blue ball", "red ball",   "green ball", "blue cube",
                                  "red cube",  "green cube", "teddy bear"};
    return of(objects);
  }

 private:
  std::mt19937_64 generator_;
};

std::string near_miss(Chooser& choose, const Vocabulary& vocabulary) {
  static const Words colours = {"blue", "red", "green"};
  static const Words shapes = {"ball", "cube"};
  static const Words verbs = {"reach", "grasp"};
  switch (choose.below(9)) {
    case 0:
      return choose.of(vocabulary.colours) + " " + choose.of(shapes);
    case 1:
      return choose.of(colours) + " " + choose.of(vocabulary.shapes);
    case 2:
      return choose.of(vocabulary.verbs) + " " + choose.object();
    case 3:
      return choose.of(verbs) + " " + choose.of(vocabulary.colours) + " " + choose.of(shapes);
    case 4:
      return choose.of(verbs) + " " + choose.of(colours) + " " + choose.of(vocabulary.shapes);
    case 5:
      return "drop " + choose.object() + " into " + choose.of(vocabulary.places);
    case 6:
      return "drop " + choose.of(vocabulary.colours) + " " + choose.of(shapes) + " into basket";
    case 7:
      return "drop " + choose.of(colours) + " " + choose.of(vocabulary.shapes) + " into basket";
    default:
      return choose.of(vocabulary.verbs) + " " + choose.object() + " into basket";
  }
}

// words of the phrases, as no phrase has them
std::string own_words(Chooser& choose) {
  static const Words texts = {"drop blue cube", "drop red ball", "drop teddy bear", "into basket",
                              "blue",           "cube",          "reach",           "grasp basket",
                              "cube red",       "bear teddy",    "reach blue",      "red green blue",
                              "basket",         "teddy",         "ball into basket"};
  if (choose.below(2) == 0) return choose.of(texts);
  Words words;
  const std::size_t count = 3 + choose.below(3);
  // colours and things in the wrong order cannot be a phrase
  words.push_back(kOwn[3 + choose.below(2)]);
  for (std::size_t i = 1; i < count; ++i) words.push_back(choose.of(kOwn));
  return fmt::format("{}", fmt::join(words, " "));
}

}  // namespace

std::set<std::string> other_words() {
  std::set<std::string> words;
  for (const Vocabulary* vocabulary : {&kTest, &kTuning}) {
    for (const Words* list : {&vocabulary->colours, &vocabulary->shapes, &vocabulary->verbs,
                              &vocabulary->places, &vocabulary->sentences}) {
      for (const std::string& text : *list) {
        for (const std::string& word : split_words(text)) words.insert(word);
      }
    }
  }
  return words;
}

std::vector<OtherSpeech> other_speech(std::size_t count, std::uint64_t seed, bool tuning) {
  const Vocabulary& vocabulary = tuning ? kTuning : kTest;
  Chooser choose(seed * 77 + 5);
  std::vector<OtherSpeech> all;
  std::set<std::string> known;
  int in_vain = 0;
  while (all.size() < count) {
    OtherSpeech other;
    other.seed = seed * 100000 + all.size();
    const std::size_t kind = choose.below(20);
    if (kind < 13) {
      other.kind = "near miss";
      other.text = near_miss(choose, vocabulary);
    } else if (kind < 15) {
      other.kind = "own words";
      other.text = own_words(choose);
    } else if (kind < 18) {
      other.kind = "sentence";
      other.text = choose.of(vocabulary.sentences);
    } else {
      other.kind = kind == 18 ? "tones" : "noise";
    }
    // a text comes twice only when there is no other left
    if (!other.text.empty() && !known.insert(other.text).second && ++in_vain % 50 != 0) continue;
    all.push_back(std::move(other));
  }
  return all;
}

Result<std::vector<std::int16_t>> make_sound(const std::string& kind, std::uint64_t seed,
                                             double silence_after_s) {
  constexpr double kRate_hz = 16000.0;
  Chooser choose(seed * 31 + 7);
  std::vector<double> sound(8000, 0.0);  // half a second of silence
  const std::size_t notes = 2 + choose.below(5);
  double smooth = 0.0;
  for (std::size_t n = 0; n < notes; ++n) {
    const double length_s = 0.12 + 0.05 * static_cast<double>(choose.below(6));
    const double pitch_hz = 110.0 * std::pow(2.0, static_cast<double>(choose.below(30)) / 12.0);
    const double softness = 0.1 * static_cast<double>(choose.below(9));
    const auto count = static_cast<std::size_t>(length_s * kRate_hz);
    for (std::size_t i = 0; i < count; ++i) {
      const double t = static_cast<double>(i) / kRate_hz;
      const double envelope = std::min(1.0, 50.0 * t) * std::exp(-3.0 * t);
      double value = 0.0;
      if (kind == "tones") {
        for (int harmonic = 1; harmonic <= 5; ++harmonic) {
          value += std::sin(2.0 * std::numbers::pi * pitch_hz * harmonic * t) / harmonic;
        }
      } else {
        const double white =
            static_cast<double>(choose.below(1U << 24U)) / static_cast<double>(1U << 23U) - 1.0;
        smooth = softness * smooth + (1.0 - softness) * white;
        value = smooth;
      }
      sound.push_back(value * envelope);
    }
  }
  double peak = 1e-9;
  for (const double value : sound) peak = std::max(peak, std::abs(value));
  sound.resize(sound.size() + static_cast<std::size_t>(silence_after_s * kRate_hz), 0.0);
  std::vector<std::int16_t> samples;
  for (const double value : sound)
    samples.push_back(static_cast<std::int16_t>(std::lround(0.708 * 32767.0 * value / peak)));
  return samples;
}

}  // namespace nido
