// A process that behaves as its first argument says; prints "up" when it is set up.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "fail") {
    std::puts("first line");
    std::fflush(stdout);
    std::fputs("cannot open the eye\n", stderr);
    return 3;
  }
  if (mode == "environment") {
    const char* value = std::getenv(argv[2]);
    std::printf("%s\n", value == nullptr ? "unset" : value);
    return argc > 3 ? 1 : 0;  // a failure if there is one word more
  }
  if (mode == "many-lines") {
    for (int i = 0; i < 5000; ++i) std::printf("line %d\n", i);
    std::printf("no end");
    return 0;
  }
  if (mode == "stubborn") signal(SIGTERM, SIG_IGN);
  if (mode == "grandchild") {
    int ready[2];
    if (pipe(ready) != 0) return 1;
    if (fork() == 0) {
      signal(SIGTERM, SIG_IGN);
      std::printf("grandchild %d\n", static_cast<int>(getpid()));
      std::fflush(stdout);
      if (write(ready[1], "x", 1) != 1) return 1;
      while (true) pause();
    }
    // "up" comes after the grandchild's line
    char byte = 0;
    if (read(ready[0], &byte, 1) != 1) return 1;
  }
  std::puts("up");
  std::fflush(stdout);
  if (mode == "abort") std::abort();
  while (true) pause();
}
