// nido-speech: hears the phrases of config/phrases.yaml. Ports: /speech/audio:i, /speech/heard:o.
// docs/speech.md

#include <fmt/format.h>

#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"
#include "nido/speech/speech_core.h"

namespace nido {
namespace {

// the node's parameters over the defaults; the first that is wrong is returned
Result<SpeechSettings> read_settings(Node& node) {
  SpeechSettings settings;
  settings.seed = node.options().seed;
  const auto model = node.parameter<std::string>("acoustic_model", settings.acoustic_model);
  if (!model) return model.error();
  settings.acoustic_model = *model;
  for (const auto& [key, value] : {std::pair{"end_silence_s", &settings.end_silence_s},
                                   {"shortest_s", &settings.shortest_s},
                                   {"longest_s", &settings.longest_s},
                                   {"noise_floor_db", &settings.noise_floor_db},
                                   {"lowest_confidence", &settings.lowest_confidence}}) {
    const auto read = node.parameter<double>(key, *value);
    if (!read) return read.error();
    *value = *read;
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

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto phrases = node.parameter<std::string>("phrases", (places->config / "phrases.yaml").string());
  if (!phrases) return phrases.error();
  const auto book = PhraseBook::load(*phrases);
  if (!book) return book.error();
  const auto settings = read_settings(node);
  if (!settings) return settings.error();
  const auto core = SpeechCore::create(*book, *settings);
  if (!core) return core.error();

  // ten seconds of sound in blocks of 10 ms may wait
  const auto audio = node.open_input<msgs::Audio>("/speech/audio:i", Profile::kEvent, 1000);
  if (!audio) return audio.error();
  const auto heard = node.open_output<msgs::Heard>("/speech/heard:o", Profile::kEvent);
  if (!heard) return heard.error();
  node.set_ready();

  std::string last_refusal;
  return node.run([&](Time) -> Status {
    while (const auto message = (*audio)->take()) {
      AudioBlock block;
      block.start_s = message->header().stamp().sec() + 1e-9 * message->header().stamp().nanosec();
      block.sample_rate_hz = message->sample_rate_hz();
      block.channels = message->channels();
      block.samples = message->samples();
      const auto phrases_heard = (*core)->feed(block);
      if (!phrases_heard) {
        // the same trouble a hundred times a second is one line
        if (phrases_heard.error().message != last_refusal) {
          last_refusal = phrases_heard.error().message;
          node.log_warning("sound is not understood: " + last_refusal);
        }
        continue;
      }
      for (const HeardPhrase& phrase : *phrases_heard) {
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
