// The name server's words: answers as YARP's own server gives them.

#include "nido/yarp/names.h"

#include <gtest/gtest.h>

namespace nido::yarp {
namespace {

class Names : public testing::Test {
 protected:
  std::string ask(const std::string& request) { return names_.answer(request, "127.0.0.1"); }
  // the lines before the end mark, which every answer has
  std::string lines(const std::string& request) {
    const std::string answer = ask(request);
    const std::string end = std::string(kEndOfAnswer) + "\r\n";
    EXPECT_TRUE(answer.ends_with(end)) << answer;
    return answer.substr(0, answer.size() - end.size());
  }
  NameRegistry names_{{}};
};

TEST_F(Names, RegisterQueryUnregister) {
  EXPECT_EQ(lines("register /a"), "registration name /a ip 127.0.0.1 port 10002 type tcp\r\n");
  EXPECT_EQ(lines("register /b tcp 127.0.0.1 10500"),
            "registration name /b ip 127.0.0.1 port 10500 type tcp\r\n");
  EXPECT_EQ(lines("register ..."), "registration name /tmp/port/1 ip 127.0.0.1 port 10003 type tcp\r\n");
  EXPECT_EQ(lines("register /v ... ... -1 yarp/image"),
            "registration name /v ip 127.0.0.1 port 10004 type tcp\r\n");
  EXPECT_EQ(lines("register /d udp"), "registration name /d ip 127.0.0.1 port 10005 type udp\r\n");
  EXPECT_EQ(lines("query /a"), "registration name /a ip 127.0.0.1 port 10002 type tcp\r\n");
  EXPECT_EQ(lines("query /zz"), "");
  EXPECT_EQ(lines("unregister /a"), "");
  EXPECT_EQ(lines("query /a"), "");
  EXPECT_EQ(lines("register /a"), "registration name /a ip 127.0.0.1 port 10002 type tcp\r\n")
      << "its old number";
}

TEST_F(Names, PropertiesAndRoutes) {
  lines("register /a");
  EXPECT_EQ(lines("set /a offers tcp text"), "port /a property offers = tcp text\r\n");
  EXPECT_EQ(lines("get /a offers"), "port /a property offers = tcp text\r\n");
  EXPECT_EQ(lines("get /a none"), "port /a property none =\r\n");
  EXPECT_EQ(lines("check /a offers tcp"), "port /a property offers value tcp present true\r\n");
  EXPECT_EQ(lines("check /a offers nope"), "port /a property offers value nope present false\r\n");
  EXPECT_EQ(lines("route /a /b"), "port /a route /b = tcp://b\r\n");
  EXPECT_EQ(lines("set /nope k v"), "");
}

TEST_F(Names, ListEndsWithTheFallback) {
  lines("register /a");
  EXPECT_EQ(lines("list"),
            "registration name /a ip 127.0.0.1 port 10002 type tcp\r\n"
            "registration name /root ip 127.0.0.1 port 10000 type tcp\r\n"
            "registration name fallback ip 224.2.1.1 port 10000 type mcast\r\n");
  EXPECT_EQ(lines("list /a"), "registration name /a ip 127.0.0.1 port 10002 type tcp\r\n");
  EXPECT_EQ(ask("bot list /a"),
            "ports (port (name \"/a\") (ip \"127.0.0.1\") (port_number 10002) (carrier tcp))\r\n");
}

TEST_F(Names, OwnNamesCannotBeTaken) {
  names_.add_own({"/icubSim/world", "127.0.0.1", 10'777, "tcp"});
  EXPECT_NE(lines("register /icubSim/world").find("error"), std::string::npos);
  EXPECT_NE(lines("unregister /root").find("error"), std::string::npos);
  EXPECT_NE(lines("query /icubSim/world").find("10777"), std::string::npos);
  names_.remove_own("/icubSim/world");
  EXPECT_EQ(lines("query /icubSim/world"), "");
}

TEST_F(Names, WhatIsWrongIsSaid) {
  for (const char* request :
       {"register \"two words\"", "register /x tcp 127.0.0.1 70000", "register /x tcp 127.0.0.1 -5",
        "register /x \"a b\"", "register (1 2", "query \"a"}) {
    EXPECT_NE(lines(request).find("error"), std::string::npos) << request;
  }
  EXPECT_EQ(lines("nonsense x"), "");
  EXPECT_EQ(lines(""), "");
}

TEST(NameLimits, MemoryIsBounded) {
  NameRegistry::Options options;
  options.names = 3;
  options.properties = 2;
  options.property_bytes = 10;
  NameRegistry names(options);
  EXPECT_EQ(names.answer("register /a", "127.0.0.1").find("error"), std::string::npos);
  EXPECT_EQ(names.answer("register /b", "127.0.0.1").find("error"), std::string::npos);
  EXPECT_NE(names.answer("register /c", "127.0.0.1").find("error"), std::string::npos);
  EXPECT_EQ(names.answer("register /a", "127.0.0.1").find("error"), std::string::npos);
  EXPECT_EQ(names.answer("set /a k 1", "x").find("error"), std::string::npos);
  EXPECT_EQ(names.answer("set /a l 1", "x").find("error"), std::string::npos);
  EXPECT_NE(names.answer("set /a m 1", "x").find("error"), std::string::npos);
  EXPECT_NE(names.answer("set /a k 123456789012345", "x").find("error"), std::string::npos);
}

TEST(Contact, LinesBothWays) {
  const Contact contact{"/a/b:o", "127.0.0.1", 10'003, "tcp"};
  EXPECT_EQ(contact_from_line(to_line(contact))->port, 10'003);
  EXPECT_EQ(contact_from_line(to_line(contact))->name, "/a/b:o");
  for (const char* line :
       {"", "registration name /a", "registration name /a ip 127.0.0.1 port 0 type tcp", "hello"}) {
    EXPECT_FALSE(contact_from_line(line).has_value()) << line;
  }
}

}  // namespace
}  // namespace nido::yarp
