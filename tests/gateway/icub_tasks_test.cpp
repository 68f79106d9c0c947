// What clients of iCub's controllers of hand and gaze say, answered by nido's devices.

#include "nido/gateway/icub_tasks.h"

#include <fmt/format.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>

#include "../robot/task_rig.h"
#include "gateway_link.h"
#include "nido/textproto/task_text.h"
#include "nido/wrappers/task_wrappers.h"

namespace nido::test {
namespace {

using gateway::CartesianWords;
using gateway::GazeWords;
using yarp::Bottle;

Bottle bottle(const std::string& text) { return required(yarp::parse_bottle(text)); }

// The shape of an answer: its words, with numbers as # and strings as "".
std::string shape(const Bottle& words) {
  std::string text;
  for (const yarp::Value& word : words) {
    if (!text.empty()) text += ' ';
    if (word.is_list()) {
      text += "(" + shape(word.items) + ")";
    } else if (word.is_number()) {
      text += '#';
    } else if (word.is_word("true") || word.is_word("fals")) {
      text += "[truth]";
    } else if (word.kind == yarp::Value::Kind::kWord) {
      text += "[" + word.text + "]";
    } else {
      text += "\"\"";
    }
  }
  return text;
}

// What the clients of the iCub software sent with their calls to a gateway before a fake robot, and what they
// got, in the order in which it was recorded.
struct Exchange {
  std::string asked;
  std::string answered;
};
std::vector<Exchange> exchanges(const std::string& client) {
  std::vector<Exchange> found;
  std::ifstream file(NIDO_ICUB_CLIENTS);
  bool wanted = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("# ")) wanted = line == "# " + client;
    if (wanted && line.starts_with("> ")) found.push_back({line.substr(2), ""});
    if (wanted && line.starts_with("< ")) found.back().answered = line.substr(2);
  }
  EXPECT_GT(found.size(), 30U) << client;
  return found;
}

class IcubHand : public testing::Test {
 protected:
  void let_it_arrive() {
    for (int period = 0; period < 400; ++period) rig_.advance();
  }
  std::string asked(const std::string& line) { return shape(words_.reply(bottle(line))); }
  FakeTaskRig rig_;
  CartesianWords words_{rig_.hand(), "right_arm"};
};

TEST_F(IcubHand, AnswersHaveTheShapeThatClientsRead) {
  for (const Exchange& exchange : exchanges("hand")) {
    EXPECT_EQ(asked(exchange.asked), shape(bottle(exchange.answered))) << exchange.asked;
    if (!exchange.asked.starts_with("[get]")) let_it_arrive();
  }
}

TEST_F(IcubHand, NonsenseIsRefusedWithAReason) {
  for (const char* line : {"[tvel] (0 0 0.1)",
                           "[even] [regi] [ogoi] 2.0",
                           "[even] [dance]",
                           "[get] [pose] 10",
                           "[get] [pose] -1",
                           "[get] [lim] 10",
                           "[set] [lim] 0 -1000.0 1000.0",
                           "[set] [lim] 0 5.0",
                           "[set] [time] -1",
                           "[set] [dof] (a b)",
                           "[set] [tip] (0.1 0.0 0.0)",
                           "[set] [tip] (0.1 0.0 0.0 0.0 0.0 0.0 1.0)",
                           "[set] [refe] [true]",
                           "[set] [twea] ((a 1))",
                           "[go] [full] 1.0 (0 0 0)",
                           "[go] [full] 1.0 (0 0 0 0 0 0 1)",
                           "[go] [xyz] 1.0 (a b c)",
                           "[go]",
                           "",
                           "(((1)))",
                           "[rest] 99999999999999"}) {
    EXPECT_EQ(asked(line), "[nack] \"\"") << line;
  }
  EXPECT_EQ(asked("[del] ((1) x 1e300)"), "[ack]");
}

TEST_F(IcubHand, GoesWhereAClientSends) {
  const CartesianState before = *rig_.hand().state();
  Bottle pose = CartesianWords::pose_vector(before);
  ASSERT_EQ(pose.size(), 7U);
  pose[0] = yarp::Value::of(pose[0].as_number() - 0.05);
  pose[2] = yarp::Value::of(pose[2].as_number() + 0.06);
  EXPECT_EQ(shape(words_.reply({yarp::Value::word("go"), yarp::Value::word("full"), yarp::Value::of(1.0),
                                yarp::Value::list(pose)})),
            "[ack]");
  rig_.advance();
  EXPECT_TRUE(words_.reply(bottle("[get] [done]")).at(1).is_word("fals"));
  let_it_arrive();
  EXPECT_TRUE(words_.reply(bottle("[get] [done]")).at(1).is_word("true"));
  const CartesianState after = *rig_.hand().state();
  EXPECT_NEAR(after.X_RootPalm.translation().x(), before.X_RootPalm.translation().x() - 0.05, 0.002);
  EXPECT_NEAR(after.X_RootPalm.translation().z(), before.X_RootPalm.translation().z() + 0.06, 0.002);
  EXPECT_LT(Eigen::AngleAxisd(before.X_RootPalm.linear().transpose() * after.X_RootPalm.linear()).angle(),
            0.02);
  EXPECT_EQ(asked("[go] [xyz] 1.0 (-3 0 0)"), "[nack] \"\"") << "out of reach";
}

TEST_F(IcubHand, ASpeedHoldsWhileItIsFollowedAndNoLonger) {
  const auto height_m = [&] { return rig_.hand().state()->X_RootPalm.translation().z(); };
  const auto follow = [&](int periods) {
    for (int period = 0; period < periods; ++period) {
      rig_.advance();
      ASSERT_TRUE(words_.follow(*rig_.hand().state()).ok());
    }
  };
  const double before_m = height_m();
  ASSERT_EQ(asked("[tvel] (0.0 0.0 0.05 0.0 0.0 1.0 0.0)"), "[ack]");
  follow(100);
  EXPECT_NEAR(height_m() - before_m, 0.05, 0.01) << "a second of it";
  // the client is gone
  words_.let_go_of_speed();
  EXPECT_FALSE(words_.keeps_speed());
  follow(12);
  EXPECT_FALSE(rig_.hand().state()->moving);
  // what somebody else orders is not undone
  ASSERT_EQ(asked("[tvel] (0.0 0.0 -0.05 0.0 0.0 1.0 0.0)"), "[ack]");
  follow(10);
  EXPECT_TRUE(words_.keeps_speed());
  CartesianGoal up;
  up.X_RootPalm = rig_.hand().state()->X_RootPalm;
  up.X_RootPalm.translation().z() += 0.05;
  ASSERT_TRUE(rig_.hand().go_to(up).ok());
  follow(400);
  EXPECT_FALSE(words_.keeps_speed());
  EXPECT_LT(rig_.hand().state()->position_error_m, 0.003);
}

class IcubGaze : public testing::Test {
 protected:
  std::string asked(const std::string& line) { return shape(words_.reply(bottle(line))); }
  void let_it_arrive() {
    for (int period = 0; period < 400; ++period) {
      rig_.advance();
      ASSERT_TRUE(words_.follow(*rig_.gaze().state()).ok());
    }
  }
  FakeTaskRig rig_;
  GazeWords words_{rig_.gaze()};
};

TEST_F(IcubGaze, AnswersHaveTheShapeThatClientsRead) {
  for (const Exchange& exchange : exchanges("gaze")) {
    EXPECT_EQ(asked(exchange.asked), shape(bottle(exchange.answered))) << exchange.asked;
    if (!exchange.asked.starts_with("get")) let_it_arrive();
  }
}

TEST_F(IcubGaze, NonsenseIsRefusedWithAReason) {
  for (const char* line : {"get",
                           "get pose",
                           "get 2D",
                           "get 2D (up 1 2 3)",
                           "get 3D mono",
                           "get 3D mono (left 1 2)",
                           "get 3D proj (left 1 2 0 0 0 1)",
                           "get 3D ang (abs 170 0 5)",
                           "get ang (1 2)",
                           "set Tneck 0.0",
                           "set Tneck soon",
                           "set vor 1.5",
                           "set ocr 0.5",
                           "set sact -1.0",
                           "set sacc often",
                           "set tweak ((a 1))",
                           "set pid 1",
                           "bind",
                           "bind pitch 1",
                           "bind ear 1 2",
                           "clear ear",
                           "register ongoing 2",
                           "register done 0.5",
                           "look 3D",
                           "look 3D (1 2)",
                           "look up (1 2 3)",
                           "look mono (left 1 2 ver)",
                           "rest 77",
                           "quit",
                           ""}) {
    EXPECT_EQ(asked(line), "[nack] \"\"") << line;
  }
  EXPECT_EQ(GazeWords::fixation_vector(*rig_.gaze().state()).size(), 3U);
  EXPECT_EQ(GazeWords::angles_vector(*rig_.gaze().state()).size(), 3U);
  EXPECT_EQ(GazeWords::joints_vector(*rig_.gaze().state()).size(), 9U);
}

TEST_F(IcubGaze, LooksWhereAClientPoints) {
  ASSERT_TRUE(words_.look("3D", bottle("-0.5 0.1 0.15")).ok());
  EXPECT_TRUE(words_.has_target());
  let_it_arrive();
  EXPECT_FALSE(words_.has_target()) << "without tracking it is let go when it is reached";
  EXPECT_LT((rig_.gaze().state()->p_RootFixation_m - Eigen::Vector3d(-0.5, 0.1, 0.15)).norm(), 0.03);
  words_.reply(bottle("set track 1"));
  ASSERT_TRUE(words_.look("ang", bottle("abs 10 -10 6")).ok());
  let_it_arrive();
  EXPECT_TRUE(words_.has_target()) << "with tracking it is kept in sight";
  const Bottle angles = GazeWords::angles_vector(*rig_.gaze().state());
  EXPECT_NEAR(angles[0].as_number(), 10, 0.5);
  EXPECT_NEAR(angles[1].as_number(), -10, 0.5);
  ASSERT_TRUE(words_.look("mono", bottle("right 160 120 0.5")).ok());
  ASSERT_TRUE(words_.look("ster", bottle("160 100 160 100")).ok());
  for (const char* nonsense : {"", "1 2", "nan 1 2", "a b c", "(1 2 3)", "1 2 3 4 5"}) {
    for (const char* kind : {"3D", "mono", "ster", "ang"}) {
      EXPECT_FALSE(words_.look(kind, bottle(nonsense)).ok()) << kind << " " << nonsense;
    }
  }
}

// The numbers of an answer [ack] (...).
std::vector<double> numbers(const Bottle& answer) {
  std::vector<double> found;
  if (answer.size() < 2) return found;
  for (const yarp::Value& value : answer[1].items) found.push_back(value.as_number());
  return found;
}

TEST_F(IcubGaze, PixelsAndPointsBelongTogether) {
  ASSERT_TRUE(words_.look("3D", bottle("-0.5 0.1 0.1")).ok());
  let_it_arrive();
  const Eigen::Vector3d p_m(-0.55, 0.15, 0.15);
  const auto told = [&](const std::string& line) { return numbers(words_.reply(bottle(line))); };
  const std::vector<double> left = told("get 2D (left -0.55 0.15 0.15)");
  const std::vector<double> right = told("get 2D (right -0.55 0.15 0.15)");
  ASSERT_EQ(left.size(), 2U);
  ASSERT_EQ(right.size(), 2U);
  const Eigen::Isometry3d X_EyeRoot = rig_.gaze().state()->X_RootEyes[0].inverse();
  for (const std::string& line :
       {fmt::format("get 3D stereo ({} {} {} {})", left[0], left[1], right[0], right[1]),
        fmt::format("get 3D mono (left {} {} {})", left[0], left[1], (X_EyeRoot * p_m).z()),
        fmt::format("get 3D proj (left {} {} 2.0 0.0 0.0 1.1)", left[0], left[1])}) {
    const std::vector<double> n = told(line);
    ASSERT_EQ(n.size(), 3U) << line;
    EXPECT_LT((Eigen::Vector3d(n[0], n[1], n[2]) - p_m).norm(), 1e-4) << line;
  }
  const std::vector<double> there = told("get 3D ang (abs 10.0 -10.0 5.0)");
  ASSERT_EQ(there.size(), 3U);
  const std::vector<double> angles = told(fmt::format("get ang ({} {} {})", there[0], there[1], there[2]));
  ASSERT_EQ(angles.size(), 3U);
  EXPECT_NEAR(angles[0], 10, 1e-6);
  EXPECT_NEAR(angles[1], -10, 1e-6);
  EXPECT_NEAR(angles[2], 5, 1e-6);
}

TEST_F(IcubGaze, ABoundNeckStaysInItsRangeUntilTheContextComesBack) {
  ASSERT_EQ(asked("stor"), "[ack] #");
  ASSERT_EQ(asked("bind yaw -5.0 5.0"), "[ack]");
  ASSERT_TRUE(words_.look("3D", bottle("-0.5 0.2 0.2")).ok());
  let_it_arrive();
  EXPECT_LT(std::abs(rig_.gaze().state()->head_rad[2]), 0.09);
  ASSERT_EQ(asked("rest 1"), "[ack]");
  EXPECT_GT(rig_.gaze().settings()->neck_upper_rad[2], 0.5);
}

TEST_F(IcubGaze, SaccadesAndTheEyesShareAreTheDevices) {
  ASSERT_EQ(asked("set sact 20.0"), "[ack]");
  EXPECT_FALSE(rig_.gaze().settings()->saccades.has_value()) << "how they would be, not that they are";
  ASSERT_EQ(asked("set sacc 1"), "[ack]");
  ASSERT_TRUE(rig_.gaze().settings()->saccades.has_value());
  EXPECT_NEAR(rig_.gaze().settings()->saccades->from_rad, 20 * 3.14159265358979 / 180, 1e-9);
  ASSERT_EQ(asked("set sinh -1.0"), "[ack]") << "clients say \"at once\" so";
  EXPECT_EQ(rig_.gaze().settings()->saccades->apart_s, 0);
  EXPECT_EQ(words_.reply(bottle("get sacc")).at(1).as_number(), 1);
  ASSERT_EQ(asked("set vor 0.5"), "[ack]");
  EXPECT_EQ(rig_.gaze().settings()->eyes_make_up, 0.5);
  EXPECT_EQ(words_.reply(bottle("get vor")).at(1).as_number(), 0.5);
  ASSERT_EQ(asked("rest 0"), "[ack]");
  EXPECT_FALSE(rig_.gaze().settings()->saccades.has_value());
}

TEST_F(IcubGaze, AStabilizedGazeKeepsWhatItSees) {
  ASSERT_TRUE(words_.look("3D", bottle("-0.5 0.1 0.15")).ok());
  let_it_arrive();
  ASSERT_EQ(asked("set stab 1"), "[ack]");
  EXPECT_EQ(words_.reply(bottle("get stab")).at(1).as_number(), 1);
  const Eigen::Vector3d seen_m = rig_.gaze().state()->p_RootFixation_m;
  // the torso turns with the hand
  CartesianGoal goal;
  goal.X_RootPalm = rig_.hand().state()->X_RootPalm;
  goal.X_RootPalm.translation() += Eigen::Vector3d(-0.08, -0.08, 0.0);
  goal.with_orientation = false;
  ASSERT_TRUE(rig_.hand().go_to(goal).ok());
  const Eigen::Vector3d torso_rad = rig_.gaze().state()->torso_rad;
  let_it_arrive();
  ASSERT_GT((rig_.gaze().state()->torso_rad - torso_rad).norm(), 0.02);
  EXPECT_LT((rig_.gaze().state()->p_RootFixation_m - seen_m).norm(), 0.01);
  ASSERT_EQ(asked("stop"), "[ack]");
  EXPECT_EQ(words_.reply(bottle("get stab")).at(1).as_number(), 0);
}

TEST(MotionEvents, AShareIsToldOnceInEachMotion) {
  gateway::MotionEvents events;
  ASSERT_EQ(shape(events.reply(bottle("register ongoing 0.5"), 0).value_or(Bottle{})), "[ack]");
  const auto told = [&](bool moving, double progress) {
    std::string names;
    for (const Bottle& event : events.follow(moving, progress, 0)) names += event[0].text.substr(7) + " ";
    return names;
  };
  EXPECT_EQ(told(false, 1), "");
  EXPECT_EQ(told(true, 0.1), "onset ");
  EXPECT_EQ(told(true, 0.6), "ongoing ");
  EXPECT_EQ(told(true, 0.7), "");
  EXPECT_EQ(told(true, 0.2), "") << "another motion, before the first one was over";
  EXPECT_EQ(told(true, 0.5), "ongoing ");
  EXPECT_EQ(told(false, 1), "done ");
  EXPECT_EQ(told(true, 0), "onset ");
  EXPECT_EQ(told(false, 0.3), "done ") << "stopped on its way";
  EXPECT_FALSE(events.reply(bottle("register ongoing 2"), 0).has_value());
  EXPECT_EQ(shape(events.reply(bottle("unregister ongoing 0.5"), 0).value_or(Bottle{})), "[ack]");
  EXPECT_EQ(shape(events.reply(bottle("unregister ongoing 0.5"), 0).value_or(Bottle{})), "[nack] \"\"");
}

// With the ports of a whole system between them.
TEST(IcubTasks, ClientsFindTheControllersThatTheyExpect) {
  FakeTaskRig rig;
  GatewayLink link;
  const auto hand = required(serve_cartesian(link.server(), link.stem("cartesian/right_arm"), rig.hand()));
  const auto gaze = required(serve_gaze(link.server(), link.stem("gaze"), rig.gaze()));
  const std::string controller = link.stem("cartesianController/right_arm");
  for (const char* end : {"/rpc:i", "/command:i", "/state:o", "/events:o"}) link.wait_for(controller + end);
  for (const char* end :
       {"/rpc", "/xd:i", "/mono:i", "/stereo:i", "/angles:i", "/x:o", "/angles:o", "/q:o", "/events:o"}) {
    link.wait_for(std::string("/iKinGazeCtrl") + end);
  }
  EXPECT_EQ(shape(required(link.network()->ask(controller + "/rpc:i", bottle("[get] [ison]")))),
            "[ack] [truth]");
  EXPECT_EQ(shape(required(link.network()->ask("/iKinGazeCtrl/rpc", bottle("get done")))), "[ack] #");
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, std::size_t> numbers;  // of each output
  std::vector<std::unique_ptr<yarp::Network::Subscription>> outputs;
  for (const auto& [port, local] : std::vector<std::pair<std::string, std::string>>{
           {controller + "/state:o", "/hand"}, {"/iKinGazeCtrl/x:o", "/x"}, {"/iKinGazeCtrl/q:o", "/q"}}) {
    outputs.push_back(required(link.network()->subscribe(
        port, local + ":i", 10'000, [&, name = local](const std::string& bytes, const std::string&) {
          const auto decoded = yarp::decode_any(bytes, yarp::Dialect::k3);
          const std::lock_guard lock(mutex);
          numbers[name] = decoded ? decoded->bottle.size() : 0;
          changed.notify_all();
        })));
  }
  std::unique_lock lock(mutex);
  ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(60), [&] { return numbers.size() == 3; }));
  EXPECT_EQ(numbers["/hand"], 7U);
  EXPECT_EQ(numbers["/x"], 3U);
  EXPECT_EQ(numbers["/q"], 9U);
  lock.unlock();
  // a pose that is streamed is gone to
  const auto target = required(link.network()->stream_to("/iKinGazeCtrl/xd:i", "/xd:o"));
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!rig.gaze().state()->moving && std::chrono::steady_clock::now() < until) {
    ASSERT_TRUE(target->send(bottle("-0.4 0.2 0.1")).ok());
    rig.advance();
  }
  EXPECT_TRUE(rig.gaze().state()->moving);
}

}  // namespace
}  // namespace nido::test
