// Things that a person shows and names: learned from a few pictures, found and named from then on.
#include <gtest/gtest.h>

#include <cmath>

#include "loop.h"
#include "scenes.h"

namespace nido::test {
namespace {

const std::vector<double> kArmAside = {0, 80, 0, 50, 0, 0, 0, 59, 20, 20, 20, 10, 10, 10, 10, 10};
const std::string kFive =
    "{object: cube, colour: blue, name: blue cube, position_m: [-0.40, 0.0], yaw_deg: 10}|"
    "{object: ball, colour: red, name: red ball, position_m: [-0.25, -0.05]}|"
    "{object: cube, colour: green, name: green cube, position_m: [-0.26, 0.18], yaw_deg: 70}|"
    "{object: ball, colour: blue, name: blue ball, position_m: [-0.40, 0.2]}|"
    "{object: bear, name: teddy bear, position_m: [-0.42, 0.1]}";

vision::TemplateSet templates() {
  return need(vision::TemplateSet::load(std::string(NIDO_CONFIG_DIR) + "/objects/templates.yaml"));
}

std::string world(const std::string& thing, const std::string& others) {
  std::vector<std::string> lines;
  if (!thing.empty()) lines.push_back(thing);
  for (std::size_t at = 0; at < others.size();) {
    const std::size_t end = std::min(others.find('|', at), others.size());
    lines.push_back(others.substr(at, end - at));
    at = end + 1;
  }
  return table_world(lines);
}

struct Lesson {
  std::optional<vision::VisionOutputs::Taught> taught;
  vision::TemplateSet known;
};

// Shows what lies at a place on the table and says its name.
Lesson teach(const std::string& thing, const std::string& name, const vision::TemplateSet& before) {
  Stage stage(world(thing, ""));
  stage.place("right_arm", kArmAside);
  stage.place("left_arm", kArmAside);
  stage.look_at({-0.32, 0.06, -0.055});
  Loop loop(stage, before);
  loop.set_goal({"point", "", {-0.32, 0.06, -0.055}});
  loop.run(0.5);
  loop.call(name);
  Lesson lesson;
  loop.run(3.0, [&](const auto& out) {
    if (out.taught) lesson.taught = out.taught;
    return lesson.taught.has_value();
  });
  lesson.known = loop.templates();
  return lesson;
}

TEST(Learner, AThingThatWasShownIsFoundAmongFiveOthersAndNamed) {
  struct Case {
    const char* object;
    const char* colour;
    const char* name;
  };
  for (const Case& c :
       {Case{"cylinder", "[0.55, 0.15, 0.75]", "bottle"}, Case{"ball", "[0.95, 0.45, 0.05]", "apple"}}) {
    const std::string text =
        std::string("object: ") + c.object + ", colour: " + c.colour + ", name: " + c.name;
    const Lesson lesson =
        teach("{" + text + ", position_m: [-0.32, 0.06], yaw_deg: 25}", c.name, templates());
    ASSERT_TRUE(lesson.taught) << c.name;
    ASSERT_TRUE(lesson.taught->learned) << lesson.taught->text;
    EXPECT_EQ(lesson.taught->name, c.name);

    Stage stage(world("{" + text + ", position_m: [-0.31, 0.09], yaw_deg: -50}", kFive));
    stage.place("right_arm", kArmAside);
    stage.place("left_arm", kArmAside);
    stage.look_at({-0.33, 0.08, -0.06});
    Loop loop(stage, lesson.known);
    loop.run(0.4);
    bool found = false;
    for (const auto& object : loop.last().objects) {
      const Stage::Truth truth = stage.truth(object.name);  // fails the test's program for no such thing
      EXPECT_LT((object.p_RootObject_m - truth.p_Root_m).norm(), 0.02) << object.name;
      found = found || object.name == c.name;
    }
    EXPECT_TRUE(found) << c.name << ": " << lesson.taught->text;
    EXPECT_EQ(loop.last().objects.size(), 6U) << c.name;
  }
}

TEST(Learner, AThingOfAKnownColourIsLearnedByItsShape) {
  const Lesson lesson =
      teach("{object: cylinder, colour: blue, name: tin, position_m: [-0.32, 0.06]}", "tin", templates());
  ASSERT_TRUE(lesson.taught && lesson.taught->learned) << (lesson.taught ? lesson.taught->text : "nothing");
  EXPECT_EQ(lesson.known.colours.size(), templates().colours.size());
  EXPECT_EQ(lesson.known.objects.back().colour, "blue");
}

TEST(Learner, WhatCannotBeMadeOutIsNotLearnedAndTheReasonIsSaid) {
  const auto before = templates();
  const Lesson nothing =
      teach("{object: ball, colour: [0.6, 0.1, 0.7], name: far, position_m: [-0.5, -0.25]}", "ghost", before);
  ASSERT_TRUE(nothing.taught);
  EXPECT_FALSE(nothing.taught->learned);
  EXPECT_NE(nothing.taught->text.find("in the middle of my view"), std::string::npos) << nothing.taught->text;
  EXPECT_EQ(nothing.known.objects.size(), before.objects.size());

  const Lesson mark = teach("{object: ball, colour: [0.9, 0.05, 0.9], name: plum, position_m: [-0.32, 0.06]}",
                            "plum", before);
  ASSERT_TRUE(mark.taught);
  EXPECT_FALSE(mark.taught->learned);
  EXPECT_NE(mark.taught->text.find("marks on my hands"), std::string::npos) << mark.taught->text;
}

}  // namespace
}  // namespace nido::test
