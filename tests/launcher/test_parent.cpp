// Supervises children as a launcher does, until it is killed: test_parent JANITOR CHILD MODE...
#include <cstdio>
#include <set>
#include <string>

#include "nido/launcher/supervisor.h"

int main(int argc, char** argv) {
  auto supervisor = nido::Supervisor::create(argv[1]);
  if (!supervisor) return 1;
  for (int i = 3; i < argc; ++i) {
    nido::SupervisedProcess process;
    process.name = "child" + std::to_string(i);
    process.command.program = argv[2];
    process.command.arguments = {argv[i]};
    if (!(*supervisor)->start(process)) return 1;
  }
  std::set<std::string> up;
  while (true) {
    for (const auto& event : (*supervisor)->poll(std::chrono::seconds(1))) {
      if (event.text.starts_with("grandchild")) std::printf("%s\n", event.text.c_str() + 11);
      if (event.text == "up") {
        std::printf("%d\n", static_cast<int>((*supervisor)->pid_of(event.name)));
        up.insert(event.name);
        if (static_cast<int>(up.size()) == argc - 3) std::printf("all\n");
      }
      std::fflush(stdout);
    }
  }
}
