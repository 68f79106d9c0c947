#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/yarp/bottle.h"

namespace nido::yarp {

// Where a port listens.
struct Contact {
  std::string name;  // "/icubSim/head/state:o"
  std::string host;  // "127.0.0.1"
  int port = 0;      // TCP
  std::string carrier = "tcp";
};

// "registration name /x ip 127.0.0.1 port 10002 type tcp", and the way back.
[[nodiscard]] std::string to_line(const Contact& contact);
[[nodiscard]] std::optional<Contact> contact_from_line(std::string_view line);
// What ends every answer of a name server.
inline constexpr std::string_view kEndOfAnswer = "*** end of message";

// The names of a YARP network, and the words in which YARP 3 asks for them. Holds a bounded number of names
// and properties. Not thread-safe.
class NameRegistry {
 public:
  struct Options {
    std::string own_name = "/root";
    std::string host = "127.0.0.1";
    int own_port = 10000;    // of the server itself
    int first_port = 10002;  // given out from here on
    int last_port = 19999;
    std::size_t names = 10'000;
    std::size_t properties = 64;        // of one name
    std::size_t property_bytes = 4096;  // of one property
  };
  explicit NameRegistry(Options options);

  // One request ("register /x tcp ... ..."), answered in lines that end in "\r\n", the last one kEndOfAnswer.
  // `from_host`: the address of who asks. What is wrong is said in a line, and changes nothing.
  [[nodiscard]] std::string answer(std::string_view request, const std::string& from_host);
  // The same for requests that begin with "bot", and for binary connections: a Bottle.
  [[nodiscard]] Bottle answer_bottle(const Bottle& request, const std::string& from_host);

  // Names of this process: nobody else can take or drop them.
  void add_own(const Contact& contact);
  void remove_own(const std::string& name);

  // Whether a port number belongs to a name, or was given to one.
  [[nodiscard]] bool is_taken(int port) const { return taken_.contains(port); }
  [[nodiscard]] std::optional<Contact> find(const std::string& name) const;
  [[nodiscard]] std::vector<Contact> list(const std::string& prefix) const;

 private:
  struct Entry {
    Contact contact;
    bool own = false;
    std::map<std::string, Bottle> properties;
  };
  Result<Contact> enter(const Bottle& request, const std::string& from_host);
  Result<std::vector<std::string>> lines(const Bottle& request, const std::string& from_host);
  [[nodiscard]] int free_port();

  Options options_;
  std::map<std::string, Entry> entries_;
  std::map<std::string, int> numbers_before_;  // ports of names that went: they get them back
  std::multiset<int> taken_;
  int next_port_;
  int next_anonymous_ = 1;
};

}  // namespace nido::yarp
