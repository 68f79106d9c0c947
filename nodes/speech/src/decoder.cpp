#include "decoder.h"

#include <fmt/format.h>
#include <pocketsphinx/pocketsphinx.h>
#include <sphinxbase/err.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

namespace nido {

namespace {

// A file that lives as long as this object: PocketSphinx reads dictionaries and models from files only.
class TemporaryFile {
 public:
  static Result<TemporaryFile> create(const std::string& content) {
    std::string path = (std::filesystem::temp_directory_path() / "nido-speech-XXXXXX").string();
    const int descriptor = mkstemp(path.data());
    if (descriptor < 0) {
      return Error{ErrorCode::kFailed,
                   fmt::format("cannot make a temporary file in {}: is the folder writable?",
                               std::filesystem::temp_directory_path().string())};
    }
    close(descriptor);
    TemporaryFile file(path);
    std::ofstream stream(path);
    stream << content;
    stream.close();
    if (!stream) {
      return Error{ErrorCode::kFailed, fmt::format("cannot write {}: is the disk full?", path)};
    }
    return file;
  }
  ~TemporaryFile() {
    if (!path_.empty()) {
      std::error_code ignored;
      std::filesystem::remove(path_, ignored);
    }
  }
  TemporaryFile(TemporaryFile&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFile& operator=(TemporaryFile&&) = delete;
  [[nodiscard]] const char* path() const { return path_.c_str(); }

 private:
  explicit TemporaryFile(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

std::string dictionary_text(const Decoder::Sounds& sounds) {
  std::string text;
  for (const auto& [word, pronunciations] : sounds) {
    for (std::size_t i = 0; i < pronunciations.size(); ++i) {
      text += i == 0 ? fmt::format("{} {}\n", word, pronunciations[i])
                     : fmt::format("{}({}) {}\n", word, i + 1, pronunciations[i]);
    }
  }
  return text;
}

// What else might have been said: the weight of each different text in the N-best list by its best score,
// acoustic scores flattened as for posteriors.
std::map<std::string, double> weigh(ps_decoder_t* decoder) {
  constexpr int kListLength = 200;
  constexpr double kFlatten = 20.0;
  std::map<std::string, double> score_by_text;
  ps_nbest_t* list = ps_nbest(decoder);
  for (int i = 0; list != nullptr && i < kListLength; ++i) {
    int32 score = 0;
    if (const char* text = ps_nbest_hyp(list, &score); text != nullptr) {
      score_by_text.try_emplace(text, logmath_log_to_ln(ps_get_logmath(decoder), score) / kFlatten);
    }
    list = ps_nbest_next(list);  // frees the list at its end
  }
  if (list != nullptr) {
    ps_nbest_free(list);
  }
  double best = -std::numeric_limits<double>::infinity();
  for (const auto& [text, score] : score_by_text) best = std::max(best, score);
  double sum = 0.0;
  for (auto& [text, score] : score_by_text) {
    score = std::exp(score - best);
    sum += score;
  }
  for (auto& [text, score] : score_by_text) score /= sum;
  return score_by_text;
}

}  // namespace

void Decoder::Free::operator()(ps_decoder_s* decoder) const { ps_free(decoder); }

Result<Decoder> Decoder::create(const PhraseBook& book, const std::string& acoustic_model, Model model,
                                int end_silence_frames, const Sounds& rivals) {
  err_set_logfp(nullptr);
  Sounds sounds = book.pronunciations;
  sounds.insert(rivals.begin(), rivals.end());
  const auto dictionary = TemporaryFile::create(dictionary_text(sounds));
  if (!dictionary) return dictionary.error();
  struct Kind {
    const char* option;
    std::string text;
    const char* weight;  // of the language against the sound
    const char* beam;
    const char* word_beam;
  };
  // wide beams where the vocabulary is tiny, so that pruning saves nothing and costs phrases
  const auto kind = [&]() -> Kind {
    switch (model) {
      case Model::kGrammar:
        return {"-jsgf", jsgf_grammar(book), "3", "1e-80", "1e-60"};
      case Model::kTrigram:
        return {"-lm", arpa_trigram(book), "3", "1e-80", "1e-60"};
      case Model::kOpen:
        break;
    }
    std::vector<std::string> words;
    for (const auto& [word, pronunciations] : rivals) words.push_back(word);
    return {"-fsg", open_grammar(book, words), "1", "1e-40", "1e-30"};
  }();
  const auto language = TemporaryFile::create(kind.text);
  if (!language) return language.error();

  const std::string end_silence = fmt::format("{}", end_silence_frames);
  cmd_ln_t* config = cmd_ln_init(
      nullptr, ps_args(), TRUE, "-hmm", acoustic_model.c_str(), "-dict", dictionary->path(), kind.option,
      language->path(), "-beam", kind.beam, "-wbeam", kind.word_beam, "-pbeam", kind.beam, "-lw", kind.weight,
      "-silprob", "0.01", "-vad_postspeech", end_silence.c_str(), "-logfn", "/dev/null", nullptr);
  if (config == nullptr) {
    return Error{ErrorCode::kFailed, "PocketSphinx refuses its settings: is another version installed?"};
  }
  std::unique_ptr<ps_decoder_s, Free> decoder(ps_init(config));
  cmd_ln_free_r(config);
  if (!decoder) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("PocketSphinx cannot start with the acoustic model {} and these phrases: does every "
                    "pronunciation use the model's phones?",
                    acoustic_model)};
  }
  return Decoder(std::move(decoder));
}

void Decoder::start() { ps_start_utt(decoder_.get()); }

bool Decoder::process(const std::int16_t* samples, std::size_t count) {
  ps_process_raw(decoder_.get(), samples, count, FALSE, FALSE);
  return ps_get_in_speech(decoder_.get()) != 0;
}

void Decoder::end() { ps_end_utt(decoder_.get()); }

Decoder::Hypothesis Decoder::decode(const std::vector<std::int16_t>& samples) {
  ps_start_utt(decoder_.get());
  ps_process_raw(decoder_.get(), samples.data(), samples.size(), FALSE, TRUE);
  ps_end_utt(decoder_.get());
  Hypothesis hypothesis;
  int32 score = 0;
  if (const char* text = ps_get_hyp(decoder_.get(), &score); text != nullptr) {
    hypothesis.text = text;
    hypothesis.share = weigh(decoder_.get());
  }
  return hypothesis;
}

}  // namespace nido
