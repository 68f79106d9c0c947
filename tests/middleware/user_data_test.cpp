#include "user_data.h"

#include <gtest/gtest.h>

namespace nido::testing {

namespace {

// as in the code that ROS 2's own generator writes for these messages
TEST(UserData, TheTypeHashesAreThoseOfRos2) {
  EXPECT_EQ(type_hash_of("std_msgs::msg::dds_::String_"),
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  EXPECT_EQ(type_hash_of("builtin_interfaces::msg::dds_::Time_"),
            "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197");
  EXPECT_EQ(type_hash_of("std_msgs::msg::dds_::Header_"),
            "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01");
  EXPECT_EQ(type_hash_of("sensor_msgs::msg::dds_::JointState_"),
            "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e");
  EXPECT_EQ(type_hash_of("rosgraph_msgs::msg::dds_::Clock_"),
            "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564");
  EXPECT_EQ(type_hash_of("no_msgs::msg::dds_::Such_"), "");
}

TEST(UserData, WhatIsToldIsUnderstood) {
  EndpointInfo info;
  const auto told = pack_user_data({"vision", "/vision/objects:o", "event", "std_msgs::msg::dds_::String_"});
  unpack_user_data(told, info);
  EXPECT_EQ(info.node, "vision");
  EXPECT_EQ(info.port, "/vision/objects:o");
  EXPECT_EQ(info.profile, "event");
  const std::string text(told.begin(), told.end());
  EXPECT_NE(text.find(";typehash=RIHS01_df668c"), std::string::npos) << text;
}

TEST(UserData, ThatOfOthersTellsNothing) {
  for (const std::string text :
       {"", "typehash=RIHS01_00;", "node=vision;port=/a:o;", ";;=;=", "nido", "nido=1"}) {
    EndpointInfo info;
    unpack_user_data({text.begin(), text.end()}, info);
    EXPECT_EQ(info.node + info.port + info.profile, "") << text;
  }
}

}  // namespace

}  // namespace nido::testing
