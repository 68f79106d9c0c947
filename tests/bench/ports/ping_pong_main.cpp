#include <CLI/CLI.hpp>
#include <iostream>

#include "bench_options.h"
#include "child.h"
#include "ping_pong.h"
#include "report.h"

namespace nido::bench {

namespace {

struct Contender {
  const PingPongKind* kind = nullptr;
  std::unique_ptr<PingPong> ask;
  std::unique_ptr<Child> child;
  std::vector<double> all_us;
  std::vector<double> round_p50_us;
  std::vector<double> round_p99_us;
};

}  // namespace

int ping_pong_main(int argc, char** argv, const std::string& bench, const std::vector<PingPongKind>& kinds) {
  Options options;
  int rounds = 20;
  int batch = 250;
  std::string answer;
  std::string address;
  CLI::App app{"Measures a round trip of 64 bytes between two processes. Example: nido bench " + bench};
  options.add_to(app);
  app.add_option("--rounds", rounds, "turns that each way gets")->check(CLI::Range(1, 100000));
  app.add_option("--batch", batch, "round trips in a turn")->check(CLI::Range(10, 1000000));
  app.add_option("--answer", answer)->group("");
  app.add_option("--address", address)->group("");
  CLI11_PARSE(app, argc, argv);

  if (!answer.empty()) {
    live_no_longer_than_parent();
    for (const PingPongKind& kind : kinds) {
      if (kind.who == answer) {
        return exit_code(kind.answer(options.domain, address));
      }
    }
    return 2;
  }

  Report report(bench);
  std::vector<Contender> contenders;
  for (const PingPongKind& kind : kinds) {
    if (!kind.absent.empty()) {
      report.leave_out(kind.who, kind.absent);
      continue;
    }
    Contender contender;
    contender.kind = &kind;
    auto ask = kind.ask(options.domain);
    if (!ask && ask.error().code == ErrorCode::kUnsupported) {
      report.leave_out(kind.who, ask.error().message);
      continue;
    }
    if (!ask) {
      return exit_code(ask.error());
    }
    contender.ask = std::move(*ask);
    std::vector<std::string> arguments{"--answer", kind.who, "--domain", std::to_string(options.domain)};
    if (const std::string place = contender.ask->address(); !place.empty()) {
      arguments.insert(arguments.end(), {"--address", place});
    }
    contender.child = std::make_unique<Child>(arguments);
    if (Status status = contender.ask->connect(); !status) {
      return exit_code(status);
    }
    contenders.push_back(std::move(contender));
  }

  // in turns: the machine's moods hit all alike; the first turn only warms up
  for (int round = -1; round < rounds; ++round) {
    for (Contender& contender : contenders) {
      std::vector<double> turn_us;
      for (int i = 0; i < batch; ++i) {
        const long long begin_ns = now_ns();
        if (!contender.ask->round_trip()) {
          return exit_code(Error{ErrorCode::kTimeout, contender.kind->who + ": a message did not come back"});
        }
        turn_us.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-3);
      }
      if (round >= 0) {
        contender.round_p50_us.push_back(quantile(turn_us, 0.5));
        contender.round_p99_us.push_back(quantile(turn_us, 0.99));
        contender.all_us.insert(contender.all_us.end(), turn_us.begin(), turn_us.end());
      }
    }
  }

  for (const Contender& contender : contenders) {
    report.add_quantiles(contender.kind->who, contender.kind->metric, contender.all_us, "us");
  }
  // of each turn to the other's turn right after it, then the median
  const Contender& own = contenders.front();
  for (std::size_t i = 1; i < contenders.size(); ++i) {
    const auto ratio = [&](const std::vector<double>& mine, const std::vector<double>& others) {
      std::vector<double> ratios;
      for (std::size_t k = 0; k < mine.size(); ++k) {
        ratios.push_back(mine[k] / others[k]);
      }
      return quantile(ratios, 0.5);
    };
    const std::string who = own.kind->who + " to " + contenders[i].kind->who;
    const auto n = static_cast<std::size_t>(rounds);
    report.add(who, bench + "_p50_ratio", ratio(own.round_p50_us, contenders[i].round_p50_us), "1", n);
    report.add(who, bench + "_p99_ratio", ratio(own.round_p99_us, contenders[i].round_p99_us), "1", n);
  }
  report.print(options.json);
  return 0;
}

}  // namespace nido::bench
