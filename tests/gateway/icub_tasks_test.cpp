// What clients of iCub's controllers of hand and gaze say, answered by nido's devices.

#include "nido/gateway/icub_tasks.h"

#include <atomic>
#include <condition_variable>
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
    } else if (word.kind == yarp::Value::Kind::kWord) {
      text += "[" + word.text + "]";
    } else {
      text += "\"\"";
    }
  }
  return text;
}

class IcubHand : public testing::Test {
 protected:
  std::string asked(const std::string& line) { return shape(words_.reply(bottle(line))); }
  FakeTaskRig rig_;
  CartesianWords words_{rig_.hand(), "right_arm", [](int axis) -> Result<std::pair<double, double>> {
                          return std::pair(-10.0 * axis, 10.0 * axis);
                        }};
};

TEST_F(IcubHand, AnswersHaveTheShapeThatClientsRead) {
  const std::string ten = "(# # # # # # # # # #)";
  const std::string pose = "(# # # # # # #)";
  for (const auto& [line, expected] : std::vector<std::pair<std::string, std::string>>{
           {"[get] [info]", "[ack] ((\"\" \"\") (\"\" \"\"))"},
           {"[get] [ison]", "[ack] [true]"},
           {"[get] [mode]", "[ack] [shot]"},
           {"[set] [mode] [cont]", "[ack]"},
           {"[get] [mode]", "[ack] [cont]"},
           {"[get] [refe]", "[ack] [fals]"},
           {"[get] [prio]", "[ack] \"\""},
           {"[set] [prio] orientation", "[ack]"},
           {"[get] [time]", "[ack] #"},
           {"[set] [time] 1.5", "[ack]"},
           {"[get] [tol]", "[ack] #"},
           {"[get] [done]", "[ack] [true]"},
           {"[get] [pose]", "[ack] " + pose + " (# #)"},
           {"[get] [pose] 9", "[ack] " + pose + " (# #)"},
           {"[get] [dof]", "[ack] " + ten},
           {"[set] [dof] (0 0 0 1 1 1 1 1 1 1)", "[ack] " + ten},
           {"[get] [resp]", "[ack] " + ten},
           {"[get] [resw]", "[ack] " + ten},
           {"[get] [lim] 4", "[ack] # #"},
           {"[get] [des]", "[ack] ([x] " + pose + ") ([q] " + ten + ")"},
           {"[get] [tip]", "[ack] " + pose},
           {"[set] [tip] (0.0 0.0 0.0 0.0 0.0 0.0 0.0)", "[ack]"},
           {"[stor]", "[ack] #"},
           {"[rest] 1", "[ack]"},
           {"[del] (1)", "[ack]"},
           {"[rest] 1", "[nack] \"\""},
           {"[rest] 0", "[ack]"},
           {"[stop]", "[ack]"},
           {"[ask] ([xd] (-0.25 0.2 0.1)) ([pose] [xyz])", "[ack] ([x] " + pose + ") ([q] " + ten + ")"},
           // what nido's hands do not do, and nonsense
           {"[tvel] (0 0 0.1 0 0 0 0)", "[nack] \"\""},
           {"[even] [regi] [ogoi] 0.5", "[nack] \"\""},
           {"[get] [pose] 3", "[nack] \"\""},
           {"[get] [pose] -1", "[nack] \"\""},
           {"[get] [lim] 10", "[nack] \"\""},
           {"[set] [time] -1", "[nack] \"\""},
           {"[set] [tip] (0.1 0.0 0.0 0.0 0.0 1.0 0.5)", "[nack] \"\""},
           {"[go] [full] 1.0 (0 0 0)", "[nack] \"\""},
           {"[go] [full] 1.0 (0 0 0 0 0 0 1)", "[nack] \"\""},
           {"[go] [xyz] 1.0 (a b c)", "[nack] \"\""},
           {"[go]", "[nack] \"\""},
           {"", "[nack] \"\""},
           {"(((1)))", "[nack] \"\""},
           {"[rest] 99999999999999", "[nack] \"\""},
           {"[del] ((1) x 1e300)", "[ack]"}}) {
    EXPECT_EQ(asked(line), expected) << line;
  }
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
  EXPECT_EQ(asked("[get] [done]"), "[ack] [fals]");
  for (int period = 0; period < 400; ++period) rig_.advance();
  EXPECT_EQ(asked("[get] [done]"), "[ack] [true]");
  const CartesianState after = *rig_.hand().state();
  EXPECT_NEAR(after.X_RootPalm.translation().x(), before.X_RootPalm.translation().x() - 0.05, 0.002);
  EXPECT_NEAR(after.X_RootPalm.translation().z(), before.X_RootPalm.translation().z() + 0.06, 0.002);
  EXPECT_LT(Eigen::AngleAxisd(before.X_RootPalm.linear().transpose() * after.X_RootPalm.linear()).angle(),
            0.02);
  EXPECT_EQ(asked("[go] [xyz] 1.0 (-3 0 0)"), "[nack] \"\"") << "out of reach";
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
  for (const auto& [line, expected] :
       std::vector<std::pair<std::string, std::string>>{{"get info", "[ack] ((\"\" \"\"))"},
                                                        {"get track", "[ack] #"},
                                                        {"set track 1", "[ack]"},
                                                        {"[set] [trac] 0", "[ack]"},
                                                        {"get done", "[ack] #"},
                                                        {"get sdon", "[ack] #"},
                                                        {"get pose left", "[ack] (# # # # # # #) (# #)"},
                                                        {"get pose right", "[ack] (# # # # # # #) (# #)"},
                                                        {"get des", "[ack] (# # # # # # # # #)"},
                                                        {"look 3D (-0.5 0.1 0.1)", "[ack]"},
                                                        {"look mono (left 160 100 0.5)", "[ack]"},
                                                        {"look ang (abs 5.0 -5.0 5.0)", "[ack]"},
                                                        {"stop", "[ack]"},
                                                        {"stor", "[ack] #"},
                                                        {"rest 1", "[ack]"},
                                                        {"del (1)", "[ack]"},
                                                        {"rest 1", "[nack] \"\""},
                                                        {"clear pitch", "[ack]"},
                                                        {"bind pitch -5 5", "[nack] \"\""},
                                                        {"get Tneck", "[nack] \"\""},
                                                        {"set Teyes 0.2", "[nack] \"\""},
                                                        {"get pose", "[nack] \"\""},
                                                        {"look 3D", "[nack] \"\""},
                                                        {"look 3D (1 2)", "[nack] \"\""},
                                                        {"look up (1 2 3)", "[nack] \"\""},
                                                        {"quit", "[nack] \"\""},
                                                        {"", "[nack] \"\""}}) {
    EXPECT_EQ(asked(line), expected) << line;
  }
  EXPECT_EQ(GazeWords::fixation_vector(*rig_.gaze().state()).size(), 3U);
  EXPECT_EQ(GazeWords::angles_vector(*rig_.gaze().state()).size(), 3U);
  EXPECT_EQ(GazeWords::joints_vector(*rig_.gaze().state()).size(), 9U);
}

TEST_F(IcubGaze, LooksWhereAClientPoints) {
  ASSERT_TRUE(words_.point(bottle("-0.5 0.1 0.15")).ok());
  EXPECT_TRUE(words_.has_target());
  let_it_arrive();
  EXPECT_FALSE(words_.has_target()) << "without tracking it is let go when it is reached";
  EXPECT_LT((rig_.gaze().state()->p_RootFixation_m - Eigen::Vector3d(-0.5, 0.1, 0.15)).norm(), 0.03);
  words_.reply(bottle("set track 1"));
  ASSERT_TRUE(words_.angles(bottle("abs 10 -10 6")).ok());
  let_it_arrive();
  EXPECT_TRUE(words_.has_target()) << "with tracking it is kept in sight";
  const Bottle angles = GazeWords::angles_vector(*rig_.gaze().state());
  EXPECT_NEAR(angles[0].as_number(), 10, 0.5);
  EXPECT_NEAR(angles[1].as_number(), -10, 0.5);
  ASSERT_TRUE(words_.mono(bottle("right 160 120 0.5")).ok());
  ASSERT_TRUE(words_.stereo(bottle("160 100 160 100")).ok());
  for (const char* nonsense : {"", "1 2", "nan 1 2", "a b c", "(1 2 3)", "1 2 3 4 5"}) {
    EXPECT_FALSE(words_.point(bottle(nonsense)).ok()) << nonsense;
    EXPECT_FALSE(words_.mono(bottle(nonsense)).ok()) << nonsense;
    EXPECT_FALSE(words_.stereo(bottle(nonsense)).ok()) << nonsense;
    EXPECT_FALSE(words_.angles(bottle(nonsense)).ok()) << nonsense;
  }
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
            "[ack] [true]");
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
