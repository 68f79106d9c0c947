#include "doing.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "nido/speech/phrases.h"

namespace nido::vision {
namespace {

namespace fs = std::filesystem;

constexpr int kPresentations = 3;          // at most
constexpr const char* kShownAfter = "@6";  // the order, after the naming; s

// as in config/worlds/teaching.yaml
const std::array<std::pair<const char*, const char*>, 6> kColours = {{{"purple", "[0.50, 0.15, 0.75]"},
                                                                      {"amber", "[0.95, 0.40, 0.05]"},
                                                                      {"teal", "[0.05, 0.60, 0.45]"},
                                                                      {"lime", "[0.50, 0.80, 0.10]"},
                                                                      {"rose", "[0.90, 0.25, 0.50]"},
                                                                      {"golden", "[0.90, 0.80, 0.10]"}}};
const std::array<const char*, 3> kObjects = {"ball", "cube", "cylinder"};
const std::array<const char*, 12> kNames = {"banana", "bottle", "apple",  "hammer", "candle", "guitar",
                                            "lemon",  "pencil", "button", "rabbit", "tiger",  "flower"};
const std::array<const char*, 3> kOrders = {"reach {}", "grasp {}", "drop {} into basket"};
const std::array<const char*, 4> kVoices = {"en-us", "en-us+f3", "en-gb", "en-us+m3"};

// A table with a basket, three things that the robot knows, and the one to be taught.
Status write_world(const TaughtDeed& deed, double x_m, double y_m, const fs::path& path) {
  std::string colour;
  for (const auto& [name, rgb] : kColours) {
    if (deed.colour == name) colour = rgb;
  }
  std::ofstream file(path);
  file << "table: {top_center_m: [-0.40, 0.0, -0.0826], size_m: [0.40, 0.70]}\n"
          "posture_deg:\n"
          "  left_arm: [0, 80, 5, 65, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10]\n"
          "  right_arm: [0, 80, 5, 65, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10]\n"
          "objects:\n"
          "  - {object: basket, name: basket, position_m: [-0.32, 0.25]}\n"
          "  - {object: ball, name: red ball, colour: red, position_m: [-0.30, -0.12]}\n"
          "  - {object: cube, name: green cube, colour: green, position_m: [-0.46, -0.08], yaw_deg: -10}\n"
          "  - {object: ball, name: blue ball, colour: blue, position_m: [-0.48, 0.06]}\n";
  file << fmt::format(
      "  - {{object: {}, name: {}, colour: {}, position_m: [{:.4f}, {:.4f}], yaw_deg: {:.1f}}}\n",
      deed.object, deed.name, colour, x_m, y_m, deed.yaw_deg);
  return file.flush() ? Status{} : Status{Error{ErrorCode::kFailed, path.string() + ": cannot be written"}};
}

// One run of the app; its report.
Result<nlohmann::json> run_robot(const std::string& said, std::size_t voice, const fs::path& world,
                                 const fs::path& knowledge, std::uint64_t seed, const fs::path& folder,
                                 std::vector<std::string> more, const Lane& lane) {
  std::vector<std::string> arguments =
      in_lockstep(seed, {"--world", world, "--say", said, "--voice", kVoices[voice % kVoices.size()], "--set",
                         "vision.taught=" + (knowledge / "taught.yaml").string(), "--set",
                         "speech.names_file=" + (knowledge / "names.txt").string(), "--set",
                         "goal_selection.lessons=" + (knowledge / "lessons.txt").string()});
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Status ran = run_app_once({"speech_and_action", arguments, folder.string(), "report.json"}, lane);
  if (!ran) return ran.error();
  const fs::path path = folder / "run" / "report.json";
  std::ifstream file(path);
  auto report = nlohmann::json::parse(file, nullptr, false);
  if (!report.is_object() || !report.contains("outcome"))
    return Error{ErrorCode::kFailed, path.string() + ": no outcome"};
  return report["outcome"];
}

}  // namespace

TaughtDeed draw_deed(std::uint64_t seed, int number) {
  std::seed_seq mix{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                    static_cast<std::uint32_t>(number), 21U};
  std::mt19937_64 random(mix);
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto one_of = [&random](const auto& list) { return list[random() % list.size()]; };
  TaughtDeed deed;
  deed.object = one_of(kObjects);
  deed.colour = one_of(kColours).first;
  deed.name = one_of(kNames);
  deed.order =
      fmt::format(fmt::runtime(kOrders[static_cast<std::size_t>(number) % kOrders.size()]), deed.name);
  deed.voice = random() % kVoices.size();
  deed.x_m = between(-0.325, -0.295);  // in the middle of what the resting robot looks at
  deed.y_m = between(0.06, 0.09);
  deed.test_x_m = between(-0.37, -0.27);
  deed.test_y_m = between(0.0, 0.11);
  deed.yaw_deg = between(-180.0, 180.0);
  return deed;
}

Result<nlohmann::json> teach_deed(const TaughtDeed& deed, std::uint64_t seed, const std::string& folder,
                                  const Lane& lane) {
  const fs::path here = fs::absolute(folder);
  std::error_code failure;
  fs::create_directories(here, failure);
  const fs::path shown = here / "shown.yaml";
  const fs::path test = here / "test.yaml";
  if (Status s = write_world(deed, deed.x_m, deed.y_m, shown); !s) return s.error();
  if (Status s = write_world(deed, deed.test_x_m, deed.test_y_m, test); !s) return s.error();
  nlohmann::json row = {{"thing", deed.colour + " " + deed.object},
                        {"name", deed.name},
                        {"order", deed.order},
                        {"presentations", 0},
                        {"learned", false},
                        {"said", 0},
                        {"done_right", false},
                        {"sentence", "it was not learned"}};
  fs::path knowledge;
  for (int number = 1; number <= kPresentations && !row["learned"].get<bool>(); ++number) {
    const fs::path lesson = here / fmt::format("lesson-{}", number);
    knowledge = lesson / "run";
    const auto outcome = run_robot(fmt::format("{}{}; {} {}", kNaming, deed.name, kShownAfter, deed.order),
                                   deed.voice + static_cast<std::size_t>(number), shown, knowledge,
                                   seed + static_cast<std::uint64_t>(number), lesson,
                                   {"--set", fmt::format("speech.names=[{}]", deed.name)}, lane);
    if (!outcome) return outcome.error();
    row["presentations"] = number;
    row["learned"] = fs::exists(knowledge / "taught.yaml") && fs::exists(knowledge / "lessons.txt");
  }
  if (!row["learned"].get<bool>()) return row;
  for (int number = 1; number <= kPresentations; ++number) {
    const auto outcome = run_robot(deed.name, deed.voice + static_cast<std::size_t>(number), test, knowledge,
                                   seed, here / fmt::format("test-{}", number),
                                   {"--set", fmt::format("judge.lessons=[{}]", deed.order)}, lane);
    if (!outcome) return outcome.error();
    row["said"] = number;
    row["done_right"] = outcome->value("success", false);
    row["sentence"] = outcome->value("sentence", "");
    if (!outcome->value("heard", "").empty()) break;
  }
  return row;
}

}  // namespace nido::vision
