// The text vocabulary: what is answered, what is refused, and that nothing breaks it.

#include "nido/textproto/control_board_text.h"

#include <gtest/gtest.h>

#include <random>

#include "fake/fake_control_board.h"
#include "nido/textproto/text_value.h"
#include "rigs.h"

namespace nido::test {
namespace {

class ControlBoardTextTest : public testing::Test {
 protected:
  std::string ask(const std::string& line) { return text_.reply(line); }
  // The answer without its time, which counts requests.
  std::string answer(const std::string& line) {
    const std::string full = ask(line);
    const std::size_t stamp = full.find(" [tsta]");
    return full.substr(0, stamp);
  }
  void advance(int periods) {
    for (int i = 0; i < periods; ++i) {
      now_ns_ += kPeriod_ns;
      ASSERT_TRUE(board_.step_to(now_ns_).ok());
    }
  }
  FakeControlBoard board_{
      {{"shoulder", {-1.5707963267948966, 1.5707963267948966, 3.141592653589793, 10.0}, 0, 0.5},
       {"elbow", {0, 1.5707963267948966, 3.141592653589793, 5.0}, 0, 0.5}}};
  ControlBoardText text_{board_};
  std::int64_t now_ns_ = 0;
};

TEST_F(ControlBoardTextTest, EncodersComeInDegreesWithAStamp) {
  EXPECT_EQ(ask("get encs"), "[is] encs (0.0 0.0) [tsta] 0 0.0 [ok]");
  EXPECT_EQ(ask("[get] [enc] 1"), "[is] [enc] 0.0 [tsta] 1 0.0 [ok]");
  ASSERT_EQ(ask("set pos 0 45"), "[ok]");
  advance(1000);
  EXPECT_EQ(answer("get enc 0"), "[is] enc 45.0");
}

TEST_F(ControlBoardTextTest, WhatABoardIs) {
  EXPECT_EQ(answer("get axes"), "[is] axes 2");
  EXPECT_EQ(ask("get prot"), "[prot] 1 9 0 [ok]");
  EXPECT_EQ(answer("get name 1"), "[is] name elbow");
  EXPECT_EQ(answer("get llim 1"), "[is] llim 0.0 90.0");
  EXPECT_EQ(answer("get vlim 1"), "[is] vlim 0.0 180.0");
  EXPECT_EQ(answer("get torq rng 1"), "[is] torq -5.0 5.0");
  EXPECT_EQ(answer("get info"), "[is] info ((shoulder -90.0 90.0 180.0 10.0) (elbow 0.0 90.0 180.0 5.0))");
  EXPECT_EQ(ask("help").substr(0, 7), "[many] ");
}

TEST_F(ControlBoardTextTest, PositionsOneAllAndSome) {
  EXPECT_EQ(ask("set poss (10 20)"), "[ok]");
  EXPECT_EQ(answer("get poss"), "[is] poss (10.0 20.0)");
  EXPECT_EQ(ask("set posg 1 (1) (30.5)"), "[ok]");
  EXPECT_EQ(answer("get pos 1"), "[is] pos 30.5");
  EXPECT_EQ(answer("get dons"), "[is] dons 0");
  EXPECT_EQ(answer("get donl"), "[is] donl (0 0)");
  EXPECT_EQ(ask("set stos"), "[ok]");
  EXPECT_EQ(answer("get dons"), "[is] dons 1");
  EXPECT_EQ(answer("get dong 1 (1)"), "[is] dong 1");
  EXPECT_EQ(ask("set rel 1 5"), "[ok]");
  EXPECT_EQ(answer("get pos 1"), "[is] pos 5.0");
}

TEST_F(ControlBoardTextTest, SpeedsAndAccelerations) {
  EXPECT_EQ(ask("set vel 0 30"), "[ok]");
  EXPECT_EQ(ask("set acc 0 100"), "[ok]");
  EXPECT_EQ(answer("get vel 0"), "[is] vel 30.0");
  EXPECT_EQ(answer("get acc 0"), "[is] acc 100.0");
  EXPECT_EQ(ask("set vmos (12 0)"), "[ok]");
  advance(50);
  EXPECT_EQ(answer("get icmd cmod 0"), "[is] 0 [vel]");
  const auto words = parse_text(answer("get esp 0"));
  EXPECT_NEAR((*words)[2].number(), 12.0, 1e-9);
}

TEST_F(ControlBoardTextTest, ModesOneAllAndSome) {
  EXPECT_EQ(answer("get icmd cmds"), "[is] [cmds] ([pos] [pos])");
  EXPECT_EQ(ask("set icmd cmod 0 vel"), "[ok]");
  EXPECT_EQ(ask("[set] [icmd] [cmod] 1 [idl]"), "[ok]");
  EXPECT_EQ(answer("get icmd cmds"), "[is] [cmds] ([vel] [idl])");
  EXPECT_EQ(ask("set icmd cmds (torq posd)"), "[ok]");
  EXPECT_EQ(answer("get icmd cmog 2 (1 0)"), "[is] [cmog] ([posd] [torq])");
}

TEST_F(ControlBoardTextTest, Motors) {
  EXPECT_EQ(answer("get mncs"), "[is] mncs (0.0 0.0)");
  EXPECT_EQ(answer("get acu 1"), "[is] acu 0.0");
  EXPECT_EQ(answer("get tmps"), "[is] tmps (25.0 25.0)");
  EXPECT_EQ(answer("get asta"), "[is] asta (1 1)");
  EXPECT_EQ(ask("set icmd cmod 1 idl"), "[ok]");
  EXPECT_EQ(answer("get asts 1"), "[is] asts 0");
  EXPECT_EQ(ask("get ipwm pwms"), "[is] ipwm (0.0 0.0) [ok]");
}

TEST_F(ControlBoardTextTest, GainsOfALoop) {
  EXPECT_EQ(ask("get pid pid pos 1"), "[is] pid (10.0 0.0 0.0 0.0 1.0 0.0 1.0 0.0 0.0 0.0) [ok]");
  EXPECT_EQ(ask("set pid pid pos 1 (3 0.5 0 0 1 -2 1 0 0 0)"), "[ok]");
  EXPECT_EQ(
      ask("get pid pids pos"),
      "[is] pid ((10.0 0.0 0.0 0.0 1.0 0.0 1.0 0.0 0.0 0.0) (3.0 0.5 0.0 0.0 1.0 -2.0 1.0 0.0 0.0 0.0)) "
      "[ok]");
  EXPECT_EQ(ask("get pid errs vel"), "[is] pid (0.0 0.0) [ok]");
  for (const char* line : {"set pid pid pos 1 (3 0 0)", "set pid pid pos 1 3", "set pid pid dance 1 (1)",
                           "set pid pid pos 1 (-3 0 0 0 1 0 1 0 0 0)", "get pid pid pos 9", "get pid pid",
                           "get pid nonsense pos 0"}) {
    EXPECT_EQ(ask(line).substr(0, 6), "[fail]") << line;
  }
  EXPECT_EQ(ask("get pid pid pos 1"), "[is] pid (3.0 0.5 0.0 0.0 1.0 -2.0 1.0 0.0 0.0 0.0) [ok]");
}

TEST_F(ControlBoardTextTest, InteractionImpedanceVariablesCalibration) {
  EXPECT_EQ(answer("get intm mods"), "([stif] [stif])");
  EXPECT_EQ(ask("set intm mode 1 comp"), "[ok]");
  EXPECT_EQ(answer("get intm mode 1"), "[comp]");
  EXPECT_EQ(ask("set intm mods (stif dance)").substr(0, 6), "[fail]");
  EXPECT_EQ(answer("get intm mode 1"), "[comp]");
  EXPECT_EQ(ask("set iimp ipr 0 (0.1 0.02)"), "[ok]");
  EXPECT_EQ(answer("get iimp ipr 0"), "[is] iimp (0.1 0.02)");
  EXPECT_EQ(ask("get ivar lvar"), "[is] ivar (\"note\") [ok]");
  EXPECT_EQ(ask("set ivar mvar note hello"), "[ok]");
  EXPECT_EQ(ask("get ivar mvar note"), "[is] ivar (\"hello\") [ok]");
  EXPECT_EQ(ask("get ivar mvar no").substr(0, 6), "[fail]");
  EXPECT_EQ(ask("set pos 0 30"), "[ok]");
  advance(500);
  EXPECT_EQ(ask("set reca homs"), "[ok]");
  advance(500);
  EXPECT_EQ(answer("get encs"), "[is] encs (0.0 0.0)");
  EXPECT_EQ(ask("cald 1"), "[ok]");
  EXPECT_EQ(ask("cald 7").substr(0, 6), "[fail]");
  EXPECT_EQ(ask("park 1"), "[ok]");
}

TEST_F(ControlBoardTextTest, TorquesAndDutyCycles) {
  EXPECT_EQ(ask("set torq ref 0 2.5"), "[ok]");
  advance(1);
  EXPECT_EQ(answer("get torq trqs"), "[is] torq (2.5 0.0)");
  EXPECT_EQ(answer("get torq ref 0"), "[fail] \"this board does not tell it\"");
}

class Refused : public ControlBoardTextTest,
                public testing::WithParamInterface<std::pair<const char*, const char*>> {};

TEST_P(Refused, SaysWhyAndChangesNothing) {
  const std::vector<double> before = *board_.target_positions();
  const std::vector<ControlMode> modes = *board_.control_modes();
  const std::string reply = ask(GetParam().first);
  EXPECT_EQ(reply.substr(0, std::string(GetParam().second).size()), GetParam().second);
  EXPECT_GT(reply.size(), 10U) << "no reason is given";
  EXPECT_TRUE(parse_text(reply).ok()) << reply;
  EXPECT_EQ(*board_.target_positions(), before);
  EXPECT_EQ(*board_.control_modes(), modes);
}
INSTANTIATE_TEST_SUITE_P(
    Lines, Refused,
    testing::Values(std::pair{"", "[nak]"}, std::pair{"get", "[nak]"}, std::pair{"dance now", "[fail]"},
                    std::pair{"get enc x", "[fail]"}, std::pair{"get enc 2", "[fail]"},
                    std::pair{"get enc -1", "[fail]"}, std::pair{"get enc 0.5", "[fail]"},
                    std::pair{"set sto", "[fail]"}, std::pair{"set ipwm ref 1 50", "[fail]"},
                    std::pair{"set dpo 0 10", "[fail]"}, std::pair{"set llim 0 0 1", "[fail]"},
                    std::pair{"set pos 0", "[fail]"}, std::pair{"set pos 0 nan", "[fail]"},
                    std::pair{"set pos 0 1e999", "[nak]"}, std::pair{"set pos 99999999999999 1", "[fail]"},
                    std::pair{"set pos 2 10", "[fail]"}, std::pair{"set poss (1)", "[fail]"},
                    std::pair{"set poss (1 2 3)", "[fail]"}, std::pair{"set poss 1 2", "[fail]"},
                    std::pair{"set posg 2 (0) (1)", "[fail]"}, std::pair{"set posg 2 (0 0) (1 2)", "[fail]"},
                    std::pair{"set posg 2 (0 1) (1 (2))", "[fail]"}, std::pair{"set vel 0 -3", "[fail]"},
                    std::pair{"set icmd cmod 0 fly", "[fail]"}, std::pair{"set icmd cmod 0 hwfa", "[fail]"},
                    std::pair{"set icmd cmds (vel fly)", "[fail]"}, std::pair{"set icmd", "[fail]"},
                    std::pair{"set torq ref 0", "[fail]"}, std::pair{"get torq", "[fail]"},
                    std::pair{"set pos 0 (1", "[nak]"}, std::pair{"set pos 0 \"a", "[nak]"}));

TEST_F(ControlBoardTextTest, NothingBreaksIt) {
  std::mt19937_64 random(11);
  const std::vector<std::string> pieces = {
      "get",  "set",  "[get]", "[set]", "pos", "poss",  "posg", "icmd", "cmod", "cmds", "0",   "1",
      "-1",   "2.5",  "1e308", "(",     ")",   "(0 1)", "\"",   "\\",   "[",    "]",    "vel", "nan",
      "info", "torq", "ref",   "(((",   ")))", "99999", "\x01", "\xff", "stog", "2"};
  for (int round = 0; round < 50'000; ++round) {
    std::string line;
    for (std::uint64_t n = random() % 9; n > 0; --n)
      line += pieces[random() % pieces.size()] + (random() % 8 ? " " : "");
    const std::string reply = ask(line);
    ASSERT_FALSE(reply.empty()) << line;
    ASSERT_TRUE(parse_text(reply).ok()) << line << " -> " << reply;
    if (round % 50 == 0) advance(1);
    const std::vector<double> position_rad = board_.read_joints()->position_rad;
    ASSERT_TRUE(std::isfinite(position_rad[0]) && std::isfinite(position_rad[1])) << line;
  }
  EXPECT_EQ(ask(std::string(100'000, '(')).substr(0, 5), "[nak]");
  EXPECT_EQ(ask(std::string(20'000, '(')).substr(0, 5), "[nak]");
}

TEST(TextValue, ComesBackAsItWasWritten) {
  for (const char* line : {"get enc 3", "[set] [pos] 3 -4.5", "a (1 2.0 (b \"c d\")) [ok]",
                           "\"say \\\"hi\\\" \\\\\"", "1e-09 0.1", "()"}) {
    const auto values = parse_text(line);
    ASSERT_TRUE(values.ok()) << line;
    EXPECT_EQ(format_text(*values), line);
  }
}

TEST(TextValue, KeepsEveryDigitOfANumber) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-1e4, 1e4);
  for (int i = 0; i < 1000; ++i) {
    const double number = any(random);
    EXPECT_EQ((*parse_text(format_number(number)))[0].number(), number);
  }
}

}  // namespace
}  // namespace nido::test
