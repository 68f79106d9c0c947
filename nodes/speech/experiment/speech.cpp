// nido-experiment-speech: how many of the phrases are understood, by voice and noise; how often other speech
// is taken for a phrase; how late the answer comes.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
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

// What came of one voice at one speed in one noise.
struct Cell {
  int said = 0;
  int right = 0;
  int wrong = 0;  // another phrase was heard
  int missed = 0;
  std::map<std::string, std::pair<int, int>> others;  // by kind: said, taken for a phrase
  std::vector<double> latency_s;                      // end of the speech to the answer, work included
  std::vector<double> end_pointing_s;                 // the same without the time that the work took
  double sound_s = 0.0;
  double work_s = 0.0;                // wall time
  std::vector<std::string> mistakes;  // a line each
  std::vector<std::string> answers;   // a line each: what was said, what fitted, how well
};

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

void note(Cell& cell, const Conditions& conditions, const std::string& kind, const std::string& text,
          const Answer& answer) {
  for (const HeardPhrase& heard : answer.heard) {
    cell.answers.push_back(fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{:.3f}\t{:.1f}", conditions.voice,
                                       conditions.speed, conditions.noise.name, kind, text, heard.nearest,
                                       heard.accepted ? 1 : 0, heard.misfit, heard.loudness_db));
  }
}

// Every `step`-th phrase from `first` on, and some other speech.
Result<Cell> run_cell(const PhraseBook& book, SpeechSettings settings, const Conditions& conditions,
                      std::size_t first, std::size_t step, const std::vector<OtherSpeech>& others,
                      std::uint64_t seed, const InterruptFlag& interrupt) {
  constexpr double kSilenceAfter_s = 1.0;
  settings.seed = seed;
  auto core = SpeechCore::create(book, settings);
  if (!core) return core.error();
  Cell cell;
  double now_s = 0.0;
  std::uint64_t noise_seed = seed * 1000;
  const auto hear = [&](Result<std::vector<std::int16_t>> samples) -> Result<Answer> {
    if (!samples) return samples.error();
    if (const Noise& noise = conditions.noise; !noise.none)
      add_noise(*samples, noise.pink ? NoiseKind::kPink : NoiseKind::kWhite, noise.snr_db, ++noise_seed);
    cell.sound_s += static_cast<double>(samples->size()) / kSpeechRate_hz;
    auto answer = say(**core, now_s, std::move(samples).value(), kSilenceAfter_s);
    if (answer) cell.work_s += answer->work_s;
    return answer;
  };
  const Voice voice{conditions.voice, conditions.speed};
  for (std::size_t i = first; i < book.phrases.size() && !interrupt.raised(); i += step) {
    const Phrase& phrase = book.phrases[i];
    const auto answer = hear(speak(phrase.text, voice, 0.5, kSilenceAfter_s));
    if (!answer) return answer.error();
    ++cell.said;
    note(cell, conditions, "phrase", phrase.text, *answer);
    bool right = false;
    bool wrong = false;
    for (const HeardPhrase& heard : answer->heard) {
      right = right || heard.text == phrase.text;
      wrong = wrong || (heard.accepted && heard.text != phrase.text);
    }
    right = right && !wrong;
    cell.right += right ? 1 : 0;
    cell.wrong += wrong ? 1 : 0;
    cell.missed += !right && !wrong ? 1 : 0;
    if (!right) {
      std::string what;
      for (const HeardPhrase& heard : answer->heard) what += heard.accepted ? heard.text : heard.reason;
      cell.mistakes.push_back(fmt::format("{} {} {}: \"{}\": {}", conditions.voice, conditions.speed,
                                          conditions.noise.name, phrase.text,
                                          what.empty() ? "nothing" : what));
    }
    if (right) {
      cell.end_pointing_s.push_back(answer->end_pointing_s);
      cell.latency_s.push_back(answer->end_pointing_s + answer->decode_s);
    }
  }
  for (const OtherSpeech& other : others) {
    if (interrupt.raised()) return cell;
    const auto answer = hear(other.text.empty() ? make_sound(other.kind, other.seed, kSilenceAfter_s)
                                                : speak(other.text, voice, 0.5, kSilenceAfter_s));
    if (!answer) return answer.error();
    for (const HeardPhrase& heard : answer->heard) {
      if (!heard.accepted) continue;
      cell.mistakes.push_back(fmt::format("{} {} {}: {} \"{}\" was taken for \"{}\" (confidence {:.2f})",
                                          conditions.voice, conditions.speed, conditions.noise.name,
                                          other.kind, other.text, heard.text, heard.confidence));
    }
    note(cell, conditions, other.kind, other.text, *answer);
    auto& [said, taken] = cell.others[other.kind];
    ++said;
    taken += std::any_of(answer->heard.begin(), answer->heard.end(),
                         [](const HeardPhrase& heard) { return heard.accepted; })
                 ? 1
                 : 0;
  }
  return cell;
}

void add(Cell& sum, const Cell& cell) {
  sum.said += cell.said;
  sum.right += cell.right;
  sum.wrong += cell.wrong;
  sum.missed += cell.missed;
  for (const auto& [kind, counts] : cell.others) {
    sum.others[kind].first += counts.first;
    sum.others[kind].second += counts.second;
  }
  sum.latency_s.insert(sum.latency_s.end(), cell.latency_s.begin(), cell.latency_s.end());
  sum.end_pointing_s.insert(sum.end_pointing_s.end(), cell.end_pointing_s.begin(), cell.end_pointing_s.end());
  sum.mistakes.insert(sum.mistakes.end(), cell.mistakes.begin(), cell.mistakes.end());
  sum.answers.insert(sum.answers.end(), cell.answers.begin(), cell.answers.end());
  sum.sound_s += cell.sound_s;
  sum.work_s += cell.work_s;
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

using Cells = std::map<std::pair<std::size_t, std::size_t>, Cell>;  // voice, noise

Report make_report(const Request& request, const Cells& cells) {
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
  report.trials = request.trials;

  Cell all;
  std::map<std::size_t, Cell> by_voice;
  std::map<std::size_t, Cell> by_noise;
  std::map<std::string, Cell> by_level;
  for (const auto& [key, cell] : cells) {
    add(all, cell);
    add(by_voice[key.first], cell);
    add(by_noise[key.second], cell);
    const Noise& noise = noises()[key.second];
    add(by_level[noise.none ? "clean" : fmt::format("{:.0f}dB", noise.snr_db)], cell);
    report.trials_detail.push_back({{"voice", request.voices[key.first]},
                                    {"noise", noises()[key.second].name},
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
    report.add("sentence_error_rate." + request.voices[voice],
               proportion_metric(cell.said - cell.right, cell.said));
    voices.series[0].points.push_back({static_cast<double>(voices.bar_names.size()), rate(cell)});
    voices.bar_names.push_back(request.voices[voice]);
  }
  for (const auto& [noise, cell] : by_noise) {
    report.add("sentence_error_rate." + noises()[noise].name,
               proportion_metric(cell.said - cell.right, cell.said));
    report.add("false_accept_rate." + noises()[noise].name,
               proportion_metric(all_others(cell).second, all_others(cell).first));
    noise_plot.series[0].points.push_back({static_cast<double>(noise_plot.bar_names.size()), rate(cell)});
    noise_plot.bar_names.push_back(noises()[noise].name);
  }
  report.plots = {voices, noise_plot};
  return report;
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  const auto book = PhraseBook::load(request.phrases);
  if (!book) return book.error();

  const std::size_t speeds = request.speeds.size();
  const std::size_t per_trial = request.voices.size() * noises().size() * speeds;
  const std::size_t total = per_trial * static_cast<std::size_t>(request.trials);
  const auto others = other_speech(
      static_cast<std::size_t>(request.others) * static_cast<std::size_t>(request.trials), request.seed);
  Cells cells;
  Status failure;
  const InterruptFlag interrupt;
  {
    ProgressBar progress("speech", static_cast<long>(total));
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    long done = 0;
    const auto work = [&] {
      for (std::size_t i = next++; i < total && !interrupt.raised(); i = next++) {
        const std::size_t speed = i % speeds;
        const std::size_t noise = i / speeds % noises().size();
        const std::size_t voice = i / speeds / noises().size() % request.voices.size();
        // the speeds share the phrases of a voice and a noise; the cells share the other speech
        std::vector<OtherSpeech> own;
        for (std::size_t k = i; k < others.size(); k += total) own.push_back(others[k]);
        auto cell =
            run_cell(*book, request.settings, {request.voices[voice], request.speeds[speed], noises()[noise]},
                     (speed + i / per_trial) % speeds, speeds, own, request.seed + i, interrupt);
        const std::lock_guard lock(mutex);
        if (!cell) {
          if (failure.ok()) failure = cell.error();
          next = total;
          return;
        }
        add(cells[{voice, noise}], *cell);
        progress.update(++done, request.voices[voice] + " " + noises()[noise].name);
      }
    };
    std::vector<std::jthread> workers;
    for (int i = 0; i < request.jobs; ++i) workers.emplace_back(work);
  }
  if (!failure) return failure;
  Report report = make_report(request, cells);
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (const Status saved = save_and_print(report, request.out); !saved) return saved;
  // line by line what was not understood or taken for a phrase
  std::ofstream mistakes(std::filesystem::path(request.out) / "mistakes.txt");
  // and every answer: voice, speed, noise, kind, what was said, what fits best, accepted, misfit, loudness
  std::ofstream answers(std::filesystem::path(request.out) / "answers.tsv");
  for (const auto& [key, cell] : cells) {
    for (const std::string& line : cell.mistakes) mistakes << line << '\n';
    for (const std::string& line : cell.answers) answers << line << '\n';
  }
  if (interrupt.raised()) return Error{ErrorCode::kInterrupted, "interrupted: the report has what was done"};
  return {};
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
