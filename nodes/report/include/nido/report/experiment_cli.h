#pragma once

// What the command lines of all experiments share. Header only, because it brings CLI11 with it: include it
// in the .cpp file of the program.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

struct ExperimentRequest {
  std::uint64_t seed = 1;
  int trials = 1;
  int jobs = 1;
  std::string out;
};

// --seed, --trials, --jobs, --out, and --set KEY=VALUE as another way to say --KEY VALUE.
inline void add_experiment_options(CLI::App& app, ExperimentRequest& request) {
  app.add_option("--seed", request.seed, "seed of the first trial")->capture_default_str();
  app.add_option("--trials", request.trials, "how many")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--jobs", request.jobs, "trials at once")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--out", request.out, "folder of the report")->capture_default_str();
  app.add_option_function<std::vector<std::string>>(
      "--set",
      [&app](const std::vector<std::string>& sets) {
        for (const std::string& set : sets) {
          const std::size_t equals = set.find('=');
          CLI::Option* option =
              equals == std::string::npos ? nullptr : app.get_option_no_throw("--" + set.substr(0, equals));
          if (option == nullptr || option->get_name() == "--set") {
            throw CLI::ValidationError("--set",
                                       set + ": expected KEY=VALUE, where --KEY is an option of --help");
          }
          option->clear();
          option->add_result(set.substr(equals + 1));
          option->run_callback();
        }
      },
      "KEY=VALUE: the same as --KEY VALUE");
}

// --domain, for experiments that start apps: -1 takes domains that are free on this computer.
inline void add_domain_option(CLI::App& app, int& domain) {
  app.add_option("--domain", domain,
                 "DDS domain of the first app, others that run beside it follow (default: free ones)")
      ->check(CLI::Range(0, 200));
}

// --hand, for experiments in which one hand acts.
inline void add_hand_option(CLI::App& app, std::string& hand) {
  app.add_option("--hand", hand, "the hand that acts")
      ->check(CLI::IsMember({"right", "left"}))
      ->capture_default_str();
}

// Parses; the exit code if the program is to end here (help: 0, wrong usage: 2).
inline std::optional<int> parse_experiment(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

// Prints a failure as one sentence; the exit code of the program.
inline int end_experiment(const Status& status) {
  if (status) return 0;
  std::fputs((status.error().message + "\n").c_str(), stderr);
  switch (status.error().code) {
    case ErrorCode::kInterrupted:
      return 130;
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kTaken:
      return 2;
    case ErrorCode::kNotFound:
    case ErrorCode::kTimeout:
      return 3;
    default:
      return 1;
  }
}

}  // namespace nido
