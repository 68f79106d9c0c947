#include "nido/report/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace nido {
namespace {

using Json = nlohmann::json;

Report sample() {
  Report report;
  report.is_app = true;
  report.name = "speech_and_action";
  report.seed = 7;
  report.robot = "icub_sim";
  report.world = "table";
  report.wall_s = 12.5;
  report.sim_s = 25.0;
  report.add("real_time_factor", {2.0, "", 1, {}, {}});
  report.add("hand_error_m.median", median_metric({0.01, 0.02, 0.03}, "m", 0.05));
  report.trials_detail.push_back({{"seed", 7.0}, {"success", true}, {"text", std::string("<b>&\"")}});
  report.processes = {{"vision", 1}};
  report.outcome =
      Outcome{true, "dropped", "drop blue cube into basket", "drop", "blue cube", true, "It lies there."};
  report.story.push_back(
      {1.5, "heard", "done", "I heard <something>.", {{"stage-01-heard-left.png", "left eye"}}});
  report.plots.push_back({"curve", "A curve", "x (s)", "y (m)", {{"a", {{0, 0}, {1, 2}, {2, NAN}, {3, 1}}}}});
  return report;
}

TEST(Report, JsonHasEveryFieldOfTheSchema) {
  const Json json = Json::parse(sample().to_json());
  EXPECT_EQ(json.at("schema"), 1);
  EXPECT_EQ(json.at("app"), "speech_and_action");
  EXPECT_FALSE(json.contains("experiment"));
  for (const char* key : {"seed", "trials", "robot", "world", "wall_s", "sim_s", "metrics", "trials_detail",
                          "processes", "versions", "outcome"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* key : {"success", "stage", "heard", "goal", "object", "object_in_basket"}) {
    EXPECT_TRUE(json.at("outcome").contains(key)) << key;
  }
  const Json& metric = json.at("metrics").at("hand_error_m.median");
  EXPECT_DOUBLE_EQ(metric.at("value"), 0.02);
  EXPECT_EQ(metric.at("unit"), "m");
  EXPECT_EQ(metric.at("n"), 3);
  EXPECT_EQ(metric.at("ci95").size(), 2U);
  EXPECT_DOUBLE_EQ(metric.at("paper"), 0.05);
  EXPECT_EQ(json.at("processes").at(0).at("name"), "vision");
  EXPECT_EQ(json.at("processes").at(0).at("restarts"), 1);
  EXPECT_TRUE(json.at("versions").contains("nido"));
}

TEST(Report, AnExperimentSaysSoAndHasNoOutcome) {
  Report report;
  report.name = "goal-learning";
  const Json json = Json::parse(report.to_json());
  EXPECT_EQ(json.at("experiment"), "goal-learning");
  EXPECT_FALSE(json.contains("app"));
  EXPECT_FALSE(json.contains("outcome"));
}

TEST(Report, WhatIsNoNumberOrNoTextStillMakesValidFiles) {
  Report report = sample();
  report.add("broken", {NAN, "m", 0, std::array<double, 2>{NAN, NAN}, INFINITY});
  report.story.push_back({0.0, "heard", "done", std::string("\xff\xfe bytes"), {}});
  const Json json = Json::parse(report.to_json());
  EXPECT_TRUE(json.at("metrics").at("broken").at("value").is_null());
  EXPECT_TRUE(json.at("metrics").at("broken").at("ci95").is_null());
  EXPECT_TRUE(json.at("metrics").at("broken").at("paper").is_null());
}

TEST(Report, HtmlEscapesWhatIsNotItsOwn) {
  const std::string html = sample().to_html();
  EXPECT_EQ(html.find("<something>"), std::string::npos);
  EXPECT_NE(html.find("&lt;something&gt;"), std::string::npos);
  EXPECT_NE(html.find("&lt;b&gt;&amp;&quot;"), std::string::npos);
  EXPECT_NE(html.find("It lies there."), std::string::npos);
  EXPECT_NE(html.find("stage-01-heard-left.png"), std::string::npos);
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_EQ(html.find("http://", html.find("</svg>")), std::string::npos)
      << "the page must not load from elsewhere";
}

TEST(Report, SavesEverythingWholeAndTwice) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "report_test" / "deep";
  std::filesystem::remove_all(folder);
  for (int i = 0; i < 2; ++i) {
    const Status status = sample().save(folder.string());
    ASSERT_TRUE(status.ok()) << status.error().message;
  }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    EXPECT_GT(entry.file_size(), 100U) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 3U);
  std::ifstream picture(folder / "curve.png", std::ios::binary);
  std::string magic(4, ' ');
  picture.read(magic.data(), 4);
  EXPECT_EQ(magic, "\x89PNG");
}

TEST(Report, AFolderThatCannotBeIsASentence) {
  const Status status = sample().save("/dev/null/folder");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/dev/null/folder"), std::string::npos);
}

TEST(Plot, PointsLieWhereTheAxesSay) {
  Plot plot;
  plot.name = "p";
  plot.series = {{"a", {{0, 0}, {10, 5}}, false, false}};
  const std::string svg = plot_svg(plot);
  // the first point is left of and below the second
  const auto attribute = [&](std::size_t from, const std::string& key) {
    const std::size_t at = svg.find(key + "=\"", from) + key.size() + 2;
    return std::stod(svg.substr(at));
  };
  const std::size_t first = svg.find("<circle");
  const std::size_t second = svg.find("<circle", first + 1);
  ASSERT_NE(second, std::string::npos);
  EXPECT_LT(attribute(first, "cx"), attribute(second, "cx"));
  EXPECT_GT(attribute(first, "cy"), attribute(second, "cy"));
}

TEST(Plot, EmptyAndConstantDataAreNoTrouble) {
  for (const auto& points :
       {std::vector<std::array<double, 2>>{}, {{1, 1}}, {{1, 2}, {2, 2}}, {{NAN, NAN}}}) {
    Plot plot;
    plot.name = "p";
    plot.series = {{"a", points}};
    EXPECT_EQ(plot_svg(plot).find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace nido
