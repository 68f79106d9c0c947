#include "answers.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

namespace nido {

namespace {

// Calls `text(name, string)` and `number(name, double)` for every column, in their order: written and read by
// the same list.
template <class Answer, class Text, class Number>
void columns(Answer& a, const Text& text, const Number& number) {
  text("voice", a.voice);
  number("speed", a.speed);
  text("noise", a.noise);
  text("kind", a.kind);
  text("text", a.text);
  text("outcome", a.outcome);
  text("nearest", a.answer.nearest);
  number("confidence", a.answer.confidence);
  number("misfit", a.answer.misfit);
  number("loudness_db", a.answer.loudness_db);
  auto& sounds = *a.answer.sounds;
  number("worst_sound", sounds.worst_sound);
  number("second_worst", sounds.second_worst);
  number("mean_sound", sounds.mean_sound);
  number("worst_word", sounds.worst_word);
  number("gap", sounds.gap);
  number("unexplained", sounds.unexplained);
  number("end_pointing_s", a.end_pointing_s);
  number("decode_s", a.decode_s);
  number("sound_s", a.sound_s);
  number("work_s", a.work_s);
  text("heard", a.heard);
}

std::string names() {
  SpeechAnswer empty;
  empty.answer.sounds.emplace();
  std::string line;
  const auto add = [&](const char* name, const auto&) {
    line += (line.empty() ? "" : "\t") + std::string(name);
  };
  columns(empty, add, add);
  return line;
}

}  // namespace

Status save_answers(const std::string& path, const std::vector<SpeechAnswer>& answers) {
  std::ofstream file(path);
  file << names() << '\n';
  for (SpeechAnswer answer : answers) {
    if (!answer.answer.sounds) answer.answer.sounds.emplace();
    std::string line;
    const auto separate = [&] { return line.empty() ? "" : "\t"; };
    columns(
        answer, [&](const char*, const std::string& value) { line += separate() + value; },
        [&](const char*, double value) { line += fmt::format("{}{:.6g}", separate(), value); });
    file << line << '\n';
  }
  if (!file.flush()) return Error{ErrorCode::kFailed, fmt::format("cannot write {}", path)};
  return {};
}

Result<std::vector<SpeechAnswer>> load_answers(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kNotFound, fmt::format("{}: there is no such file", path)};
  std::vector<SpeechAnswer> answers;
  std::string line;
  std::getline(file, line);
  if (line != names()) return Error{ErrorCode::kInvalidArgument, fmt::format("{}:1: other columns", path)};
  while (std::getline(file, line)) {
    SpeechAnswer answer;
    answer.answer.sounds.emplace();
    std::size_t at = 0;
    bool broken = false;
    const auto next = [&]() -> std::string {
      if (at > line.size()) {
        broken = true;
        return {};
      }
      const std::size_t end = std::min(line.find('\t', at), line.size());
      std::string value = line.substr(at, end - at);
      at = end + 1;
      return value;
    };
    columns(
        answer, [&](const char*, std::string& value) { value = next(); },
        [&](const char*, auto& value) {
          const std::string text = next();
          char* end = nullptr;
          const double number = std::strtod(text.c_str(), &end);
          if (text.empty() || *end != '\0') broken = true;
          value = static_cast<std::decay_t<decltype(value)>>(number);
        });
    if (broken || at <= line.size()) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}:{}: not an answer", path, answers.size() + 2)};
    }
    answers.push_back(std::move(answer));
  }
  return answers;
}

}  // namespace nido
