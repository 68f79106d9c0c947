#include "src/settings.h"

#include <cmath>

#include "nido/launcher/paths.h"
#include "nido/launcher/schema.h"
#include "nido/speech/phrases.h"

namespace nido {
namespace {

const Schema& audio_schema() {
  static const Schema schema{
      "audio",
      "",
      {{.key = "source",
        .fallback = "silence",
        .meaning = "where the sound comes from",
        .allowed = {"wav", "synthesis", "microphone", "silence"}},
       {.key = "file", .fallback = "''", .meaning = "sound file of source wav"},
       {.key = "text", .fallback = "''", .meaning = "what is said, of source synthesis"},
       {.key = "voice", .fallback = "en-us", .meaning = "voice of espeak-ng"},
       {.key = "start_s",
        .kind = ValueKind::kNumber,
        .fallback = "1.0",
        .meaning = "when the sound begins, simulated time",
        .min = 0}}};
  return schema;
}

const Schema& settings_schema() {
  static const Schema schema{
      "nido-robot",
      "",
      {{.key = "robot_file", .required = true, .meaning = "robot file: a name in config/robots, or a path"},
       {.key = "world_file", .fallback = "''", .meaning = "world file: a name in config/worlds, or a path"},
       {.key = "target", .fallback = "''", .meaning = "object that a random world must have"},
       {.key = "said",
        .fallback = "''",
        .meaning = "sound file for what the robot says, made when it speaks"},
       {.key = "seed", .kind = ValueKind::kInteger, .meaning = "of random worlds and of noise", .min = 0},
       {.key = "rate",
        .kind = ValueKind::kNumberOrMax,
        .fallback = "1",
        .meaning = "simulated seconds per second; `nido clock rate` changes it later"},
       {.key = "paused",
        .kind = ValueKind::kFlag,
        .fallback = "false",
        .meaning = "time begins when `nido clock run` says so"},
       {.key = "window",
        .kind = ValueKind::kFlag,
        .fallback = "false",
        .meaning = "shows the simulated world on this computer's display"},
       {.key = "base",
        .fallback = "''",
        .meaning = "what holds the simulated robot's root; empty: as the robot file says",
        .allowed = {"", "fixed", "stand", "free"}},
       {.key = "start_from",
        .fallback = "''",
        .meaning = "snapshot of a simulated robot to go on from; empty: from the beginning"},
       {.key = "snapshot_file", .fallback = "''", .meaning = "where a snapshot is kept, at snapshot_at_s"},
       {.key = "snapshot_at_s",
        .kind = ValueKind::kInteger,
        .fallback = "10",
        .meaning = "simulated time of the snapshot: whole seconds, at which all ports begin a period",
        .min = 1,
        .max = 1000000},
       {.key = "lockstep",
        .kind = ValueKind::kAnyMap,
        .fallback = "{}",
        .meaning = "who the clock waits for"},
       {.key = "audio",
        .kind = ValueKind::kMap,
        .fallback = "{}",
        .meaning = "what the robot hears",
        .inner = &audio_schema()}}};
  return schema;
}

// Keys end in their unit.
std::string unit_of(const std::string& key) { return key.ends_with("_s") ? "s" : ""; }

void list_fields(Node& node, const Schema& schema, const std::string& group) {
  for (const Field& field : schema.fields) {
    const std::string key = group + field.key;
    ParameterAbout about{.about = field.meaning, .unit = unit_of(key), .choices = field.allowed};
    if (std::isfinite(field.min)) about.min = field.min;
    if (std::isfinite(field.max)) about.max = field.max;
    const YAML::Node fallback = YAML::Load(field.fallback);
    // what they give was checked before, and is the same
    switch (field.kind) {
      case ValueKind::kMap:
        list_fields(node, *field.inner, key + ".");
        break;
      case ValueKind::kAnyMap:
        (void)node.parameter<YAML::Node>(key, fallback, about);
        break;
      case ValueKind::kFlag:
        (void)node.parameter<bool>(key, fallback.as<bool>(), about);
        break;
      case ValueKind::kInteger:
        (void)node.parameter<std::int64_t>(
            key, fallback.as<std::int64_t>(static_cast<std::int64_t>(node.options().seed)), about);
        break;
      case ValueKind::kNumber:
        (void)node.parameter<double>(key, fallback.as<double>(), about);
        break;
      default:
        (void)node.parameter<std::string>(key, fallback.as<std::string>(""), about);
        break;
    }
  }
}

}  // namespace

void list_settings(Node& node) { list_fields(node, settings_schema(), ""); }

Result<RobotSettings> read_settings(const YAML::Node& parameters, std::uint64_t seed) {
  const YAML::Node given = parameters && parameters.IsMap() ? parameters : YAML::Node(YAML::NodeType::Map);
  const Result<YAML::Node> checked = check_document(given, settings_schema(), "parameters of nido-robot");
  if (!checked) return checked.error();
  const YAML::Node& values = *checked;
  const Result<Places> places = find_places();
  if (!places) return places.error();
  RobotSettings settings;
  const Result<std::filesystem::path> robot =
      find_config(*places, "robots", "robot", values["robot_file"].as<std::string>());
  if (!robot) return robot.error();
  settings.robot_file = *robot;
  if (const auto world = values["world_file"].as<std::string>(); !world.empty()) {
    const Result<std::filesystem::path> found = find_config(*places, "worlds", "world", world);
    if (!found) return found.error();
    settings.run.world_file = *found;
  }
  settings.run.target = values["target"].as<std::string>();
  settings.run.seed = values["seed"] ? values["seed"].as<std::uint64_t>() : seed;
  if (const auto rate = values["rate"].as<std::string>(); rate != "max")
    settings.rate = values["rate"].as<double>();
  settings.is_paused = values["paused"].as<bool>();
  settings.start_from = values["start_from"].as<std::string>();
  settings.run.goes_on = !settings.start_from.empty();
  settings.snapshot_file = values["snapshot_file"].as<std::string>();
  settings.snapshot_at_s = values["snapshot_at_s"].as<std::int64_t>();
  settings.run.base = values["base"].as<std::string>();
  settings.window = values["window"].as<bool>();
  const YAML::Node audio = values["audio"];
  settings.run.audio = {audio["source"].as<std::string>(), audio["file"].as<std::string>(),
                        audio["text"].as<std::string>(), audio["voice"].as<std::string>(),
                        audio["start_s"].as<double>()};
  settings.run.said = values["said"].as<std::string>();
  // a random table has what the phrase that will be said speaks of
  const auto book = PhraseBook::load((places->config / "phrases.yaml").string());
  if (settings.run.target.empty() && audio["source"].as<std::string>() == "synthesis" && book) {
    const auto orders = split_orders(audio["text"].as<std::string>());
    if (const auto phrase = orders.empty() ? std::nullopt : book->find(orders.front().text)) {
      settings.run.target = book->object_of(book->phrases[*phrase]).name;
    }
  }
  return settings;
}

}  // namespace nido
