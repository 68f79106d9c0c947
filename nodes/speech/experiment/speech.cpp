// nido-experiment-speech: how many of the phrases are understood, by voice and noise; how often other speech
// is taken for a phrase; how late the answer comes.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"
#include "nido/speech/speech_core.h"
#include "nido/speech/voice.h"

namespace nido {
namespace {

struct Request : ExperimentRequest {
  std::string phrases;
  std::vector<std::string> voices = {"en-us", "en-us+f3", "en-us+f5", "en-us+m3", "en-gb", "en-gb-scotland"};
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

// sentences that are no phrases: the robot must stay idle
const std::vector<std::string>& other_sentences() {
  static const std::vector<std::string> list = {"hello robot how are you",
                                                "one two three four five",
                                                "seven eight nine",
                                                "the weather is nice today",
                                                "please open the door",
                                                "where is my coffee",
                                                "put the cube on the table",
                                                "reach for the stars",
                                                "grasp the red apple",
                                                "i would like a cup of tea",
                                                "yellow cube",
                                                "drop blue cube into the water",
                                                "what time is it",
                                                "go forward ten meters",
                                                "my brother plays the guitar",
                                                "turn the light off",
                                                "she will come back tomorrow",
                                                "this is a test of the microphone"};
  return list;
}

void add_noise(std::vector<std::int16_t>& samples, const Noise& noise, std::uint64_t seed) {
  if (noise.none) return;
  // power of the speech alone: where it is louder than a hundredth of the peak
  int peak = 1;
  for (const auto sample : samples) peak = std::max(peak, std::abs(static_cast<int>(sample)));
  double power = 0.0;
  double count = 0.0;
  for (const auto sample : samples) {
    if (std::abs(static_cast<int>(sample)) * 100 > peak) {
      power += static_cast<double>(sample) * sample;
      count += 1.0;
    }
  }
  std::mt19937_64 generator(seed);
  std::vector<double> sound(samples.size());
  double b0 = 0.0;
  double b1 = 0.0;
  double b2 = 0.0;
  double noise_power = 0.0;
  for (double& value : sound) {
    const double white = static_cast<double>(generator() >> 11U) * 0x1p-53 - 0.5;
    // pink by three one-pole filters
    b0 = 0.99765 * b0 + white * 0.0990460;
    b1 = 0.96300 * b1 + white * 0.2965164;
    b2 = 0.57000 * b2 + white * 1.0526913;
    value = noise.pink ? b0 + b1 + b2 + white * 0.1848 : white;
    noise_power += value * value;
  }
  noise_power /= static_cast<double>(sound.size());
  const double gain =
      std::sqrt(power / std::max(1.0, count) / noise_power * std::pow(10.0, -noise.snr_db / 10.0));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] =
        static_cast<std::int16_t>(std::clamp(std::lround(samples[i] + gain * sound[i]), -32768L, 32767L));
  }
}

// What came of one voice in one noise.
struct Cell {
  int said = 0;
  int right = 0;
  int wrong = 0;  // another phrase was heard
  int missed = 0;
  int others = 0;
  int false_accepts = 0;
  std::vector<double> latency_s;  // end of the speech to the answer
};

// speaks a sentence in blocks of 20 ms, as a microphone gives them
struct Answer {
  std::vector<HeardPhrase> heard;
  double latency_s = 0.0;
};
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
    auto heard = core.feed(block);
    if (!heard) return heard.error();
    for (auto& phrase : *heard) {
      answer.heard.push_back(std::move(phrase));
      answer.latency_s = now_s - end_s;
    }
  }
  return answer;
}

Result<Cell> run_cell(const PhraseBook& book, const std::string& voice, const Noise& noise,
                      std::uint64_t seed, const InterruptFlag& interrupt) {
  constexpr double kSilenceAfter_s = 1.0;
  SpeechSettings settings;
  settings.seed = seed;
  auto core = SpeechCore::create(book, settings);
  if (!core) return core.error();
  Cell cell;
  double now_s = 0.0;
  std::uint64_t noise_seed = seed * 1000;
  const auto hear = [&](const std::string& sentence) -> Result<Answer> {
    auto samples = speak(sentence, Voice{voice}, 0.5, kSilenceAfter_s);
    if (!samples) return samples.error();
    add_noise(*samples, noise, ++noise_seed);
    return say(**core, now_s, std::move(samples).value(), kSilenceAfter_s);
  };
  for (const Phrase& phrase : book.phrases) {
    if (interrupt.raised()) return cell;
    const auto answer = hear(phrase.text);
    if (!answer) return answer.error();
    ++cell.said;
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
    if (right) cell.latency_s.push_back(answer->latency_s);
  }
  for (const std::string& sentence : other_sentences()) {
    if (interrupt.raised()) return cell;
    const auto answer = hear(sentence);
    if (!answer) return answer.error();
    ++cell.others;
    cell.false_accepts += std::any_of(answer->heard.begin(), answer->heard.end(),
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
  sum.others += cell.others;
  sum.false_accepts += cell.false_accepts;
  sum.latency_s.insert(sum.latency_s.end(), cell.latency_s.begin(), cell.latency_s.end());
}

using Cells = std::map<std::pair<std::size_t, std::size_t>, Cell>;  // voice, noise

Report make_report(const Request& request, const Cells& cells) {
  Report report;
  report.name = "speech";
  report.title = "Understanding the phrases by voice and noise";
  report.summary =
      "Every phrase of Table IV and a number of other sentences are spoken by synthetic voices, with noise "
      "mixed in at a "
      "ratio to the speech (pink10: pink noise 10 dB below). An error is a phrase that was missed or taken "
      "for another; "
      "a false accept is another sentence that was taken for a phrase.";
  report.command =
      fmt::format("nido experiment run speech --seed {} --trials {}", request.seed, request.trials);
  report.seed = request.seed;
  report.trials = request.trials;

  Cell all;
  std::map<std::size_t, Cell> by_voice;
  std::map<std::size_t, Cell> by_noise;
  for (const auto& [key, cell] : cells) {
    add(all, cell);
    add(by_voice[key.first], cell);
    add(by_noise[key.second], cell);
    report.trials_detail.push_back({{"voice", request.voices[key.first]},
                                    {"noise", noises()[key.second].name},
                                    {"said", static_cast<double>(cell.said)},
                                    {"right", static_cast<double>(cell.right)},
                                    {"wrong phrase", static_cast<double>(cell.wrong)},
                                    {"missed", static_cast<double>(cell.missed)},
                                    {"other sentences", static_cast<double>(cell.others)},
                                    {"false accepts", static_cast<double>(cell.false_accepts)}});
  }
  report.add("sentence_error_rate", proportion_metric(all.said - all.right, all.said));
  report.add("wrong_phrase_rate", proportion_metric(all.wrong, all.said));
  report.add("false_accept_rate", proportion_metric(all.false_accepts, all.others));
  report.add("latency_s", median_metric(all.latency_s, "s"));
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
               proportion_metric(cell.false_accepts, cell.others));
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

  const std::size_t per_trial = request.voices.size() * noises().size();
  const std::size_t total = per_trial * static_cast<std::size_t>(request.trials);
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
        const std::size_t voice = i % per_trial / noises().size();
        const std::size_t noise = i % noises().size();
        auto cell = run_cell(*book, request.voices[voice], noises()[noise], request.seed + i, interrupt);
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
  if (const Status saved = report.save(request.out); !saved) return saved;
  for (const auto& [name, metric] : report.metrics)
    fmt::print("{:<40} {:.4f} {}\n", name, metric.value, metric.unit);
  fmt::print("{}/report.html\n", request.out);
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
  app.add_option("--voices", request.voices, "espeak-ng voices, separated by commas")->delimiter(',');
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  if (request.phrases.empty()) {
    const auto places = nido::find_places();
    if (!places) return nido::end_experiment(places.error());
    request.phrases = (places->config / "phrases.yaml").string();
  }
  return nido::end_experiment(nido::run(request));
}
