// The network of sounds, and how a text is held against what it tells.

#include "sounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "evidence.h"
#include "lexicon.h"
#include "nido/speech/voice.h"

namespace nido {
namespace {

using Said = std::vector<std::pair<std::string, int>>;  // a sound and its frames

// What a network would tell that is sure of what is said: 90 % of each frame.
Eigen::MatrixXf heard(const Said& said) {
  int frames = 0;
  for (const auto& [sound, length] : said) frames += length;
  Eigen::MatrixXf probabilities = Eigen::MatrixXf::Constant(SoundNetwork::kOutputs, frames, 0.1F / 39.0F);
  int frame = 0;
  for (const auto& [sound, length] : said) {
    for (int i = 0; i < length; ++i) probabilities(*sound_of(sound), frame++) = 0.9F;
  }
  return probabilities.array().log();
}

const std::map<std::string, std::vector<std::string>> kSounding = {
    {"red", {"R EH D"}}, {"ball", {"B AO L", "B AA L"}}, {"odd", {"Q Q"}}};
const Said kRedBall = {{"SIL", 20}, {"R", 6},  {"EH", 8}, {"D", 5},   {"SIL", 3},
                       {"B", 5},    {"AA", 9}, {"L", 7},  {"SIL", 30}};

TEST(SoundEvidence, WhatIsSaidFitsInAnyOfItsPronunciations) {
  const auto evidence = weigh_sounds(heard(kRedBall), "red ball", kSounding);
  ASSERT_TRUE(evidence);
  EXPECT_GT(evidence->worst_sound, 2.0);
  EXPECT_NEAR(evidence->gap, 0.0, 1e-6);
  EXPECT_NEAR(evidence->unexplained, 0.0, 1e-6);
}

TEST(SoundEvidence, OneOtherSoundIsFound) {
  Said said = kRedBall;
  said[1].first = "B";  // "bed ball"
  const auto evidence = weigh_sounds(heard(said), "red ball", kSounding);
  ASSERT_TRUE(evidence);
  EXPECT_LT(evidence->worst_sound, -2.0);
  EXPECT_GT(evidence->second_worst, 2.0);
  EXPECT_GT(evidence->gap, 0.2);
  EXPECT_LT(evidence->worst_word, 0.5);
}

TEST(SoundEvidence, SpeechBesideTheTextIsFound) {
  Said said = kRedBall;
  said.insert(said.begin() + 1, {{"S", 8}, {"IY", 10}});  // "see red ball"
  const auto evidence = weigh_sounds(heard(said), "red ball", kSounding);
  ASSERT_TRUE(evidence);
  EXPECT_GT(evidence->unexplained, 3.0);
}

TEST(SoundEvidence, ThereIsNoneForWhatCannotBeSaid) {
  EXPECT_FALSE(weigh_sounds(heard({{"R", 4}, {"EH", 2}}), "red ball", kSounding));  // too short
  EXPECT_FALSE(weigh_sounds(heard(kRedBall), "", kSounding));
  EXPECT_FALSE(weigh_sounds(heard(kRedBall), "odd", kSounding));      // no such sound
  EXPECT_FALSE(weigh_sounds(heard(kRedBall), "unknown", kSounding));  // no such word
  EXPECT_FALSE(weigh_sounds(heard({}), "red", kSounding));
}

TEST(SoundNetwork, TheShippedOneTellsSoundsOfSpeech) {
  const auto network = SoundNetwork::load(NIDO_SPEECH_MODEL "/sounds");
  ASSERT_TRUE(network.ok()) << network.error().message;
  const auto samples = speak("red ball", {}, 0.3, 0.3);
  ASSERT_TRUE(samples.ok());
  const Eigen::MatrixXf told = network->log_probabilities(spectrum_of(*samples));
  for (Eigen::Index frame = 0; frame < told.cols(); ++frame)
    ASSERT_NEAR(told.col(frame).array().exp().sum(), 1.0, 1e-3) << frame;
  const auto right = weigh_sounds(told, "red ball", kSounding);
  const auto wrong = weigh_sounds(told, "ball red", kSounding);
  ASSERT_TRUE(right && wrong);
  EXPECT_LT(right->gap, 0.3);
  EXPECT_GT(wrong->gap, 1.0);
  EXPECT_EQ(network->log_probabilities(spectrum_of({})).cols(), 0);
}

TEST(SoundNetwork, FilesAreCheckedAndComeBackAsTheyWere) {
  const auto shipped = SoundNetwork::load(NIDO_SPEECH_MODEL "/sounds");
  ASSERT_TRUE(shipped.ok());
  const std::string path = testing::TempDir() + "nido-sounds-test";
  ASSERT_TRUE(shipped->save(path));
  const auto again = SoundNetwork::load(path);
  ASSERT_TRUE(again.ok());
  for (std::size_t i = 0; i < shipped->weights.size(); ++i) {
    EXPECT_EQ(again->weights[i], shipped->weights[i]);
    EXPECT_EQ(again->biases[i], shipped->biases[i]);
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  EXPECT_EQ(SoundNetwork::load(path).error().code, ErrorCode::kInvalidArgument);
  std::ofstream(path) << "something else, and long enough to have a header";
  EXPECT_EQ(SoundNetwork::load(path).error().code, ErrorCode::kInvalidArgument);
  std::filesystem::remove(path);
  EXPECT_EQ(SoundNetwork::load(path).error().code, ErrorCode::kNotFound);
}

TEST(Accents, AreAddedToWhatADictionarySays) {
  const auto has = [](const std::vector<std::string>& all, const std::string& one) {
    return std::find(all.begin(), all.end(), one) != all.end();
  };
  EXPECT_TRUE(has(with_other_accents({"B AH N AE N AH"}), "B AH N AA N AH"));  // banana
  EXPECT_TRUE(has(with_other_accents({"T AY G ER"}), "T AY G AH"));            // tiger
  EXPECT_TRUE(has(with_other_accents({"G IH T AA R"}), "G IH T AA"));          // guitar
  EXPECT_TRUE(has(with_other_accents({"B AA T AH L"}), "B AO T AH L"));        // bottle
  for (const auto& sounds : with_other_accents({"R AE B AH T"}))               // rabbit
    EXPECT_EQ(sounds.substr(0, 2), "R ");
  EXPECT_TRUE(has(with_other_accents({"K EH R AH T"}), "K EH R IH T"));  // carrot
  EXPECT_TRUE(has(with_other_accents({"CH EH R IY"}), "CH EH R IH"));    // cherry: old-fashioned English
  EXPECT_TRUE(has(with_other_accents({"CH EH R IY"}), "CH EH R EH"));    // and Scottish
  const auto cup = with_other_accents({"K AH P"});
  EXPECT_EQ(cup.front(), "K AH P");  // what the dictionary says comes first
  EXPECT_EQ(with_other_accents({"AH", "EY"}), (std::vector<std::string>{"AH", "EY"}));
  EXPECT_EQ(with_other_accents({"T IY"}), (std::vector<std::string>{"T IY"}));  // not the only vowel
  EXPECT_EQ(with_other_accents({"L EH M"}), (std::vector<std::string>{"L EH M"}));
}

}  // namespace
}  // namespace nido
