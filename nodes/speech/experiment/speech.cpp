// nido-experiment-speech: how many of the phrases are understood, by voice and noise; how often other speech
// is taken for a phrase; how late the answer comes.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "answers.h"
#include "nido/experiment/kept.h"
#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"
#include "nido/speech/speech_core.h"
#include "nido/speech/voice.h"
#include "other_speech.h"

namespace nido {
namespace {

struct Request : ExperimentRequest {
  SpeechSettings settings;
  std::string phrases;
  // none of them, and none of the speeds, was used to choose pronunciations and costs (docs/speech.md)
  std::vector<std::string> voices = {"en-us+f1", "en-us+f2",   "en-us+m7",
                                     "en-gb+m2", "en-gb-x-rp", "en-gb-scotland+m4"};
  std::vector<int> speeds = {135, 160, 190};  // words a minute
  int others = 510;                           // utterances that are no phrases, a trial
  std::vector<std::string> names;  // given while it runs: what is said about these, not the phrases
  bool tuning = false;             // with other words in these than the test
  bool fresh = false;              // forget the pieces of an earlier run
};

// Noise over the speech: none, or white or pink at a ratio to the speech's power.
struct Noise {
  std::string name;
  bool pink = false;
  double snr_db = 0.0;
  bool none = false;
};
const std::vector<Noise>& noises() {
  static const std::vector<Noise> list = {{"clean", false, 0.0, true},
                                          {"pink20", true, 20.0},
                                          {"pink10", true, 10.0},
                                          {"white20", false, 20.0},
                                          {"white10", false, 10.0}};
  return list;
}

struct Conditions {
  std::string voice;
  int speed = 0;
  Noise noise;
};

// speaks a sentence in blocks of 20 ms, as a microphone gives them
struct Answer {
  std::vector<HeardPhrase> heard;
  double end_pointing_s = 0.0;
  double decode_s = 0.0;  // wall time of the block that brought the answer
  double work_s = 0.0;    // of all blocks
};
double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}
Result<Answer> say(SpeechCore& core, double& now_s, std::vector<std::int16_t> samples,
                   double silence_after_s) {
  constexpr std::size_t kBlock = 320;
  const double end_s = now_s + static_cast<double>(samples.size()) / kSpeechRate_hz - silence_after_s;
  Answer answer;
  for (std::size_t i = 0; i < samples.size(); i += kBlock) {
    AudioBlock block;
    block.start_s = now_s;
    block.samples.assign(samples.begin() + static_cast<std::ptrdiff_t>(i),
                         samples.begin() + static_cast<std::ptrdiff_t>(std::min(samples.size(), i + kBlock)));
    now_s += static_cast<double>(block.samples.size()) / kSpeechRate_hz;
    const auto started = std::chrono::steady_clock::now();
    auto heard = core.feed(block);
    const double work_s = seconds_since(started);
    answer.work_s += work_s;
    if (!heard) return heard.error();
    for (auto& phrase : *heard) {
      answer.heard.push_back(std::move(phrase));
      answer.end_pointing_s = now_s - end_s;
      answer.decode_s = work_s;
    }
  }
  return answer;
}

// Every `step`-th sentence from `first` on, and some other speech.
struct Piece {
  Conditions conditions;
  std::size_t first = 0;
  std::size_t step = 1;
  std::vector<OtherSpeech> others;
  std::uint64_t seed = 0;
};
using Answers = std::vector<SpeechAnswer>;

// What is to be understood: the phrases, or all that can be said about the names.
std::vector<std::string> sentences(const PhraseBook& book, const std::vector<std::string>& names) {
  std::vector<std::string> all;
  for (const std::string& name : names) {
    all.push_back(kNaming + name);
    for (const Order& order : book.orders_about(name)) all.push_back(order.text);
  }
  if (names.empty()) {
    for (const Phrase& phrase : book.phrases) all.push_back(phrase.text);
  }
  return all;
}

Result<Answers> run_piece(PhraseBook book, SpeechSettings settings, const Piece& piece,
                          const std::vector<std::string>& names, const InterruptFlag& interrupt) {
  constexpr double kSilenceAfter_s = 1.0;
  settings.seed = piece.seed;
  auto core = SpeechCore::create(book, settings);
  if (!core) return core.error();
  for (const std::string& name : names) {
    if (const Status added = (*core)->add_name(name, book); !added) return added.error();
  }
  if (!names.empty()) {
    if (const Status taken = (*core)->set_book(book); !taken) return taken.error();
  }
  const Conditions& conditions = piece.conditions;
  Answers answers;
  double now_s = 0.0;
  std::uint64_t noise_seed = piece.seed * 1000;
  const auto hear = [&](const std::string& kind, const std::string& text,
                        Result<std::vector<std::int16_t>> samples) -> Status {
    if (interrupt.raised()) return Error{ErrorCode::kInterrupted, "interrupted"};
    if (!samples) return samples.error();
    if (const Noise& noise = conditions.noise; !noise.none)
      add_noise(*samples, noise.pink ? NoiseKind::kPink : NoiseKind::kWhite, noise.snr_db, ++noise_seed);
    SpeechAnswer said{conditions.voice, conditions.speed, conditions.noise.name, kind, text};
    said.sound_s = static_cast<double>(samples->size()) / kSpeechRate_hz;
    auto answer = say(**core, now_s, std::move(samples).value(), kSilenceAfter_s);
    if (!answer) return answer.error();
    said.end_pointing_s = answer->end_pointing_s;
    said.decode_s = answer->decode_s;
    said.work_s = answer->work_s;
    bool right = false;
    bool other = false;
    for (const HeardPhrase& heard : answer->heard) {
      right = right || (heard.accepted && heard.text == text);
      other = other || (heard.accepted && heard.text != text);
      said.heard += (said.heard.empty() ? "" : "; ") + (heard.accepted ? heard.text : heard.reason);
      if (heard.confidence >= said.answer.confidence) said.answer = heard;
    }
    if (kind == "phrase") {
      said.outcome = other ? "wrong" : right ? "right" : "missed";
    } else {
      said.outcome = right || other ? "taken" : "rejected";
    }
    answers.push_back(std::move(said));
    return {};
  };
  const Voice voice{conditions.voice, conditions.speed};
  const auto texts = sentences(book, names);
  for (std::size_t i = piece.first; i < texts.size(); i += piece.step) {
    const std::string& text = texts[i];
    if (const Status done = hear("phrase", text, speak(text, voice, 0.5, kSilenceAfter_s)); !done)
      return done.error();
  }
  for (const OtherSpeech& other : piece.others) {
    const Status done = hear(other.kind, other.text,
                             other.text.empty() ? make_sound(other.kind, other.seed, kSilenceAfter_s)
                                                : speak(other.text, voice, 0.5, kSilenceAfter_s));
    if (!done) return done.error();
  }
  return answers;
}

// Answers counted.
struct Cell {
  int said = 0;
  int right = 0;
  int wrong = 0;  // another phrase was heard
  int missed = 0;
  std::map<std::string, std::pair<int, int>> others;  // by kind: said, taken for a phrase
  std::vector<double> latency_s;                      // end of the speech to the answer, work included
  std::vector<double> end_pointing_s;                 // the same without the time that the work took
  double sound_s = 0.0;
  double work_s = 0.0;  // wall time
};

void add(Cell& sum, const SpeechAnswer& answer) {
  sum.sound_s += answer.sound_s;
  sum.work_s += answer.work_s;
  if (answer.kind != "phrase") {
    ++sum.others[answer.kind].first;
    sum.others[answer.kind].second += answer.outcome == "taken" ? 1 : 0;
    return;
  }
  ++sum.said;
  sum.right += answer.outcome == "right" ? 1 : 0;
  sum.wrong += answer.outcome == "wrong" ? 1 : 0;
  sum.missed += answer.outcome == "missed" ? 1 : 0;
  if (answer.outcome != "right") return;
  sum.end_pointing_s.push_back(answer.end_pointing_s);
  sum.latency_s.push_back(answer.end_pointing_s + answer.decode_s);
}

// said and taken for a phrase, of all kinds
std::pair<int, int> all_others(const Cell& cell) {
  std::pair<int, int> sum{0, 0};
  for (const auto& [kind, counts] : cell.others) {
    sum.first += counts.first;
    sum.second += counts.second;
  }
  return sum;
}

Report make_report(const Request& request, const std::map<int, Answers>& done) {
  Report report;
  report.name = "speech";
  report.title = "Understanding the phrases by voice and noise";
  report.summary =
      "Every phrase of Table IV is spoken once by every voice in every noise, at three speeds in turn, with "
      "noise "
      "mixed in at a ratio to the speech (pink10: pink noise 10 dB below). An error is a phrase that was "
      "missed or "
      "taken for another. Other utterances are near misses (a phrase with a word or two exchanged), words of "
      "the "
      "phrases in other orders, other sentences, tones and noises; a false accept is one that was taken for "
      "a "
      "phrase.";
  report.command =
      fmt::format("nido experiment run speech --seed {} --trials {}", request.seed, request.trials);
  report.seed = request.seed;
  report.trials = static_cast<long>(done.size());  // a voice at a speed in a noise

  Cell all;
  std::map<std::string, Cell> by_voice;
  std::map<std::string, Cell> by_noise;
  std::map<std::string, Cell> by_level;
  std::map<std::pair<std::string, std::string>, Cell> cells;  // voice, noise
  for (const auto& [piece, answers] : done) {
    for (const SpeechAnswer& answer : answers) {
      add(all, answer);
      add(by_voice[answer.voice], answer);
      add(by_noise[answer.noise], answer);
      add(cells[{answer.voice, answer.noise}], answer);
      for (const Noise& noise : noises()) {
        if (noise.name == answer.noise)
          add(by_level[noise.none ? "clean" : fmt::format("{:.0f}dB", noise.snr_db)], answer);
      }
    }
  }
  for (const auto& [key, cell] : cells) {
    report.trials_detail.push_back({{"voice", key.first},
                                    {"noise", key.second},
                                    {"said", static_cast<double>(cell.said)},
                                    {"right", static_cast<double>(cell.right)},
                                    {"wrong phrase", static_cast<double>(cell.wrong)},
                                    {"missed", static_cast<double>(cell.missed)},
                                    {"other utterances", static_cast<double>(all_others(cell).first)},
                                    {"false accepts", static_cast<double>(all_others(cell).second)}});
  }
  report.add("sentence_error_rate", proportion_metric(all.said - all.right, all.said));
  for (const auto& [level, cell] : by_level) {
    if (level != "clean")
      report.add("sentence_error_rate." + level, proportion_metric(cell.said - cell.right, cell.said));
  }
  report.add("wrong_phrase_rate", proportion_metric(all.wrong, all.said));
  report.add("false_accept_rate", proportion_metric(all_others(all).second, all_others(all).first));
  for (const auto& [kind, counts] : all.others) {
    report.add("false_accept_rate." + kind, proportion_metric(counts.second, counts.first));
  }
  report.add("latency_s", median_metric(all.latency_s, "s"));
  report.add("end_pointing_s", median_metric(all.end_pointing_s, "s"));
  report.add("real_time_factor", {all.sound_s > 0.0 ? all.work_s / all.sound_s : 0.0, ""});
  Plot voices{"error-by-voice", "Sentence error rate by voice", "", "rate"};
  Plot noise_plot{"error-by-noise", "Sentence error rate by noise", "", "rate"};
  const auto rate = [](const Cell& cell) {
    return cell.said > 0 ? static_cast<double>(cell.said - cell.right) / cell.said : std::nan("");
  };
  voices.series.resize(1);
  noise_plot.series.resize(1);
  for (const auto& [voice, cell] : by_voice) {
    report.add("sentence_error_rate." + voice, proportion_metric(cell.said - cell.right, cell.said));
    voices.series[0].points.push_back({static_cast<double>(voices.bar_names.size()), rate(cell)});
    voices.bar_names.push_back(voice);
  }
  for (const auto& [noise, cell] : by_noise) {
    report.add("sentence_error_rate." + noise, proportion_metric(cell.said - cell.right, cell.said));
    report.add("false_accept_rate." + noise,
               proportion_metric(all_others(cell).second, all_others(cell).first));
    noise_plot.series[0].points.push_back({static_cast<double>(noise_plot.bar_names.size()), rate(cell)});
    noise_plot.bar_names.push_back(noise);
  }
  report.plots = {voices, noise_plot};
  return report;
}

// All answers, and line by line what was not understood or taken for a phrase.
Status save_all(const std::string& out, const std::map<int, Answers>& done) {
  Answers all;
  std::ofstream mistakes(std::filesystem::path(out) / "mistakes.txt");
  for (const auto& [piece, answers] : done) {
    for (const SpeechAnswer& answer : answers) {
      all.push_back(answer);
      if (answer.outcome == "right" || answer.outcome == "rejected") continue;
      mistakes << fmt::format("{} {} {}: {} \"{}\" {}: {} (confidence {:.2f})\n", answer.voice, answer.speed,
                              answer.noise, answer.kind, answer.text, answer.outcome,
                              answer.heard.empty() ? "nothing" : answer.heard, answer.answer.confidence);
    }
  }
  return save_answers((std::filesystem::path(out) / "answers.tsv").string(), all);
}

Status run(const Request& request) {
  const auto book = PhraseBook::load(request.phrases);
  if (!book) return book.error();

  const std::size_t speeds = request.speeds.size();
  const std::size_t per_trial = request.voices.size() * noises().size() * speeds;
  const std::size_t total = per_trial * static_cast<std::size_t>(request.trials);
  const auto others =
      other_speech(static_cast<std::size_t>(request.others) * static_cast<std::size_t>(request.trials),
                   request.seed, request.tuning);
  const auto piece_of = [&](std::size_t i) {
    const std::size_t speed = i % speeds;
    const std::size_t noise = i / speeds % noises().size();
    const std::size_t voice = i / speeds / noises().size() % request.voices.size();
    // the speeds share the phrases of a voice and a noise; the pieces share the other speech
    Piece piece{{request.voices[voice], request.speeds[speed], noises()[noise]},
                (speed + i / per_trial) % speeds,
                speeds,
                {},
                request.seed + i};
    for (std::size_t k = i; k < others.size(); k += total) piece.others.push_back(others[k]);
    return piece;
  };
  // a piece that was done before is read, not heard again
  const auto once = [&](int number, const Lane& lane) -> Result<Answers> {
    const Piece piece = piece_of(static_cast<std::size_t>(number));
    const std::filesystem::path folder =
        std::filesystem::path(request.out) / "pieces" / fmt::format("{:04}", number);
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    std::string asked = fmt::format("{} {} {} {} {} {}\n{}\n{}\n{}\n{}\n", piece.conditions.voice,
                                    piece.conditions.speed, piece.conditions.noise.name, piece.first,
                                    piece.step, piece.seed, request.phrases, request.settings.acoustic_model,
                                    request.settings.adaptation, fmt::join(request.names, ","));
    for (const OtherSpeech& other : piece.others)
      asked += fmt::format("{} {} {}\n", other.kind, other.seed, other.text);
    const std::string file = (folder / "answers.tsv").string();
    if (was_done(folder.string(), asked)) return load_answers(file);
    auto answers = run_piece(*book, request.settings, piece, request.names, lane.interrupt);
    if (!answers) return answers.error();
    if (const Status saved = save_answers(file, *answers); !saved) return saved.error();
    if (const Status marked = mark_done(folder.string(), asked); !marked) return marked.error();
    return answers;
  };

  Pieces pieces{"speech", request.out, static_cast<int>(total), request.jobs};
  pieces.total = static_cast<long>(total);
  pieces.forget_earlier = request.fresh;
  std::map<int, Answers> done;  // as of the last report
  const Status ended = run_pieces<Answers>(pieces, once, [&](const std::map<int, Answers>& so_far) {
    done = so_far;
    return make_report(request, so_far);
  });
  if (done.empty()) return ended;
  const Status saved = save_all(request.out, done);
  return ended ? saved : ended;
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  request.jobs = 2;
  request.out = "out/speech";
  CLI::App app("Measures how well the phrases are understood, by voice and noise.", "nido-experiment-speech");
  app.footer("example\n  nido experiment run speech --out out/speech");
  nido::add_experiment_options(app, request);
  app.add_option("--phrases", request.phrases, "file of the phrases (default: the shipped one)");
  app.add_option("--speeds", request.speeds, "words a minute, separated by commas")->delimiter(',');
  app.add_option("--others", request.others, "utterances that are no phrases, a trial")
      ->check(CLI::Range(0, 100000));
  app.add_option("--names", request.names,
                 "names given while it runs, separated by commas: what is said about them, not the phrases")
      ->delimiter(',');
  app.add_flag("--tuning", request.tuning,
               "utterances with other words than the test's, to choose settings with");
  app.add_flag("--fresh", request.fresh, "do again what an interrupted run has done in the same folder");
  app.add_option("--model", request.settings.acoustic_model,
                 "folder of the acoustic model (default: the node's)");
  app.add_option("--adaptation", request.settings.adaptation,
                 "folder of what is adapted of it (default: the shipped one; none: nothing)");
  app.add_option("--voices", request.voices, "espeak-ng voices, separated by commas")->delimiter(',');
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  const auto places = nido::find_places();
  if (!places) return nido::end_experiment(places.error());
  if (request.phrases.empty()) request.phrases = (places->config / "phrases.yaml").string();
  if (request.settings.adaptation.empty()) {
    request.settings.adaptation = (places->config / "speech_model").string();
  } else if (request.settings.adaptation == "none") {
    request.settings.adaptation.clear();
  }
  return nido::end_experiment(nido::run(request));
}
