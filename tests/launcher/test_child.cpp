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
    return 0;
  }
  if (mode == "many-lines") {
    for (int i = 0; i < 5000; ++i) std::printf("line %d\n", i);
    std::printf("no end");
    return 0;
  }
  if (mode == "stubborn") signal(SIGTERM, SIG_IGN);
  if (mode == "grandchild" && fork() == 0) {
    signal(SIGTERM, SIG_IGN);
    std::printf("grandchild %d\n", static_cast<int>(getpid()));
    std::fflush(stdout);
    while (true) pause();
  }
  std::puts("up");
  std::fflush(stdout);
  if (mode == "abort") std::abort();
  while (true) pause();
}
