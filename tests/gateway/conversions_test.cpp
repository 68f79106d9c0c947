// How messages look on the other side, and back.

#include "nido/gateway/conversions.h"

#include <gtest/gtest.h>

#include <numbers>

#include "nido/msgs/types.h"

namespace nido::gateway {
namespace {

const AnyType& type(const std::string& name) {
  const AnyType* found = find_any_type(name);
  if (found == nullptr) throw std::runtime_error(name);
  return *found;
}

yarp::Incoming line(const std::string& text, const std::string& envelope = {}) {
  yarp::Incoming incoming;
  incoming.bytes = text;
  incoming.is_text = true;
  incoming.envelope = envelope;
  return incoming;
}

TEST(Conversions, EveryTypeComesBackAsItWas) {
  for (const AnyType& any : any_types()) {
    const std::shared_ptr<void> message = any.type.make_message();
    const Json before = any.to_json(message.get(), 0);
    const std::shared_ptr<void> again = any.type.make_message();
    const Result<Json> json = json_of(bottle_of(before), any.to_json(again.get(), 0));
    ASSERT_TRUE(json.ok()) << any.name << ": " << json.error().message;
    const Status taken = any.from_json(*json, again.get());
    ASSERT_TRUE(taken.ok()) << any.name << ": " << taken.error().message;
    EXPECT_EQ(any.to_json(again.get(), 0), before) << any.name;
  }
}

TEST(Conversions, NothingIsLostOfAFullMessage) {
  msgs::Percepts percepts;
  percepts.header().stamp().sec(7);
  msgs::Percept cube;
  cube.name("blue cube");
  cube.confidence(0.75);
  cube.position().x(-0.3);
  percepts.objects({cube, cube});
  const AnyType& any = type("nido_msgs/msg/Percepts");
  const Json before = any.to_json(&percepts, 0);
  for (const yarp::Dialect dialect : {yarp::Dialect::k3, yarp::Dialect::k4}) {
    yarp::Incoming incoming;
    incoming.bytes = yarp::encode(bottle_of(before), dialect);
    incoming.dialect = dialect;
    msgs::Percepts again;
    const Status taken = take_into(any, incoming, 0, &again);
    ASSERT_TRUE(taken.ok()) << taken.error().message;
    EXPECT_EQ(any.to_json(&again, 0), before);
  }
  // and by hand
  msgs::Percepts typed;
  ASSERT_TRUE(take_into(any, line(yarp::to_text(bottle_of(before))), 0, &typed).ok());
  EXPECT_EQ(any.to_json(&typed, 0), before);
}

TEST(Conversions, JointStatesAreVectorsOfDegrees) {
  msgs::JointState state;
  state.header().stamp().sec(3);
  state.position({std::numbers::pi / 2, -std::numbers::pi});
  state.velocity({0, std::numbers::pi});
  state.effort({1, 2});
  const auto modes = std::make_shared<Modes>();
  modes->set({ControlMode::kPosition, ControlMode::kVelocity});
  const std::vector<View> views = views_of("/r/arm/state:o", type("sensor_msgs/msg/JointState"), modes);
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[0].content(&state).text(), "90.0 -180.0");
  EXPECT_DOUBLE_EQ(views[0].time_s(&state), 3.0);
  EXPECT_EQ(views[1].name, "/r/arm/stateExt:o");
  EXPECT_EQ(
      views[1].content(&state).text(),
      "(90.0 -180.0) [ok] (0.0 180.0) [ok] (0.0 0.0) [ok] (90.0 -180.0) [ok] (0.0 180.0) [ok] (0.0 0.0) [ok] "
      "(1.0 2.0) [ok] (0.0 0.0) [fail] (0.0 0.0) [fail] (7565168 7103862) [ok] (1718187123 1718187123) [ok]");
}

TEST(Conversions, TouchedPadsAreTaxels) {
  msgs::Touch touch;
  touch.on({true, false, false, false, false, true});
  touch.force_n({1, 0, 0, 0, 0, 2});
  const std::vector<View> views = views_of("/r/skin/left_hand:o", type("nido_msgs/msg/Touch"), nullptr);
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[1].name, "/r/skin/left_hand_comp");
  const yarp::Bottle taxels = *yarp::parse_bottle(views[1].content(&touch).text());
  ASSERT_EQ(taxels.size(), 192U);
  for (std::size_t i = 0; i < taxels.size(); ++i) {
    const bool is_on = (i >= 48 && i < 60) || (i >= 96 && i < 144);
    EXPECT_EQ(taxels[i].number, is_on ? 255 : 0) << i;
  }
}

TEST(Conversions, APatchOfSkinIsItsTaxels) {
  msgs::Touch touch;
  touch.on(std::vector<bool>(384, false));
  touch.force_n(std::vector<double>(384, 0.0));
  touch.force_n()[17] = 0.2;
  touch.force_n()[383] = 7;
  const std::vector<View> views = views_of("/r/skin/left_forearm:o", type("nido_msgs/msg/Touch"), nullptr);
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[1].name, "/r/skin/left_forearm_comp");
  const yarp::Bottle taxels = *yarp::parse_bottle(views[1].content(&touch).text());
  ASSERT_EQ(taxels.size(), 384U);
  for (std::size_t i = 0; i < taxels.size(); ++i)
    EXPECT_NEAR(taxels[i].as_number(), i == 17 ? 51 : i == 383 ? 255 : 0, 1e-9) << i;
}

TEST(Conversions, AnInertialSensorIsOneOfManySensorsToo) {
  msgs::Imu imu;
  imu.header().stamp().sec(2);
  imu.orientation().w(1);
  imu.linear_acceleration().z(9.5);
  imu.angular_velocity().x(std::numbers::pi);
  const std::vector<View> views = views_of("/r/inertial:o", type("sensor_msgs/msg/Imu"), nullptr);
  ASSERT_EQ(views.size(), 3U);
  EXPECT_EQ(views[1].name, "/r/inertial");
  EXPECT_EQ(views[1].content(&imu).text(), "0.0 0.0 0.0 0.0 0.0 9.5 180.0 0.0 0.0 0.0 0.0 0.0");
  EXPECT_EQ(views[2].name, "/r/head/inertials/measures:o");
  EXPECT_EQ(views[2].content(&imu).text(),
            "(((180.0 0.0 0.0) 2.0)) (((0.0 0.0 9.5) 2.0)) () (((0.0 0.0 0.0) 2.0)) () () () () () () () ()");
}

TEST(Conversions, TheClockIsWhatYarpsProgramsFollow) {
  msgs::Clock now;
  now.clock().sec(7);
  now.clock().nanosec(20'000'000);
  const std::vector<View> views = views_of("/clock", type("rosgraph_msgs/msg/Clock"), nullptr);
  ASSERT_EQ(views.size(), 1U);
  EXPECT_EQ(views[0].content(&now).text(), "7 20000000");
}

TEST(StreamCommands, AreThoseOfYarpsBoards) {
  const auto parse = [](const char* text) { return parse_stream_command(*yarp::parse_bottle(text)); };
  const StreamCommand one = *parse("([dpo] 3) (45.0)");
  EXPECT_EQ(one.mode, ControlMode::kDirect);
  EXPECT_EQ(one.joints, std::vector<int>{3});
  EXPECT_NEAR(one.values[0], std::numbers::pi / 4, 1e-12);
  const StreamCommand group = *parse("(([vmog] 2 (1 0)) (180.0 -180))");
  EXPECT_EQ(group.mode, ControlMode::kVelocity);
  EXPECT_EQ(group.joints, (std::vector<int>{1, 0}));
  EXPECT_NEAR(group.values[1], -std::numbers::pi, 1e-12);
  EXPECT_EQ(parse("([torq] [dtqs]) (1.5 2.5)")->mode, ControlMode::kTorque);
  EXPECT_EQ(parse("([dtqs]) (1.5 2.5)")->joints, (std::vector<int>{0, 1}));
  EXPECT_NEAR(parse("([ipwm] [ref] 2) (50.0)")->values[0], 0.5, 1e-12);
  EXPECT_EQ(parse("([ipod] [dpo] 3) (45.0)")->mode, ControlMode::kDirect) << "version 4";
  for (const char* text : {"", "(dpo 3)", "(dpo 3) 45.0", "(dpo) (45.0)", "(dpo 3) (45.0 46.0)",
                           "(dpo -1) (45.0)", "(dpog 3 (0 1)) (1 2)", "(dpog 2 (0 1)) (1)", "(fly 1) (2)",
                           "([icur] [ref] 1) (2)", "(dpo x) (1)", "(dpo 1) (x)", "(dpo 99999999999) (1)"}) {
    EXPECT_FALSE(parse(text).ok()) << text;
  }
}

TEST(Conversions, TheEnvelopeIsTheTime) {
  msgs::JointCommand command;
  ASSERT_TRUE(
      take_into(type("nido_msgs/msg/JointCommand"), line("(dpo 1) (5.0)", "3 12.25"), 99, &command).ok());
  EXPECT_EQ(command.header().stamp().sec(), 12);
  EXPECT_EQ(command.header().stamp().nanosec(), 250'000'000U);
  ASSERT_TRUE(
      take_into(type("nido_msgs/msg/JointCommand"), line("(dpo 1) (5.0)"), 2'000'000'007, &command).ok());
  EXPECT_EQ(command.header().stamp().sec(), 2);
  EXPECT_EQ(command.header().stamp().nanosec(), 7U);
}

}  // namespace
}  // namespace nido::gateway
