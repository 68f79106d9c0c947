#include "nido/launcher/schema.h"

#include <gtest/gtest.h>

#include "nido/launcher/suggest.h"
#include "temp_folder.h"

namespace nido {
namespace {

const Schema& leg_schema() {
  static const Schema schema{"leg",
                             "name",
                             {{.key = "name", .required = true, .meaning = "name"},
                              {.key = "length_m",
                               .kind = ValueKind::kNumber,
                               .fallback = "0.5",
                               .meaning = "length",
                               .min = 0,
                               .max = 2}}};
  return schema;
}
const Schema& table_schema() {
  static const Schema schema{
      "table",
      "",
      {{.key = "wood", .fallback = "oak", .meaning = "kind of wood", .allowed = {"oak", "beech", "pine"}},
       {.key = "seats", .kind = ValueKind::kInteger, .fallback = "4", .meaning = "seats", .min = 1},
       {.key = "round", .kind = ValueKind::kFlag, .fallback = "false", .meaning = "shape"},
       {.key = "rate", .kind = ValueKind::kNumberOrMax, .fallback = "max", .meaning = "rate"},
       {.key = "tags", .kind = ValueKind::kTextList, .fallback = "[]", .meaning = "tags"},
       {.key = "notes", .kind = ValueKind::kTextMap, .meaning = "notes"},
       {.key = "legs",
        .kind = ValueKind::kList,
        .fallback = "[]",
        .meaning = "legs",
        .inner = &leg_schema()}}};
  return schema;
}

// The complaint about a text; "accepted" if there is none.
std::string complaint(const std::string& text) {
  const test::TempFolder folder;
  const std::string file = folder.write("table.yaml", text);
  auto document = read_yaml(file);
  if (!document) return document.error().message.substr(folder.path().string().size() + 1);
  auto checked = check_document(*document, table_schema(), "table.yaml");
  return checked ? "accepted" : checked.error().message;
}

TEST(Schema, FillsEveryDefaultInTheSchemasOrder) {
  auto checked = check_document(YAML::Load("{legs: [{name: left}], seats: 6}"), table_schema(), "t");
  ASSERT_TRUE(checked.ok()) << checked.error().message;
  EXPECT_EQ(
      YAML::Dump(*checked),
      "wood: oak\nseats: 6\nround: false\nrate: max\ntags: []\nlegs:\n  - name: left\n    length_m: 0.5");
}

struct Refusal {
  const char* text;
  const char* expected;
};
class SchemaRefusals : public testing::TestWithParam<Refusal> {};

TEST_P(SchemaRefusals, NameFileLineFoundAndAllowed) {
  EXPECT_EQ(complaint(GetParam().text), GetParam().expected);
}

INSTANTIATE_TEST_SUITE_P(
    All, SchemaRefusals,
    testing::Values(
        Refusal{"wood: oak\nseets: 3\n",
                "table.yaml:2: the table has no key 'seets'; did you mean 'seats'?; allowed: wood, seats, "
                "round, rate, tags, notes, legs"},
        Refusal{"\n\nfoundation: 3\n",
                "table.yaml:3: the table has no key 'foundation'; allowed: wood, seats, round, rate, tags, "
                "notes, legs"},
        Refusal{"wood: ok\n",
                "table.yaml:1: 'wood' of the table is 'ok'; expected one of oak, beech, pine; did you mean "
                "'oak'?"},
        Refusal{"wood: steel\n",
                "table.yaml:1: 'wood' of the table is 'steel'; expected one of oak, beech, pine"},
        Refusal{"wood: [oak]\n",
                "table.yaml:1: 'wood' of the table is a list of 1; expected one of oak, beech, pine"},
        Refusal{"seats: 2.5\n",
                "table.yaml:1: 'seats' of the table is '2.5'; expected a whole number, at least 1"},
        Refusal{"seats: 0\n",
                "table.yaml:1: 'seats' of the table is '0'; expected a whole number, at least 1"},
        Refusal{"seats: many\n",
                "table.yaml:1: 'seats' of the table is 'many'; expected a whole number, at least 1"},
        Refusal{"round: maybe\n", "table.yaml:1: 'round' of the table is 'maybe'; expected true or false"},
        Refusal{"rate: -1\n", "table.yaml:1: 'rate' of the table is '-1'; expected a positive number or max"},
        Refusal{"rate: .nan\n",
                "table.yaml:1: 'rate' of the table is '.nan'; expected a positive number or max"},
        Refusal{"rate: fast\n",
                "table.yaml:1: 'rate' of the table is 'fast'; expected a positive number or max"},
        Refusal{"tags: a\n",
                "table.yaml:1: 'tags' of the table is 'a'; expected a list of texts, as in [a, b]"},
        Refusal{"tags:\n  - a\n  - {b: c}\n",
                "table.yaml:3: 'tags' of the table is a map; expected a list of texts, as in [a, b]"},
        Refusal{"notes: {a: [1]}\n",
                "table.yaml:1: 'notes' of the table is a list of 1; expected a map of texts, as in {a: b}"},
        Refusal{"wood: oak\nwood: pine\n",
                "table.yaml:2: the key 'wood' of the table is given twice, first in line 1"},
        Refusal{"legs:\n  - length_m: 1\n", "table.yaml:2: leg 1 lacks the key 'name' (text): name"},
        Refusal{"legs:\n  - name: a\n    length_m: 3\n",
                "table.yaml:3: 'length_m' of leg 'a' is '3'; expected a number from 0 to 2"},
        Refusal{"legs:\n  - name: a\n    length_m: .inf\n",
                "table.yaml:3: 'length_m' of leg 'a' is '.inf'; expected a number from 0 to 2"},
        Refusal{
            "legs:\n  - name: a\n    lenght_m: 1\n",
            "table.yaml:3: leg 'a' has no key 'lenght_m'; did you mean 'length_m'?; allowed: name, length_m"},
        Refusal{"legs:\n  - name: a\n  - name: a\n",
                "table.yaml:3: there are two legs named 'a', the first in line 2"},
        Refusal{"legs:\n  - a\n", "table.yaml:2: leg 1 is 'a'; expected a map with the keys name, length_m"},
        Refusal{"legs: {name: a}\n",
                "table.yaml:1: 'legs' of the table is a map; expected a list of maps, each a leg with the "
                "keys name, length_m"},
        Refusal{"- a\n",
                "table.yaml:1: the table is a list of 1; expected a map with the keys wood, seats, round, "
                "rate, tags, notes, legs"},
        Refusal{"just text\n",
                "table.yaml:1: the table is 'just text'; expected a map with the keys wood, seats, round, "
                "rate, tags, notes, legs"}));

TEST(Schema, RefusesWhatIsNoYaml) {
  EXPECT_TRUE(complaint("wood: [oak\nseats: 3\n").starts_with("table.yaml:"))
      << complaint("wood: [oak\nseats: 3\n");
  EXPECT_EQ(complaint(""), "table.yaml: the file is empty");
}

TEST(Schema, AFileThatIsNotThereIsNotFound) {
  auto read = read_yaml("/nowhere/table.yaml");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read.error().message, "there is no file /nowhere/table.yaml");
}

TEST(Schema, OverridesReachItemsOfListsByName) {
  YAML::Node document = YAML::Load("{legs: [{name: left}, {name: right}]}");
  ASSERT_TRUE(
      apply_override(document, table_schema(), {"legs.right.length_m", YAML::Node(0.7), "--set"}).ok());
  ASSERT_TRUE(apply_override(document, table_schema(), {"notes.colour", YAML::Node("red"), "--set"}).ok());
  auto checked = check_document(document, table_schema(), "t");
  ASSERT_TRUE(checked.ok()) << checked.error().message;
  EXPECT_EQ((*checked)["legs"][0]["length_m"].as<double>(), 0.5);
  EXPECT_EQ((*checked)["legs"][1]["length_m"].as<double>(), 0.7);
  EXPECT_EQ((*checked)["notes"]["colour"].as<std::string>(), "red");
}

TEST(Schema, OverridesThatFitNowhereAreRefused) {
  YAML::Node document = YAML::Load("{wood: oak, legs: [{name: left}, {name: right}]}");
  const auto refused = [&document](const std::string& path) {
    auto status = apply_override(document, table_schema(), {path, YAML::Node(1), "--set " + path + "=1"});
    return status.ok() ? "accepted" : status.error().message;
  };
  EXPECT_EQ(
      refused("legs.rigth.length_m"),
      "--set legs.rigth.length_m=1: there is no leg 'rigth'; did you mean 'right'?; there are: left, right");
  EXPECT_EQ(refused("legs.left"),
            "--set legs.left=1: 'legs.left' is a whole leg: name one of its keys: name, length_m");
  EXPECT_EQ(refused("wood.colour"), "--set wood.colour=1: 'wood' is 'oak', which has no keys inside");
  EXPECT_EQ(refused("legs..length_m"), "--set legs..length_m=1: the key 'legs..length_m' has an empty part");
}

TEST(Schema, AWrongValueFromTheCommandLineIsBlamedOnTheOption) {
  YAML::Node document = YAML::Load("{seats: 4}");
  const Override bad{"seats", YAML::Node("none"), "--seats none"};
  ASSERT_TRUE(apply_override(document, table_schema(), bad).ok());
  auto checked = check_document(document, table_schema(), "table.yaml", {bad});
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.error().message,
            "--seats none: 'seats' of the table is 'none'; expected a whole number, at least 1");
}

TEST(Suggest, FindsTheNearestWord) {
  EXPECT_EQ(nearest_word("visoin", {"speech", "vision", "reach"}), "vision");
  EXPECT_EQ(nearest_word("depends", {"name", "depends_on"}), "depends_on");
  EXPECT_EQ(nearest_word("elephant", {"speech", "vision"}), "");
  EXPECT_EQ(nearest_word("Seed", {"seed"}), "seed");
}

}  // namespace
}  // namespace nido
