// nido-speech-train-sounds: trains the network that tells which sound is said in each hundredth of a second
// (config/speech_model/sounds). espeak-ng tells which sounds it makes and when; neither the voices nor the
// words of the experiment take part. docs/speech.md

#include <espeak-ng/speak_lib.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "../experiment/other_speech.h"
#include "nido/speech/phrases.h"
#include "nido/speech/voice.h"
#include "sounds.h"
#include "voices.h"

namespace nido {
namespace {

struct Request {
  std::string phrases;
  std::string dictionary = "/usr/share/pocketsphinx/model/en-us/cmudict-en-us.dict";
  std::string out;
  int count = 8000;
  int epochs = 4;
  int hidden = 256;
  std::uint64_t seed = 1;
};

class Chooser {
 public:
  explicit Chooser(std::uint64_t seed) : generator_(seed) {}
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(generator_() % count); }
  double unit() { return static_cast<double>(generator_() >> 11U) * 0x1p-53; }
  template <class List>
  const auto& of(const List& list) {
    return list[below(list.size())];
  }

 private:
  std::mt19937_64 generator_;
};

// Sounds of espeak-ng, in the phonetic alphabet, and what they are in ARPAbet. The longest that fits counts.
const std::vector<std::pair<std::string, std::vector<const char*>>> kAlphabet = {
    {"tʃ", {"CH"}},       {"dʒ", {"JH"}},       {"eɪ", {"EY"}},        {"aɪ", {"AY"}},
    {"ɔɪ", {"OY"}},       {"aʊ", {"AW"}},       {"oʊ", {"OW"}},        {"əʊ", {"OW"}},
    {"ɪə", {"IH", "AH"}}, {"iə", {"IY", "AH"}}, {"eə", {"EH"}},        {"ʊə", {"UH", "AH"}},
    {"əl", {"AH", "L"}},  {"n̩", {"AH", "N"}},   {"aɪɚ", {"AY", "ER"}}, {"aɪə", {"AY", "AH"}},
    {"ɔːɹ", {"AO", "R"}}, {"oːɹ", {"AO", "R"}}, {"ɑːɹ", {"AA", "R"}},  {"ɛɹ", {"EH", "R"}},
    {"ɪɹ", {"IH", "R"}},  {"ʊɹ", {"UH", "R"}},  {"ʌɹ", {"ER"}},        {"ɔ̃", {"AO"}},
    {"ɑ̃", {"AA"}},        {"p", {"P"}},         {"b", {"B"}},          {"t", {"T"}},
    {"d", {"D"}},         {"k", {"K"}},         {"ɡ", {"G"}},          {"g", {"G"}},
    {"ɾ", {"T"}},         {"ʔ", {"T"}},         {"m", {"M"}},          {"n", {"N"}},
    {"ŋ", {"NG"}},        {"f", {"F"}},         {"v", {"V"}},          {"θ", {"TH"}},
    {"ð", {"DH"}},        {"s", {"S"}},         {"z", {"Z"}},          {"ʃ", {"SH"}},
    {"ʒ", {"ZH"}},        {"h", {"HH"}},        {"l", {"L"}},          {"ɬ", {"L"}},
    {"ɫ", {"L"}},         {"ɹ", {"R"}},         {"r", {"R"}},          {"w", {"W"}},
    {"ʍ", {"W"}},         {"j", {"Y"}},         {"x", {"K"}},          {"ç", {"HH"}},
    {"ɑ", {"AA"}},        {"ɒ", {"AA"}},        {"ɔ", {"AO"}},         {"o", {"OW"}},
    {"æ", {"AE"}},        {"a", {"AE"}},        {"ʌ", {"AH"}},         {"ə", {"AH"}},
    {"ɐ", {"AH"}},        {"ɛ", {"EH"}},        {"e", {"EH"}},         {"ɜ", {"ER"}},
    {"ɝ", {"ER"}},        {"ɚ", {"ER"}},        {"ɪ", {"IH"}},         {"ᵻ", {"IH"}},
    {"i", {"IY"}},        {"ʊ", {"UH"}},        {"u", {"UW"}},         {"ʉ", {"UW"}},
    {"y", {"UW"}},        {"ɨ", {"IH"}},        {"ɵ", {"UH"}},         {"ø", {"ER"}}};

// "ɑː" -> {AA}; marks of length and the like are passed over, what is not known is silence and noted.
std::vector<int> sounds_in(std::string text, std::set<std::string>& unknown) {
  std::vector<int> sounds;
  while (!text.empty()) {
    const auto* best = static_cast<const std::pair<std::string, std::vector<const char*>>*>(nullptr);
    for (const auto& entry : kAlphabet) {
      if (text.starts_with(entry.first) && (best == nullptr || entry.first.size() > best->first.size()))
        best = &entry;
    }
    if (best != nullptr) {
      for (const char* name : best->second) sounds.push_back(*sound_of(name));
      text.erase(0, best->first.size());
      continue;
    }
    std::size_t length = 1;  // of one character in UTF-8
    while (length < text.size() && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) ++length;
    const std::string mark = text.substr(0, length);
    if (mark != "ː" && mark != "ˈ" && mark != "ˌ" && mark != "_" && mark != ":" && mark != "ʲ" &&
        mark != "\u032a" && mark != "\u0329" && mark != "\u0303")
      unknown.insert(text);
    text.erase(0, length);
  }
  return sounds;
}

// espeak-ng inside this process, which tells when it makes which sound.
class Speaker {
 public:
  Speaker()
      : rate_hz_(espeak_Initialize(AUDIO_OUTPUT_RETRIEVAL, 0, nullptr,
                                   espeakINITIALIZE_PHONEME_EVENTS | espeakINITIALIZE_PHONEME_IPA)) {
    espeak_SetSynthCallback(&Speaker::take);
  }

  struct Spoken {
    std::vector<std::int16_t> samples;           // 16 kHz, as speak() gives them
    std::vector<std::pair<double, int>> sounds;  // where each begins, in samples
  };
  Spoken speak(const std::string& text, const Voice& voice, double before_s, double after_s) {
    constexpr double kRate_hz = 16000.0;
    raw_.clear();
    marks_.clear();
    if (espeak_SetVoiceByName(voice.name.c_str()) != EE_OK) return {};
    espeak_SetParameter(espeakRATE, voice.words_per_minute, 0);
    espeak_SetParameter(espeakPITCH, voice.pitch, 0);
    espeak_Synth(text.c_str(), text.size() + 1, 0, POS_CHARACTER, 0, espeakCHARS_UTF8, nullptr, this);
    espeak_Synchronize();
    const std::vector<float> sound = resample(raw_, rate_hz_, kRate_hz);
    float peak = 1e-6F;
    for (const float sample : sound) peak = std::max(peak, std::abs(sample));
    const auto loud = [&](float sample) { return std::abs(sample) > 0.01F * peak; };
    const auto first = std::find_if(sound.begin(), sound.end(), loud);
    const auto last = std::find_if(sound.rbegin(), sound.rend(), loud).base();
    Spoken spoken;
    spoken.samples.assign(static_cast<std::size_t>(before_s * kRate_hz), 0);
    const double shift =
        static_cast<double>(spoken.samples.size()) - static_cast<double>(first - sound.begin());
    for (auto sample = first; sample < last; ++sample)
      spoken.samples.push_back(static_cast<std::int16_t>(std::lround(*sample / peak * 0.708 * 32767.0)));
    const auto end = static_cast<double>(spoken.samples.size());
    spoken.samples.resize(spoken.samples.size() + static_cast<std::size_t>(after_s * kRate_hz), 0);
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const double from = marks_[i].first * kRate_hz / rate_hz_ + shift;
      const double to = i + 1 < marks_.size() ? marks_[i + 1].first * kRate_hz / rate_hz_ + shift : end;
      std::vector<int> sounds = sounds_in(marks_[i].second, unknown);
      if (sounds.empty()) sounds = {kSilence};
      for (std::size_t k = 0; k < sounds.size(); ++k) {
        spoken.sounds.emplace_back(
            from + (to - from) * static_cast<double>(k) / static_cast<double>(sounds.size()), sounds[k]);
      }
    }
    spoken.sounds.emplace_back(end, kSilence);
    return spoken;
  }
  std::set<std::string> unknown;  // sounds that kAlphabet does not have

 private:
  static int take(short* samples, int count, espeak_EVENT* event) {  // NOLINT(google-runtime-int): espeak's
    auto* self = static_cast<Speaker*>(event->user_data);
    for (int i = 0; i < count && samples != nullptr; ++i)
      self->raw_.push_back(static_cast<float>(samples[i]) / 32768.0F);
    for (; event->type != espeakEVENT_LIST_TERMINATED; ++event) {
      if (event->type != espeakEVENT_PHONEME) continue;
      std::array<char, 9> name{};
      std::memcpy(name.data(), event->id.string, 8);
      self->marks_.emplace_back(event->sample, name.data());
    }
    return 0;
  }
  int rate_hz_;
  std::vector<float> raw_;
  std::vector<std::pair<double, std::string>> marks_;
};

using Dictionary = std::vector<std::pair<std::string, std::vector<std::string>>>;  // word, sounds

Dictionary read_dictionary(const std::string& path, const std::set<std::string>& without) {
  std::ifstream stream(path);
  Dictionary dictionary;
  for (std::string line; std::getline(stream, line);) {
    auto words = split_words(line);
    if (words.size() < 3) continue;
    const std::string word = words[0];
    if (without.contains(word) ||
        !std::all_of(word.begin(), word.end(), [](char c) { return c >= 'a' && c <= 'z'; }))
      continue;
    words.erase(words.begin());
    dictionary.emplace_back(word, std::move(words));
  }
  return dictionary;
}

std::size_t edits(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t corner = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, corner + (a[i - 1] == b[j - 1] ? 0 : 1)});
      corner = above;
    }
  }
  return row.back();
}

// Words that sound nearly like each word of the book.
std::map<std::string, std::vector<std::string>> similar_words(const PhraseBook& book,
                                                              const Dictionary& dictionary) {
  std::map<std::string, std::vector<std::string>> similar;
  for (const auto& [word, pronunciations] : book.pronunciations) {
    for (const std::string& pronunciation : pronunciations) {
      const auto own = split_words(pronunciation);
      for (const auto& [other, sounds] : dictionary) {
        if (other != word && edits(own, sounds) <= 1 + own.size() / 3) similar[word].push_back(other);
      }
    }
  }
  return similar;
}

std::string choose_text(Chooser& choose, const std::vector<std::string>& texts, const Dictionary& dictionary,
                        const std::map<std::string, std::vector<std::string>>& similar) {
  const std::size_t kind = choose.below(20);
  if (kind < 5) return choose.of(texts);
  std::vector<std::string> sentence;
  if (kind < 14) {
    sentence = split_words(choose.of(texts));
    std::string& word = sentence[choose.below(sentence.size())];
    const auto found = similar.find(word);
    word = found != similar.end() && choose.below(10) < 7 ? choose.of(found->second)
                                                          : choose.of(dictionary).first;
  } else {
    for (std::size_t i = 1 + choose.below(4); i > 0; --i) sentence.push_back(choose.of(dictionary).first);
  }
  return fmt::format("{}", fmt::join(sentence, " "));
}

// What is learned from: spectra side by side, and which sound every frame is.
struct Lessons {
  std::vector<Eigen::MatrixXf> spectra;
  std::vector<std::vector<int>> sounds;
};

Lessons make_lessons(const Request& request, const PhraseBook& book, std::set<std::string>& unknown) {
  std::set<std::string> without = other_words();
  for (const auto& [word, sounds] : book.pronunciations) without.erase(word);
  const Dictionary dictionary = read_dictionary(request.dictionary, without);
  const auto similar = similar_words(book, dictionary);
  const auto texts = book.texts();
  Chooser choose(request.seed);
  Speaker speaker;
  Lessons lessons;
  for (int i = 0; i < request.count; ++i) {
    const std::string variant = choose.of(kVariants);
    Voice voice{choose.of(kAccents) + (variant.empty() ? "" : "+" + variant)};
    voice.words_per_minute = static_cast<int>(115 + choose.below(100));
    voice.pitch = static_cast<int>(30 + choose.below(45));
    auto spoken = speaker.speak(choose_text(choose, texts, dictionary, similar), voice,
                                0.3 + 0.3 * choose.unit(), 0.2 + 0.5 * choose.unit());
    if (spoken.samples.empty()) continue;
    const std::uint64_t noise_seed = request.seed * 1000003 + static_cast<std::uint64_t>(i);
    if (choose.below(10) >= 3) {
      add_noise(spoken.samples, choose.below(2) == 0 ? NoiseKind::kPink : NoiseKind::kWhite,
                5.0 + 20.0 * choose.unit(), noise_seed + 1);
    }
    add_noise(spoken.samples, NoiseKind::kPink, 33.0, noise_seed);  // as the recogniser adds it
    lessons.spectra.push_back(spectrum_of(spoken.samples));
    std::vector<int> sounds(static_cast<std::size_t>(lessons.spectra.back().cols()), kSilence);
    std::size_t next = 0;
    int now = kSilence;
    for (std::size_t frame = 0; frame < sounds.size(); ++frame) {
      const double middle = static_cast<double>(frame) * kSpectrumHop + kSpectrumWindow / 2.0;
      while (next < spoken.sounds.size() && spoken.sounds[next].first <= middle)
        now = spoken.sounds[next++].second;
      sounds[frame] = now;
    }
    lessons.sounds.push_back(std::move(sounds));
    if ((i + 1) % 1000 == 0) fmt::print("{} lessons\n", i + 1);
  }
  unknown = speaker.unknown;
  return lessons;
}

// Adam, over batches of frames of all lessons.
class Trainer {
 public:
  Trainer(int hidden, std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    int inputs = SoundNetwork::kInputs;
    for (std::size_t i = 0; i < 3; ++i) {
      const int outputs = i == 2 ? SoundNetwork::kOutputs : hidden;
      const double range = std::sqrt(6.0 / inputs);
      network_.weights[i] = Eigen::MatrixXf::NullaryExpr(outputs, inputs, [&] {
        return static_cast<float>(range * (static_cast<double>(generator() >> 11U) * 0x1p-52 - 1.0));
      });
      network_.biases[i] = Eigen::VectorXf::Zero(outputs);
      for (auto* moments : {&first_, &second_}) {
        (*moments).weights[i] = Eigen::MatrixXf::Zero(outputs, inputs);
        (*moments).biases[i] = Eigen::VectorXf::Zero(outputs);
      }
      inputs = outputs;
    }
  }

  // One step; returns the batch's mean loss and the share that is right.
  std::pair<double, double> learn(const Eigen::MatrixXf& input, const std::vector<int>& wanted, float rate) {
    const auto count = static_cast<float>(input.cols());
    std::array<Eigen::MatrixXf, 4> layers;
    layers[0] = input;
    for (std::size_t i = 0; i < 3; ++i) {
      layers[i + 1].noalias() = network_.weights[i] * layers[i];
      layers[i + 1].colwise() += network_.biases[i];
      if (i < 2) layers[i + 1] = layers[i + 1].cwiseMax(0.0F);
    }
    double loss = 0.0;
    double right = 0.0;
    Eigen::MatrixXf delta = layers[3];
    for (Eigen::Index k = 0; k < delta.cols(); ++k) {
      const Eigen::Index target = wanted[static_cast<std::size_t>(k)];
      Eigen::Index best = 0;
      const float highest = delta.col(k).maxCoeff(&best);
      delta.col(k) = (delta.col(k).array() - highest).exp();
      delta.col(k) /= delta.col(k).sum();
      loss -= std::log(std::max(1e-9F, delta(target, k)));
      right += best == target ? 1.0 : 0.0;
      delta(target, k) -= 1.0F;
    }
    delta /= count;
    ++steps_;
    for (std::size_t i = 3; i-- > 0;) {
      const Eigen::MatrixXf slope = delta * layers[i].transpose();
      const Eigen::VectorXf bias_slope = delta.rowwise().sum();
      if (i > 0) {
        const Eigen::MatrixXf back = network_.weights[i].transpose() * delta;
        delta = back.cwiseProduct((layers[i].array() > 0.0F).cast<float>().matrix());
      }
      step(network_.weights[i], first_.weights[i], second_.weights[i], slope, rate);
      step(network_.biases[i], first_.biases[i], second_.biases[i], bias_slope, rate);
    }
    return {loss / count, right / count};
  }
  [[nodiscard]] const SoundNetwork& network() const { return network_; }

 private:
  template <class Matrix>
  void step(Matrix& value, Matrix& first, Matrix& second, const Matrix& slope, float rate) const {
    constexpr float kFirst = 0.9F;
    constexpr float kSecond = 0.999F;
    first = kFirst * first + (1.0F - kFirst) * slope;
    second = kSecond * second + (1.0F - kSecond) * slope.cwiseAbs2();
    const float corrected = rate * std::sqrt(1.0F - std::pow(kSecond, static_cast<float>(steps_))) /
                            (1.0F - std::pow(kFirst, static_cast<float>(steps_)));
    value.array() -= corrected * first.array() / (second.array().sqrt() + 1e-7F);
  }
  SoundNetwork network_;
  SoundNetwork first_;
  SoundNetwork second_;
  long steps_ = 0;
};

Status run(const Request& request) {
  const auto book = PhraseBook::load(request.phrases);
  if (!book) return book.error();
  std::set<std::string> unknown;
  const Lessons lessons = make_lessons(request, *book, unknown);
  for (const auto& sound : unknown) fmt::print("passed over: {}\n", sound);

  // speech, and as much of the silence around it as makes a tenth or so; a fiftieth of the lessons is kept to
  // see what was learned
  Chooser choose(request.seed + 1);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> frames;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> held_back;
  for (std::uint32_t i = 0; i < lessons.spectra.size(); ++i) {
    for (std::uint32_t k = 0; k < lessons.sounds[i].size(); ++k) {
      if (lessons.sounds[i][k] == kSilence && choose.below(3) > 0) continue;
      (i % 50 == 0 ? held_back : frames).emplace_back(i, k);
    }
  }
  fmt::print("{} frames to learn from\n", frames.size());
  constexpr std::size_t kBatch = 512;
  Trainer trainer(request.hidden, request.seed + 2);
  Eigen::MatrixXf input(SoundNetwork::kInputs, kBatch);
  std::vector<int> wanted(kBatch);
  const std::size_t batches = frames.size() / kBatch;
  std::mt19937_64 generator(request.seed + 3);
  for (int epoch = 0; epoch < request.epochs; ++epoch) {
    for (std::size_t i = frames.size(); i > 1; --i) std::swap(frames[i - 1], frames[generator() % i]);
    double loss = 0.0;
    for (std::size_t batch = 0; batch < batches; ++batch) {
      for (std::size_t k = 0; k < kBatch; ++k) {
        const auto& [lesson, frame] = frames[batch * kBatch + k];
        SoundNetwork::input_of(lessons.spectra[lesson], frame, input.col(static_cast<Eigen::Index>(k)));
        wanted[k] = lessons.sounds[lesson][frame];
      }
      const double done =
          (epoch + static_cast<double>(batch) / static_cast<double>(batches)) / request.epochs;
      loss += trainer.learn(input, wanted, static_cast<float>(1e-3 * (1.0 - 0.97 * done))).first;
    }
    double right = 0.0;
    std::uint32_t known = ~0U;
    Eigen::MatrixXf answer;
    for (const auto& [lesson, frame] : held_back) {
      if (known != lesson) answer = trainer.network().log_probabilities(lessons.spectra[lesson]);
      known = lesson;
      Eigen::Index best = 0;
      answer.col(frame).maxCoeff(&best);
      right += best == lessons.sounds[lesson][frame] ? 1.0 : 0.0;
    }
    fmt::print("epoch {}: loss {:.3f}, right in lessons held back {:.1f} %\n", epoch + 1,
               loss / static_cast<double>(batches),
               100.0 * right / static_cast<double>(std::max<std::size_t>(1, held_back.size())));
    std::fflush(stdout);
    if (const Status saved = trainer.network().save(request.out); !saved) return saved;
  }
  return {};
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  CLI::App app("Trains the network that tells sounds of speech apart.", "nido-speech-train-sounds");
  app.add_option("--phrases", request.phrases, "phrases.yaml")->required();
  app.add_option("--out", request.out, "file for the network")->required();
  app.add_option("--count", request.count, "lessons")->check(CLI::Range(100, 1000000))->capture_default_str();
  app.add_option("--epochs", request.epochs, "times through all of them")->check(CLI::Range(1, 1000));
  app.add_option("--hidden", request.hidden, "units of a hidden layer")->check(CLI::Range(8, 4096));
  app.add_option("--seed", request.seed, "")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const nido::Status status = nido::run(request);
  if (!status) fmt::print(stderr, "{}\n", status.error().message);
  return status ? 0 : 1;
}
