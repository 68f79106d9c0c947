// nido-speech-lessons: what the acoustic model is adapted with. Speaks sentences with many synthetic voices,
// none of which the experiment uses, in many noises, and writes down which pronunciation each word had.
// docs/speech.md

#include <fmt/format.h>
#include <pocketsphinx/pocketsphinx.h>
#include <sphinxbase/err.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <set>

#include "lexicon.h"
#include "nido/speech/phrases.h"
#include "nido/speech/voice.h"
#include "voices.h"

namespace nido {
namespace {

struct Request {
  std::string phrases;
  std::string dictionary = "/usr/share/pocketsphinx/model/en-us/cmudict-en-us.dict";
  std::string model = "/usr/share/pocketsphinx/model/en-us/en-us";
  std::string out;
  int count = 4000;
  std::uint64_t seed = 1;
};

const std::vector<std::string> kOrdinary = {
    "after",    "air",      "animal",   "answer",  "around",  "ask",     "baby",   "back",    "beach",
    "bed",      "before",   "below",    "bread",   "bridge",  "brother", "build",  "butter",  "cheese",
    "chicken",  "children", "church",   "city",    "clean",   "clock",   "cloud",  "coffee",  "country",
    "cross",    "cut",      "dance",    "day",     "dinner",  "dream",   "drink",  "drive",   "early",
    "east",     "eat",      "evening",  "eye",     "face",    "family",  "father", "field",   "finger",
    "fire",     "floor",    "food",     "foot",    "forest",  "friend",  "front",  "game",    "glove",
    "grass",    "great",    "ground",   "group",   "hair",    "heart",   "hill",   "hour",    "idea",
    "island",   "jump",     "jacket",   "king",    "laugh",   "learn",   "letter", "light",   "listen",
    "lunch",    "machine",  "market",   "measure", "middle",  "milk",    "minute", "money",   "month",
    "mother",   "mouth",    "near",     "never",   "night",   "north",   "number", "nurse",   "office",
    "often",    "page",     "paint",    "people",  "picture", "pocket",  "pool",   "potato",  "quick",
    "quiet",    "rain",     "read",     "ribbon",  "rise",    "road",    "roof",   "room",    "rope",
    "sail",     "salt",     "sand",     "school",  "sea",     "second",  "sheep",  "ship",    "shop",
    "shoulder", "silence",  "sing",     "sister",  "sleep",   "smile",   "smoke",  "snow",    "song",
    "soup",     "south",    "space",    "speak",   "spring",  "square",  "stand",  "stick",   "store",
    "storm",    "strange",  "street",   "strong",  "sugar",   "summer",  "swim",   "teacher", "thick",
    "thin",     "think",    "thousand", "throat",  "thunder", "tooth",   "top",    "town",    "travel",
    "trouble",  "uncle",    "usual",    "valley",  "village", "visit",   "voice",  "wait",    "walk",
    "wall",     "warm",     "wash",     "watch",   "wave",    "wear",    "west",   "wide",    "wild",
    "wind",     "wing",     "winter",   "wire",    "wise",    "wonder",  "wood",   "work",    "world",
    "write",    "year",     "young",    "zero",    "zoo",     "vision",  "joy",    "boy",     "noise",
    "choice",   "oil",      "house",    "mouse",   "loud",    "towel",   "judge",  "orange",  "garage"};

class Chooser {
 public:
  explicit Chooser(std::uint64_t seed) : generator_(seed) {}
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(generator_() % count); }
  template <class List>
  const auto& of(const List& list) {
    return list[below(list.size())];
  }

 private:
  std::mt19937_64 generator_;
};

struct Free {
  void operator()(ps_decoder_t* decoder) const { ps_free(decoder); }
};

// a phrase, a phrase with other words in it, or other words alone
std::string choose_text(Chooser& choose, const std::vector<std::string>& texts,
                        const std::vector<std::string>& words) {
  const std::size_t kind = choose.below(10);
  if (kind < 5) return choose.of(texts);
  std::vector<std::string> sentence;
  if (kind < 7) {
    sentence = split_words(choose.of(texts));
    sentence[choose.below(sentence.size())] = choose.of(words);
  } else {
    for (std::size_t i = 2 + choose.below(4); i > 0; --i) sentence.push_back(choose.of(words));
  }
  return fmt::format("{}", fmt::join(sentence, " "));
}

// which pronunciation every word has, silences included: "<sil> reach(2) blue ball <sil>"; empty if it does
// not fit
std::string align(ps_decoder_t* decoder, const std::string& text, const std::vector<std::int16_t>& samples) {
  const std::string grammar = fmt::format("#JSGF V1.0; grammar one; public <one> = {};", text);
  ps_set_jsgf_string(decoder, "one", grammar.c_str());
  ps_set_search(decoder, "one");
  ps_start_utt(decoder);
  ps_process_raw(decoder, samples.data(), samples.size(), FALSE, TRUE);
  ps_end_utt(decoder);
  int32 score = 0;
  const char* hypothesis = ps_get_hyp(decoder, &score);
  if (hypothesis == nullptr || text != hypothesis) return {};
  std::string words;
  for (ps_seg_t* segment = ps_seg_iter(decoder); segment != nullptr; segment = ps_seg_next(segment)) {
    const std::string word = ps_seg_word(segment);
    if (word.starts_with('<') || word == "(NULL)") continue;
    words += (words.empty() ? "" : " ") + word;
  }
  return words;
}

Status run(const Request& request) {
  const auto book = PhraseBook::load(request.phrases);
  if (!book) return book.error();
  std::set<std::string> wanted(kOrdinary.begin(), kOrdinary.end());
  wanted.insert(book->other_words.begin(), book->other_words.end());
  auto sounds = look_up_pronunciations(request.dictionary, wanted);
  if (!sounds) return sounds.error();
  std::vector<std::string> words;
  for (const auto& [word, found] : *sounds) words.push_back(word);
  for (const auto& [word, own] : book->pronunciations) (*sounds)[word] = own;

  const std::filesystem::path out = request.out;
  std::filesystem::create_directories(out);
  const std::string dictionary = (out / "lessons.dict").string();
  {
    std::ofstream file(dictionary);
    for (const auto& [word, found] : *sounds) {
      for (std::size_t i = 0; i < found.size(); ++i)
        file << word << (i == 0 ? "" : fmt::format("({})", i + 1)) << ' ' << found[i] << '\n';
    }
  }
  err_set_logfp(nullptr);
  cmd_ln_t* config =
      cmd_ln_init(nullptr, ps_args(), TRUE, "-hmm", request.model.c_str(), "-dict", dictionary.c_str(),
                  "-beam", "1e-80", "-wbeam", "1e-60", "-pbeam", "1e-80", "-logfn", "/dev/null", nullptr);
  const std::unique_ptr<ps_decoder_t, Free> decoder(config == nullptr ? nullptr : ps_init(config));
  if (config != nullptr) cmd_ln_free_r(config);
  if (!decoder) return Error{ErrorCode::kNotFound, fmt::format("{}: no acoustic model here", request.model)};

  Chooser choose(request.seed);
  std::ofstream ids(out / "lessons.fileids");
  std::ofstream transcription(out / "lessons.transcription");
  const auto texts = book->texts();
  int lost = 0;
  for (int i = 0; i < request.count; ++i) {
    const std::string text = choose_text(choose, texts, words);
    const std::string variant = choose.of(kVariants);
    Voice voice{choose.of(kAccents) + (variant.empty() ? "" : "+" + variant)};
    voice.words_per_minute = static_cast<int>(115 + choose.below(100));
    voice.pitch = static_cast<int>(30 + choose.below(45));
    auto samples = speak(text, voice, 0.3, 0.3);
    if (!samples) return samples.error();
    // a little noise for the alignment, as the recogniser adds it, then the noise of the lesson
    const std::uint64_t noise_seed = request.seed * 1000003 + static_cast<std::uint64_t>(i);
    add_noise(*samples, NoiseKind::kPink, 33.0, noise_seed);
    const std::string spoken = align(decoder.get(), text, *samples);
    const bool noisy = choose.below(10) >= 4;
    const bool pink = choose.below(2) == 0;
    const double snr_db = static_cast<double>(5 + choose.below(21));
    if (spoken.empty()) {
      ++lost;
      continue;
    }
    if (noisy) add_noise(*samples, pink ? NoiseKind::kPink : NoiseKind::kWhite, snr_db, noise_seed + 1);
    const std::string name = fmt::format("{:05}", i);
    std::ofstream file(out / (name + ".raw"), std::ios::binary);
    file.write(reinterpret_cast<const char*>(samples->data()),
               static_cast<std::streamsize>(samples->size() * sizeof(std::int16_t)));
    ids << name << '\n';
    transcription << "<s> " << spoken << " </s> (" << name << ")\n";
  }
  if (!ids || !transcription)
    return Error{ErrorCode::kFailed, fmt::format("cannot write into {}", out.string())};
  fmt::print("{} lessons, {} did not fit\n", request.count - lost, lost);
  return {};
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  CLI::App app("Speaks the sentences that the acoustic model is adapted with.", "nido-speech-lessons");
  app.add_option("--phrases", request.phrases, "phrases.yaml")->required();
  app.add_option("--out", request.out, "folder for the lessons")->required();
  app.add_option("--count", request.count, "how many")->check(CLI::Range(1, 1000000))->capture_default_str();
  app.add_option("--seed", request.seed, "")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const nido::Status status = nido::run(request);
  if (!status) fmt::print(stderr, "{}\n", status.error().message);
  return status ? 0 : 1;
}
