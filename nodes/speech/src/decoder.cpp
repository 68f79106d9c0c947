#include "decoder.h"

#include <fmt/format.h>
#include <pocketsphinx/pocketsphinx.h>
#include <sphinxbase/err.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

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

std::string dictionary_text(const PhraseBook& book) {
  std::string text;
  for (const auto& [word, pronunciations] : book.pronunciations) {
    for (std::size_t i = 0; i < pronunciations.size(); ++i) {
      text += i == 0 ? fmt::format("{} {}\n", word, pronunciations[i])
                     : fmt::format("{}({}) {}\n", word, i + 1, pronunciations[i]);
    }
  }
  return text;
}

}  // namespace

void Decoder::Free::operator()(ps_decoder_s* decoder) const { ps_free(decoder); }

Result<Decoder> Decoder::create(const PhraseBook& book, const AcousticModel& model, Kind kind,
                                int end_silence_frames) {
  err_set_logfp(nullptr);
  const auto dictionary = TemporaryFile::create(dictionary_text(book));
  if (!dictionary) return dictionary.error();
  const auto language = TemporaryFile::create(phrase_grammar(book));
  if (!language) return language.error();

  const std::string end_silence = fmt::format("{}", end_silence_frames);
  // all states are scored, so that scores are relative to the same best one in both kinds; wide beams,
  // because the vocabulary is tiny: pruning would save nothing and cost phrases
  cmd_ln_t* config = cmd_ln_init(
      nullptr, ps_args(), TRUE, "-hmm", model.folder.c_str(), "-dict", dictionary->path(), "-compallsen",
      "yes", "-beam", "1e-80", "-wbeam", "1e-60", "-pbeam", "1e-80", "-lw", "1", "-silprob", "0.1",
      "-allphone_ci", "yes", "-vad_postspeech", end_silence.c_str(), "-logfn", "/dev/null", nullptr);
  if (config == nullptr) {
    return Error{ErrorCode::kFailed, "PocketSphinx refuses its settings: is another version installed?"};
  }
  if (!model.adaptation.empty()) {
    const std::filesystem::path folder = model.adaptation;
    for (const auto& [option, file] :
         {std::pair{"-mean", "means"}, {"-var", "variances"}, {"-sendump", "sendump"}}) {
      cmd_ln_set_str_r(config, option, (folder / file).c_str());
    }
  }
  if (kind == Kind::kWords) cmd_ln_set_str_r(config, "-fsg", language->path());
  std::unique_ptr<ps_decoder_s, Free> decoder(ps_init(config));
  cmd_ln_free_r(config);
  if (decoder && kind == Kind::kPhones &&
      (ps_set_allphone(decoder.get(), "phones", nullptr) != 0 ||
       ps_set_search(decoder.get(), "phones") != 0)) {
    decoder.reset();
  }
  if (!decoder) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("PocketSphinx cannot start with the acoustic model {} {} and these phrases: does every "
                    "pronunciation use the model's phones?",
                    model.folder, model.adaptation)};
  }
  return Decoder(std::move(decoder));
}

void Decoder::start() { ps_start_utt(decoder_.get()); }

bool Decoder::process(const std::int16_t* samples, std::size_t count) {
  ps_process_raw(decoder_.get(), samples, count, FALSE, FALSE);
  return ps_get_in_speech(decoder_.get()) != 0;
}

void Decoder::end() { ps_end_utt(decoder_.get()); }

std::vector<Decoder::Segment> Decoder::decode(const std::vector<std::int16_t>& samples) {
  // PocketSphinx tells acoustic scores in steps of 2^10 of its logarithm
  constexpr double kScoreStep = 1024.0;
  ps_start_utt(decoder_.get());
  ps_process_raw(decoder_.get(), samples.data(), samples.size(), FALSE, TRUE);
  ps_end_utt(decoder_.get());
  std::vector<Segment> segments;
  int32 total = 0;
  if (ps_get_hyp(decoder_.get(), &total) == nullptr) return segments;
  for (ps_seg_t* item = ps_seg_iter(decoder_.get()); item != nullptr; item = ps_seg_next(item)) {
    int first = 0;
    int last = 0;
    int32 score = 0;
    int32 language = 0;
    int32 back_off = 0;
    ps_seg_frames(item, &first, &last);
    ps_seg_prob(item, &score, &language, &back_off);
    Segment segment{ps_seg_word(item), last - first + 1,
                    kScoreStep * logmath_log_to_ln(ps_get_logmath(decoder_.get()), score)};
    if (segment.frames <= 0 || segment.word.starts_with('(')) continue;  // an empty step of the grammar
    if (segment.word.starts_with('<') || segment.word.starts_with('[') || segment.word.starts_with('+')) {
      segment.word.clear();
    }
    segment.word = segment.word.substr(0, segment.word.find('('));  // the pronunciation's number
    segments.push_back(std::move(segment));
  }
  return segments;
}

}  // namespace nido
