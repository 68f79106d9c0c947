// nido-speech: hears the phrases of config/phrases.yaml and, if asked to, says what the robot does. Ports:
// /speech/audio:i, /speech/heard:o, /speech/rpc:i, /speech/stage:i, /speech/voice:o. docs/speech.md

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <mutex>

#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "nido/speech/speech_core.h"
#include "nido/speech/voice.h"

namespace nido {
namespace {

// the node's parameters over the defaults; the first that is wrong is returned
Result<SpeechSettings> read_settings(Node& node, const std::string& adaptation) {
  SpeechSettings settings;
  const auto adapted = node.parameter<std::string>("adaptation", adaptation);
  if (!adapted) return adapted.error();
  settings.adaptation = *adapted;
  settings.seed = node.options().seed;
  const auto model = node.parameter<std::string>("acoustic_model", settings.acoustic_model);
  if (!model) return model.error();
  settings.acoustic_model = *model;
  const auto dictionary = node.parameter<std::string>("dictionary", settings.dictionary);
  if (!dictionary) return dictionary.error();
  settings.dictionary = *dictionary;
  struct Number {
    const char* key;
    double* value;
    ParameterAbout about;
  };
  for (const Number& number :
       {Number{
            "end_silence_s", &settings.end_silence_s, {"silence that ends an utterance", "s", 0.05, 5, {}}},
        {"shortest_s", &settings.shortest_s, {"a shorter sound is a click", "s", 0, 5, {}}},
        {"longest_s", &settings.longest_s, {"longer speech is cut and rejected", "s", 0.5, 60, {}}},
        {"noise_floor_db", &settings.noise_floor_db, {"what is quieter is silence", "dB", -100, 0, {}}},
        {"lowest_confidence",
         &settings.lowest_confidence,
         {"what is less sure is rejected", "", 0, 1, {}}}}) {
    const auto read = node.parameter<double>(number.key, *number.value, number.about);
    if (!read) return read.error();
    *number.value = *read;
  }
  return settings;
}

msgs::Heard to_message(const HeardPhrase& heard) {
  const Time end = Time::from_seconds(heard.end_s);
  msgs::Heard message;
  message.header().stamp().sec(static_cast<std::int32_t>(end.ns / 1'000'000'000));
  message.header().stamp().nanosec(static_cast<std::uint32_t>(end.ns % 1'000'000'000));
  message.text(heard.text);
  message.confidence(heard.confidence);
  message.accepted(heard.accepted);
  message.reason(heard.reason);
  return message;
}

// Says aloud what the robot tells of its work.
class Teller {
 public:
  static Result<std::unique_ptr<Teller>> create(Node& node) {
    std::unique_ptr<Teller> teller(new Teller);
    const auto aloud = node.live_parameter<bool>("aloud", false, {.about = "says what the robot does"});
    if (!aloud) return aloud.error();
    teller->aloud_ = *aloud;
    const auto voice = node.parameter<std::string>("voice", teller->voice_.name);
    if (!voice) return voice.error();
    teller->voice_.name = *voice;
    auto stages = node.open_input<msgs::StageEvent>("/speech/stage:i", Profile::kEvent, 100);
    if (!stages) return stages.error();
    teller->stages_ = std::move(*stages);
    auto sound = node.open_output<msgs::Audio>("/speech/voice:o", Profile::kEvent);
    if (!sound) return sound.error();
    teller->sound_ = std::move(*sound);
    return teller;
  }

  Status tell(Node& node) {
    while (const auto event = stages_->take()) {
      if (is_mute_ || !aloud_->get() || event->text().empty()) continue;
      auto samples = speak(event->text(), voice_, 0.0, 0.2);
      if (!samples) {
        node.log_warning("cannot speak: " + samples.error().message);
        is_mute_ = true;
        return {};
      }
      msgs::Audio message;
      message.header(event->header());
      message.sample_rate_hz(kSpeechRate_hz);
      message.channels(1);
      message.samples(std::move(*samples));
      if (const Status written = sound_->write(message); !written) return written;
    }
    return {};
  }

 private:
  std::shared_ptr<const LiveParameter<bool>> aloud_;
  bool is_mute_ = false;  // it has no voice
  Voice voice_;
  std::unique_ptr<Input<msgs::StageEvent>> stages_;
  std::unique_ptr<Output<msgs::Audio>> sound_;
};

// A line each.
Status write_names(const std::string& file, const std::vector<std::string>& names) {
  std::ofstream stream(file);
  for (const std::string& name : names) stream << name << '\n';
  stream.close();
  return stream ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + file}};
}

// Answers lines of text about the phrases. The service has a thread of its own; the book is changed between
// two ticks.
class Rpc {
 public:
  // `names_file`: keeps the names; empty: they are forgotten at the end
  Rpc(std::string file, std::string names_file, PhraseBook book)
      : file_(std::move(file)), names_file_(std::move(names_file)), book_(std::move(book)) {}

  Result<std::string> answer(const std::string& line, SpeechCore& core) {
    const std::lock_guard lock(mutex_);
    const auto words = split_words(line);
    const std::string verb = words.empty() ? "" : words[0];
    if (verb == "help") return std::string("list | add VERB COLOUR SHAPE TEXT... | name WORD... | reload");
    if (verb == "list") return fmt::format("{}", fmt::join(book_.texts(), "\n"));
    PhraseBook book = book_;
    if (verb == "reload") {
      auto read = PhraseBook::load(file_);
      if (!read) return read.error();
      book = std::move(read).value();
      for (const std::string& name : book_.names) {
        if (const Status added = core.add_name(name, book); !added) return added.error();
      }
    } else if (verb == "add") {
      if (const Status added = add(words, core, book); !added) return added.error();
    } else if (verb == "name") {
      const std::string name = fmt::format("{}", fmt::join(words.begin() + 1, words.end(), " "));
      if (const Status added = core.add_name(name, book); !added) return added.error();
    } else {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format(
              "'{}' is unknown; allowed are list, add VERB COLOUR SHAPE TEXT..., name WORD..., reload, help",
              verb)};
    }
    if (const Status taken = core.set_book(book); !taken) return taken.error();
    book_ = std::move(book);
    if (verb == "name" && !names_file_.empty()) {
      if (const Status kept = write_names(names_file_, book_.names); !kept) return kept.error();
    }
    return verb == "name" ? fmt::format("ok, {} names", book_.names.size())
                          : fmt::format("ok, {} phrases", book_.phrases.size());
  }
  // The first phrase that asks for the same as this one: those who act know the phrases of the file only.
  [[nodiscard]] std::string as_in_the_file(const std::string& text) const {
    const auto index = book_.find(text);
    if (!index) return text;
    const Phrase& phrase = book_.phrases[*index];
    const auto first = std::find_if(book_.phrases.begin(), book_.phrases.end(), [&](const Phrase& other) {
      return other.verb == phrase.verb && other.object_index == phrase.object_index;
    });
    return first->text;
  }
  // Held while sound is listened to.
  std::mutex& mutex() { return mutex_; }

 private:
  static Status add(const std::vector<std::string>& words, const SpeechCore& core, PhraseBook& book) {
    const auto verb = words.size() > 4 ? verb_of(words[1]) : std::nullopt;
    if (!verb) {
      return Error{
          ErrorCode::kInvalidArgument,
          "expected add VERB COLOUR SHAPE TEXT..., with a VERB of look, reach, grasp, drop; for instance "
          "add grasp yellow cube grasp yellow cube"};
    }
    const NamedObject object{words[2] + " " + words[3], words[2], words[3]};
    std::vector<std::string> unknown;
    for (std::size_t i = 4; i < words.size(); ++i) {
      if (!book.pronunciations.contains(words[i])) unknown.push_back(words[i]);
    }
    const auto sounds = core.pronunciations(unknown);
    if (!sounds) return sounds.error();
    book.pronunciations.insert(sounds->begin(), sounds->end());
    return book.add(fmt::format("{}", fmt::join(words.begin() + 4, words.end(), " ")), *verb, object);
  }

  const std::string file_;
  const std::string names_file_;
  PhraseBook book_;
  std::mutex mutex_;
};

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto phrases = node.parameter<std::string>("phrases", (places->config / "phrases.yaml").string());
  if (!phrases) return phrases.error();
  auto book = PhraseBook::load(*phrases);
  if (!book) return book.error();
  const auto settings = read_settings(node, (places->config / "speech_model").string());
  if (!settings) return settings.error();
  const auto core = SpeechCore::create(*book, *settings);
  if (!core) return core.error();

  auto names = node.parameter<std::vector<std::string>>("names", {});
  if (!names) return names.error();
  const auto names_file = node.parameter<std::string>(
      "names_file", "", {.about = "file that keeps all names that are given; empty: they are forgotten"});
  if (!names_file) return names_file.error();
  std::ifstream given(*names_file);
  for (std::string name; std::getline(given, name);) {
    if (std::find(names->begin(), names->end(), name) == names->end()) names->push_back(name);
  }
  for (const std::string& name : *names) {
    if (const Status added = (*core)->add_name(name, *book); !added) return added;
  }
  if (!names_file->empty()) {
    if (const Status kept = write_names(*names_file, *names); !kept) return kept;
  }
  const auto corrections =
      node.parameter<bool>("corrections", false, {.about = "\"a bit left\" and the like are understood"});
  if (!corrections) return corrections.error();
  if (*corrections) {
    std::vector<std::string> unknown;
    for (const char* const direction : kDirections) {
      for (const std::string& word : split_words(std::string(kCorrection) + direction)) {
        if (!book->pronunciations.contains(word)) unknown.push_back(word);
      }
    }
    const auto sounds = (*core)->pronunciations(unknown);
    if (!sounds) return sounds.error();
    book->pronunciations.insert(sounds->begin(), sounds->end());
    book->corrections = true;
  }
  if (!names->empty() || *corrections) {
    if (const Status taken = (*core)->set_book(*book); !taken) return taken;
  }

  // ten seconds of sound in blocks of 10 ms may wait
  const auto audio = node.open_input<msgs::Audio>("/speech/audio:i", Profile::kEvent, 1000);
  if (!audio) return audio.error();
  const auto heard = node.open_output<msgs::Heard>("/speech/heard:o", Profile::kEvent);
  if (!heard) return heard.error();
  const auto teller = Teller::create(node);
  if (!teller) return teller.error();
  Rpc rpc(*phrases, *names_file, *book);
  const auto service = node.open_service("/speech/rpc:i", [&](const std::string& line) {
    const auto answer = rpc.answer(line, **core);
    return answer ? *answer : "error: " + answer.error().message;
  });
  if (!service) return service.error();
  node.set_ready();

  std::string last_refusal;
  return node.run([&](Time) -> Status {
    if (const Status told = (*teller)->tell(node); !told) return told;
    const std::lock_guard lock(rpc.mutex());
    while (const auto message = (*audio)->take()) {
      AudioBlock block;
      block.start_s = message->header().stamp().sec() + 1e-9 * message->header().stamp().nanosec();
      block.sample_rate_hz = message->sample_rate_hz();
      block.channels = message->channels();
      block.samples = message->samples();
      auto phrases_heard = (*core)->feed(block);
      if (!phrases_heard) {
        // the same trouble a hundred times a second is one line
        if (phrases_heard.error().message != last_refusal) {
          last_refusal = phrases_heard.error().message;
          node.log_warning("sound is not understood: " + last_refusal);
        }
        continue;
      }
      for (HeardPhrase& phrase : *phrases_heard) {
        phrase.text = rpc.as_in_the_file(phrase.text);
        if (const Status written = (*heard)->write(to_message(phrase)); !written) return written;
        node.log_debug(phrase.accepted ? "heard \"" + phrase.text + "\"" : phrase.reason);
      }
    }
    return {};
  });
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) { return nido::node_main(argc, argv, "speech", nido::run); }
