// The experiment's answers, as a file.

#include "answers.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace nido {
namespace {

TEST(SpeechAnswers, ComeBackAsTheyWereWritten) {
  const std::string path = testing::TempDir() + "nido-answers-test.tsv";
  SpeechAnswer answer{"en-us+f1", 160, "pink10", "phrase", "red ball"};
  answer.outcome = "missed";
  answer.answer.nearest = "red ball";
  answer.answer.confidence = 0.25;
  answer.answer.sounds = SoundEvidence{-1.5, -0.5, 1.25, 0.75, 0.125, 0.0};
  answer.sound_s = 2.5;
  const SpeechAnswer nothing{"en-us+f1", 160, "clean", "tones", ""};  // no words, nothing heard
  ASSERT_TRUE(save_answers(path, {answer, nothing}));
  const auto read = load_answers(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  const SpeechAnswer& first = read->front();
  EXPECT_EQ(first.voice, "en-us+f1");
  EXPECT_EQ(first.speed, 160);
  EXPECT_EQ(first.text, "red ball");
  EXPECT_EQ(first.outcome, "missed");
  EXPECT_EQ(first.answer.confidence, 0.25);
  EXPECT_EQ(first.answer.sounds->worst_sound, -1.5);
  EXPECT_EQ(first.answer.sounds->gap, 0.125);
  EXPECT_EQ(first.sound_s, 2.5);
  EXPECT_EQ(read->back().kind, "tones");
  EXPECT_EQ(read->back().heard, "");

  std::ofstream(path, std::ios::app) << "half a li";
  const auto broken = load_answers(path);
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().message.find(":4:"), std::string::npos) << broken.error().message;
  std::ofstream(path) << "other\tcolumns\n";
  EXPECT_FALSE(load_answers(path).ok());
  std::filesystem::remove(path);
  EXPECT_EQ(load_answers(path).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace nido
