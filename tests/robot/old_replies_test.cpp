// The replies to the control-board and world vocabularies have the shape that the old simulator's have: also
// after a YARP program has got them as Bottles.

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <regex>

#include "nido/simulator/devices/simulated_sensors.h"
#include "nido/textproto/control_board_text.h"
#include "reply_shape.h"
#include "simulated_rig.h"

namespace nido::test {
namespace {

struct Exchange {
  std::string line;
  std::string shape;
};

std::string replaced(const std::string& text, const char* word, const std::string& by) {
  return std::regex_replace(text, std::regex(std::string("\\b") + word + "\\b"), by);
}

std::vector<Exchange> exchanges(const char* file) {
  std::ifstream in(std::string(NIDO_OLD_REPLIES) + "/" + file);
  std::vector<Exchange> all;
  for (std::string line; std::getline(in, line);) {
    const std::size_t arrow = std::min(line.find(" -> "), line.find(" ~> "));
    if (line.empty() || line.front() == '#') continue;
    if (arrow == std::string::npos) throw std::runtime_error("no arrow in " + line);
    all.push_back({line.substr(0, arrow), line.substr(arrow + 4)});
  }
  return all;
}

// one line for each joint and each loop
std::vector<Exchange> written_out(const std::vector<Exchange>& all, int axes) {
  std::vector<Exchange> out;
  for (const Exchange& exchange : all) {
    const bool joints = std::regex_search(exchange.line, std::regex("\\bJ\\b"));
    const bool loops = std::regex_search(exchange.line, std::regex("\\bL\\b"));
    for (int joint = 0; joint < (joints ? axes : 1); ++joint) {
      for (const char* loop : {"pos", "vel", "trq", "cur"}) {
        out.push_back({replaced(replaced(exchange.line, "J", std::to_string(joint)), "L", loop),
                       replaced(exchange.shape, "N", std::to_string(axes))});
        if (!loops) break;
      }
    }
  }
  return out;
}

// The shape of a reply as a program of YARP sees it. What follows [fail] and [nak] is the reason.
std::string seen_by_yarp(const std::string& reply, const std::string& asked) {
  const Result<yarp::Bottle> parsed = yarp::parse_bottle(reply);
  if (!parsed) return "no Bottle: " + parsed.error().message;
  const Result<yarp::Bottle> travelled =
      yarp::decode(yarp::encode(*parsed, yarp::Dialect::k3), yarp::Dialect::k3);
  if (!travelled) return "lost on the way: " + travelled.error().message;
  if (*travelled != *parsed) return "changed on the way";
  const bool refused =
      !parsed->empty() && (parsed->front().is_word("fail") || parsed->front().is_word("nak"));
  return refused ? "[" + parsed->front().text + "]" : shape_of(*parsed, asked);
}

std::string second_word(const std::string& line) {
  std::istringstream words(line);
  std::string word;
  words >> word >> word;
  return word;
}

TEST(OldReplies, ControlBoards) {
  const std::vector<Exchange> table = exchanges("old_replies.txt");
  const auto robot = simulated_robot();
  std::size_t asked = 0;
  for (const char* part : {"head", "torso", "left_arm", "right_arm", "left_leg", "right_leg"}) {
    const auto device = required(sim::SimulatedControlBoard::create(robot, part));
    ManualClock clock;
    const auto limited = required(LimitedControlBoard::create(*device, clock, {}));
    ControlBoardText text(*limited);
    for (const Exchange& exchange : written_out(table, device->axes())) {
      const std::string reply = text.reply(exchange.line);
      EXPECT_EQ(seen_by_yarp(reply, second_word(exchange.line)), exchange.shape)
          << part << ": " << exchange.line << " -> " << reply;
      ++asked;
    }
  }
  EXPECT_GT(asked, 5000U);
}

TEST(OldReplies, World) {
  sim::SimulatedWorld world(simulated_robot());
  for (const Exchange& exchange : exchanges("old_world_replies.txt")) {
    const std::string reply = world.command(exchange.line);
    const std::string wanted = exchange.shape.starts_with("[fail]") ? "[fail]" : exchange.shape;
    EXPECT_EQ(seen_by_yarp(reply, " "), wanted) << exchange.line << " -> " << reply;
  }
}

}  // namespace
}  // namespace nido::test
