#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace nido::bench {

// A program of others that a benchmark's rivals need, without output. Killed when this object goes or this
// process dies.
class Server {
 public:
  explicit Server(const std::vector<std::string>& words);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

 private:
  pid_t pid_ = -1;
};

}  // namespace nido::bench
