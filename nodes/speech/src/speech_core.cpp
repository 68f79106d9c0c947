#include "nido/speech/speech_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <future>
#include <limits>
#include <optional>
#include <random>

#include "decoder.h"
#include "evidence.h"
#include "lexicon.h"
#include "sounds.h"

namespace nido {

namespace {

constexpr std::size_t kChunk = 320;  // 20 ms
constexpr double kChunk_s = static_cast<double>(kChunk) / kSpeechRate_hz;
constexpr std::size_t kBefore = 25 * kChunk;  // 0.5 s before the speech, for the decoders to know the noise
constexpr double kLongestGap_s = 0.1;
constexpr double kStartLevel = 3000.0;     // root mean square of usual speech, until some was heard
constexpr double kLevelDecay = 0.9995;     // a chunk: halves in 28 s
constexpr int kWarmUpChunks = 75;          // of noise alone, so that the decoders know it before they listen
constexpr double kBackgroundRise = 1.004;  // a chunk: 1.7 dB a second
constexpr double kLoudnessRange =
    3.0;  // speech has moments so much louder than its background; steady noise has not

constexpr const char* kDictionary = "/usr/share/pocketsphinx/model/en-us/cmudict-en-us.dict";
constexpr std::array<const char*, 2> kModelPlaces = {"/usr/share/pocketsphinx/model/en-us/en-us",
                                                     "/usr/local/share/pocketsphinx/model/en-us/en-us"};

Result<std::string> find_acoustic_model(const std::string& wanted) {
  const auto is_model = [](const std::string& place) {
    return std::filesystem::exists(std::filesystem::path(place) / "mdef");
  };
  if (!wanted.empty()) {
    if (is_model(wanted)) return wanted;
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: there is no acoustic model (a folder with a file mdef) here", wanted)};
  }
  for (const char* place : kModelPlaces) {
    if (is_model(place)) return std::string(place);
  }
  return Error{ErrorCode::kNotFound,
               fmt::format("the acoustic model {} is missing: install the package pocketsphinx-en-us",
                           kModelPlaces[0])};
}

// How much worse the words fit than the sounds that fit best: a measure of doubt, negative for what is said
// well. On the average of all frames between the first and the last word, plus where it is worst.
double misfit(const std::vector<Decoder::Segment>& words, const std::vector<Decoder::Segment>& phones) {
  constexpr double kWorst = 0.7;  // weight of the worst segment
  constexpr double kShortSegment =
      20.0;                  // frames added to a segment's, so that a short one does not decide alone
  std::vector<double> best;  // score of each frame by the best sounds
  for (const auto& phone : phones)
    best.insert(best.end(), static_cast<std::size_t>(phone.frames), phone.score / phone.frames);
  const auto is_word = [](const Decoder::Segment& segment) { return !segment.word.empty(); };
  const auto first = std::find_if(words.begin(), words.end(), is_word);
  const auto last = std::find_if(words.rbegin(), words.rend(), is_word).base();
  std::size_t frame = 0;
  for (auto segment = words.begin(); segment < first; ++segment)
    frame += static_cast<std::size_t>(segment->frames);
  double sum = 0.0;
  double frames = 0.0;
  double worst = -std::numeric_limits<double>::infinity();
  for (auto segment = first; segment < last; ++segment) {
    double difference = -segment->score;
    const std::size_t end = frame + static_cast<std::size_t>(segment->frames);
    for (; frame < end; ++frame) difference += frame < best.size() ? best[frame] : 0.0;
    sum += difference;
    frames += segment->frames;
    worst = std::max(worst, difference / (segment->frames + kShortSegment));
  }
  return frames > 0.0 ? sum / frames + kWorst * worst : std::numeric_limits<double>::infinity();
}

// How sure it is, 0.5 at the bound between what is a phrase and what is not. Noise makes the words of a
// phrase fit worse and hardly harms the best sounds, so the bound of the misfit rises with it. Where the
// sounds were weighed, they speak too: a logistic regression over the tuning's answers (docs/speech.md). It
// is milder with `new_words`, which sound as one dictionary has them, not as many voices were heard to say
// them; to name a thing, which moves nothing, the misfit alone is enough, too.
double confidence_of(double misfit, double loudness_db, const std::optional<SoundEvidence>& sounds,
                     bool new_words, bool naming) {
  constexpr double kQuietBound = 0.8;
  constexpr double kQuiet_db = 40.0;  // loudness over the background from which on noise does not matter
  constexpr double kRise = 0.03;      // of the bound, a dB
  constexpr double kMostRise = 0.8;
  constexpr double kSteepness = 2.0;  // of the misfit alone
  const double bound = kQuietBound + std::clamp(kRise * (kQuiet_db - loudness_db), 0.0, kMostRise);
  const double excess = misfit - bound;
  double belief = -kSteepness * excess;
  if (sounds) {
    constexpr double kConstant = -4.5;
    constexpr double kMisfit = -0.9;
    constexpr double kSecondWorst = 0.85;
    constexpr double kMean = 1.3;
    constexpr double kWorstWord = 1.65;
    constexpr double kGap = -2.5;
    constexpr double kNewWords = 3.0;
    const double weighed =
        kConstant + (new_words ? kNewWords : 0.0) + kMisfit * std::clamp(excess, -4.0, 3.0) +
        kSecondWorst * std::clamp(sounds->second_worst, -5.0, 3.0) + kMean * sounds->mean_sound +
        kWorstWord * std::clamp(sounds->worst_word, -3.0, 2.0) + kGap * std::sqrt(std::min(sounds->gap, 1.5));
    belief = naming ? std::max(belief, weighed) : weighed;
  }
  return 1.0 / (1.0 + std::exp(-belief));
}

std::string text_of(const std::vector<Decoder::Segment>& words) {
  std::string text;
  for (const auto& segment : words) {
    if (!segment.word.empty()) text += (text.empty() ? "" : " ") + segment.word;
  }
  return text;
}

// Pink noise by three filters over white noise; root mean square about 1. The decoder's front end tracks
// noise, and digital silence, which no microphone gives, disturbs it.
class PinkNoise {
 public:
  explicit PinkNoise(std::uint64_t seed) : generator_(seed) {}
  double next() {
    // the sum of uniform bits is the same on every standard library, std::normal_distribution is not
    const double white = static_cast<double>(generator_() >> 40U) / static_cast<double>(1U << 24U) - 0.5;
    b0_ = 0.99765 * b0_ + white * 0.0990460;
    b1_ = 0.96300 * b1_ + white * 0.2965164;
    b2_ = 0.57000 * b2_ + white * 1.0526913;
    return (b0_ + b1_ + b2_ + white * 0.1848) * kScale;
  }

 private:
  static constexpr double kScale = 1.8;  // measured: brings the root mean square to 1
  std::mt19937_64 generator_;
  double b0_ = 0.0;
  double b1_ = 0.0;
  double b2_ = 0.0;
};

}  // namespace

struct SpeechCore::Impl {
  // The decoders of one book.
  struct Decoders {
    Decoder words;
    Decoder phones;
  };

  Impl(const PhraseBook& phrases, const SpeechSettings& s, Decoders made, std::optional<SoundNetwork> network)
      : book(phrases),
        settings(s),
        first_words(phrases.pronunciations),
        decoders(std::move(made)),
        sound_network(std::move(network)),
        noise(s.seed) {
    warm_up();
  }

  static Result<Decoders> make_decoders(const PhraseBook& book, const SpeechSettings& settings) {
    const auto model = find_acoustic_model(settings.acoustic_model);
    if (!model) return model.error();
    const AcousticModel place{*model, settings.adaptation};
    for (const char* file : {"means", "variances", "sendump"}) {
      if (settings.adaptation.empty() ||
          std::filesystem::exists(std::filesystem::path(settings.adaptation) / file)) {
        continue;
      }
      return Error{
          ErrorCode::kNotFound,
          fmt::format("{}: an adapted model has the files means, variances and sendump; {} is missing",
                      settings.adaptation, file)};
    }
    const int frames = static_cast<int>(std::lround(settings.end_silence_s * 100.0));
    auto words = Decoder::create(book, place, Decoder::Kind::kWords, frames);
    if (!words) return words.error();
    auto phones = Decoder::create(book, place, Decoder::Kind::kPhones, frames);
    if (!phones) return phones.error();
    return Decoders{std::move(words).value(), std::move(phones).value()};
  }

  // lets the decoders hear the room before they listen
  void warm_up() {
    std::array<std::int16_t, kChunk> silence{};
    for (Decoder* decoder : {&decoders.words, &decoders.phones}) decoder->start();
    for (int i = 0; i < kWarmUpChunks; ++i) {
      add_noise(silence);
      for (Decoder* decoder : {&decoders.words, &decoders.phones}) {
        decoder->process(silence.data(), silence.size());
      }
      silence.fill(0);
    }
    for (Decoder* decoder : {&decoders.words, &decoders.phones}) decoder->end();
    start();
  }

  void start() {
    decoders.words.start();
    utterance.clear();
    speaking = false;
    speech_s = 0.0;
    loudest = 0.0;
  }

  void add_noise(std::array<std::int16_t, kChunk>& chunk) {
    const double noise_level = level * std::pow(10.0, settings.noise_floor_db / 20.0);
    for (std::int16_t& sample : chunk) {
      const double noisy = sample + noise_level * noise.next();
      sample = static_cast<std::int16_t>(std::clamp(std::lround(noisy), -32768L, 32767L));
    }
  }

  [[nodiscard]] bool knows(const std::string& text) const {
    const auto texts = book.texts();
    return std::find(texts.begin(), texts.end(), text) != texts.end();
  }

  [[nodiscard]] bool has_new_words(const std::string& text) const {
    const auto words = split_words(text);
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string& word) { return !first_words.contains(word); });
  }

  // works on one chunk; returns the utterance that ended in it
  std::optional<HeardPhrase> listen(std::array<std::int16_t, kChunk>& chunk) {
    double energy = 0.0;
    for (const std::int16_t sample : chunk) {
      energy += static_cast<double>(sample) * sample;
    }
    const double loudness = std::sqrt(energy / static_cast<double>(kChunk));
    level = std::max(level * kLevelDecay, loudness);
    background = background ? std::min(*background * kBackgroundRise, loudness) : loudness;
    loudest = std::max(loudest, loudness / std::max(*background, 1.0));
    add_noise(chunk);
    const bool speech_now = decoders.words.process(chunk.data(), chunk.size());
    now_s += kChunk_s;
    utterance.insert(utterance.end(), chunk.begin(), chunk.end());
    if (!speaking && !speech_now && utterance.size() > kBefore) {
      utterance.erase(utterance.begin(), utterance.end() - static_cast<std::ptrdiff_t>(kBefore));
    }
    if (speech_now) {
      speaking = true;
      speech_s += kChunk_s;
      if (speech_s <= settings.longest_s) return std::nullopt;
    }
    return speaking ? finish(now_s - (speech_now ? 0.0 : settings.end_silence_s)) : std::nullopt;
  }

  // ends the utterance and judges it; nothing for clicks
  std::optional<HeardPhrase> finish(double end_s) {
    decoders.words.end();
    const bool was_speaking = speaking;
    // the flag stays up through the silence that ends an utterance
    const double net_speech_s = speech_s - settings.end_silence_s;
    const bool too_long = speech_s > settings.longest_s;
    const bool steady = loudest < kLoudnessRange;
    const bool worth_it = was_speaking && !steady && net_speech_s >= settings.shortest_s;
    std::vector<Decoder::Segment> words;
    std::vector<Decoder::Segment> phones;
    std::optional<SoundEvidence> evidence;
    if (worth_it && !too_long) {
      // the answer is late by the slower of them, not by both
      auto sounds = std::async(std::launch::async, [this] { return decoders.phones.decode(utterance); });
      words = decoders.words.decode(utterance);
      if (sound_network) {
        evidence = weigh_sounds(sound_network->log_probabilities(spectrum_of(utterance)), text_of(words),
                                book.pronunciations);
      }
      phones = sounds.get();
    }
    const double loudness_db = 20.0 * std::log10(std::max(loudest, 1.0));
    start();
    if (!worth_it) return std::nullopt;

    HeardPhrase heard;
    heard.end_s = end_s;
    const std::string text = text_of(words);
    heard.nearest = text;
    heard.misfit = misfit(words, phones);
    heard.loudness_db = loudness_db;
    heard.sounds = evidence;
    heard.confidence = confidence_of(heard.misfit, heard.loudness_db, evidence, has_new_words(text),
                                     book.names_a_thing(text));
    if (too_long) {
      heard.reason = fmt::format("no such phrase: somebody spoke for more than {:.0f} s without a pause",
                                 settings.longest_s);
    } else if (text.empty()) {
      heard.reason = "no such phrase: I heard something, but no words";
    } else if (!knows(text)) {
      heard.reason = fmt::format("no such phrase: what was said sounds like \"{}\"", text);
    } else if (heard.confidence < settings.lowest_confidence) {
      heard.reason = fmt::format(
          "no such phrase: the nearest that I know is \"{}\", but it does not fit (confidence {:.2f})", text,
          heard.confidence);
    } else {
      heard.accepted = true;
      heard.text = text;
    }
    return heard;
  }

  PhraseBook book;
  SpeechSettings settings;
  std::map<std::string, std::vector<std::string>> first_words;  // of the first book; others came later
  Decoders decoders;
  std::optional<SoundNetwork> sound_network;
  PinkNoise noise;
  std::vector<std::int16_t> pending;    // samples that do not fill a chunk yet
  std::vector<std::int16_t> utterance;  // what is going on, and a little before it
  double now_s = 0.0;                   // time after the last chunk
  bool time_known = false;
  bool speaking = false;             // in this utterance
  double speech_s = 0.0;             // length of this utterance's speech
  double loudest = 0.0;              // loudness of this utterance's loudest chunk over the background
  double level = kStartLevel;        // root mean square of the loudest speech, slowly forgotten
  std::optional<double> background;  // root mean square of the quietest moments
};

Result<std::unique_ptr<SpeechCore>> SpeechCore::create(const PhraseBook& book,
                                                       const SpeechSettings& settings) {
  if (!(settings.end_silence_s >= 0.1 && settings.end_silence_s <= 2.0)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("end_silence_s is {}; allowed are 0.1 to 2 s", settings.end_silence_s)};
  }
  if (!(settings.longest_s > settings.shortest_s) || !(settings.shortest_s >= 0.0)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("shortest_s {} and longest_s {}: expected 0 <= shortest_s < longest_s",
                             settings.shortest_s, settings.longest_s)};
  }
  if (!(settings.noise_floor_db <= 0.0)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("noise_floor_db is {}; it must not be above 0", settings.noise_floor_db)};
  }
  auto decoders = Impl::make_decoders(book, settings);
  if (!decoders) return decoders.error();
  std::optional<SoundNetwork> network;
  if (!settings.adaptation.empty()) {
    auto loaded = SoundNetwork::load((std::filesystem::path(settings.adaptation) / "sounds").string());
    if (!loaded) return loaded.error();
    network = std::move(loaded).value();
  }
  return std::unique_ptr<SpeechCore>(new SpeechCore(
      std::make_unique<Impl>(book, settings, std::move(decoders).value(), std::move(network))));
}

Status SpeechCore::set_book(const PhraseBook& book) {
  auto decoders = Impl::make_decoders(book, impl_->settings);
  if (!decoders) return decoders.error();
  impl_->book = book;
  impl_->decoders = std::move(decoders).value();
  impl_->warm_up();
  return {};
}

Result<std::map<std::string, std::vector<std::string>>> SpeechCore::pronunciations(
    const std::vector<std::string>& words) const {
  const std::string& dictionary = impl_->settings.dictionary;
  auto found =
      look_up_pronunciations(dictionary.empty() ? kDictionary : dictionary, {words.begin(), words.end()});
  if (!found) return found.error();
  for (const auto& word : words) {
    if (!found->contains(word)) {
      return Error{
          ErrorCode::kNotFound,
          fmt::format("the dictionary does not have the word '{}': say how it sounds in phrases.yaml", word)};
    }
  }
  for (auto& [word, sounds] : *found) {
    sounds = with_other_accents(sounds);
    // the first sound of "this" is so soft that it gets lost at the beginning of a sentence
    for (std::size_t i = sounds.size(); i-- > 0;) {
      if (sounds[i].starts_with("DH ")) sounds.push_back(sounds[i].substr(3));
    }
  }
  return found;
}

Status SpeechCore::add_name(const std::string& name, PhraseBook& book) const {
  std::vector<std::string> unknown;
  for (const std::string& word : split_words(kNaming + name)) {
    if (!book.pronunciations.contains(word)) unknown.push_back(word);
  }
  const auto sounds = pronunciations(unknown);
  if (!sounds) return sounds.error();
  PhraseBook more = book;
  more.pronunciations.insert(sounds->begin(), sounds->end());
  if (const Status added = more.add_name(name); !added) return added;
  book = std::move(more);
  return {};
}

SpeechCore::SpeechCore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SpeechCore::~SpeechCore() = default;

Result<std::vector<HeardPhrase>> SpeechCore::feed(const AudioBlock& block) {
  if (block.sample_rate_hz != kSpeechRate_hz) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the sound has {} samples a second; speech needs {}", block.sample_rate_hz,
                             kSpeechRate_hz)};
  }
  if (block.channels != 1 && block.channels != 2) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the sound has {} channels; speech takes 1 or 2", block.channels)};
  }
  if (block.samples.size() % block.channels != 0) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} samples do not fill {} channels", block.samples.size(), block.channels)};
  }
  if (!std::isfinite(block.start_s)) {
    return Error{ErrorCode::kInvalidArgument, "the time of the sound is not a number"};
  }

  std::vector<HeardPhrase> heard;
  const double expected_s = impl_->now_s + static_cast<double>(impl_->pending.size()) / kSpeechRate_hz;
  if (!impl_->time_known || std::abs(block.start_s - expected_s) > kLongestGap_s) {
    if (impl_->time_known) heard = flush();
    impl_->pending.clear();
    impl_->now_s = block.start_s;
    impl_->time_known = true;
  }
  for (std::size_t i = 0; i < block.samples.size(); i += block.channels) {
    const int sum = block.channels == 1 ? block.samples[i] : (block.samples[i] + block.samples[i + 1]) / 2;
    impl_->pending.push_back(static_cast<std::int16_t>(sum));
  }
  std::size_t used = 0;
  for (; used + kChunk <= impl_->pending.size(); used += kChunk) {
    std::array<std::int16_t, kChunk> chunk{};
    std::copy_n(impl_->pending.begin() + static_cast<std::ptrdiff_t>(used), kChunk, chunk.begin());
    if (auto phrase = impl_->listen(chunk)) heard.push_back(std::move(*phrase));
  }
  impl_->pending.erase(impl_->pending.begin(), impl_->pending.begin() + static_cast<std::ptrdiff_t>(used));
  return heard;
}

std::vector<HeardPhrase> SpeechCore::flush() {
  std::vector<HeardPhrase> heard;
  if (!impl_->speaking) return heard;
  // at a cut there was no end silence to subtract
  impl_->speech_s += impl_->settings.end_silence_s;
  if (auto phrase = impl_->finish(impl_->now_s)) heard.push_back(std::move(*phrase));
  return heard;
}

bool SpeechCore::in_speech() const { return impl_->speaking; }

}  // namespace nido
