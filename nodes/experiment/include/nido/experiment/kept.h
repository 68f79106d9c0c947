#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nido/experiment/domain.h"
#include "nido/interfaces/result.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"

namespace nido {

// One piece of an experiment: an app run whose results lie in a folder. An experiment that is interrupted
// finds the pieces that were done when it is started again in the same way.
struct AppRun {
  std::string app;
  std::vector<std::string> arguments;  // of nido launch, without --domain and --out
  std::string folder;                  // gets launch.log and, in run/, what the app writes
};

// Runs an app in `domain`, or does nothing if the same one ended well in this folder before. Errors as of
// run_app().
Status run_app_once(const AppRun& run, int domain);
// Does pieces 0 .. count - 1, one in each domain at a time, in threads: `work` gets the piece and its domain.
// Begins no piece after an interruption or a failure; the first failure.
Status side_by_side(int count, const std::vector<DomainLease>& domains, const InterruptFlag& interrupt,
                    const std::function<Status(int piece, int domain)>& work);

// Forgets that pieces were done, in this folder and below: the next experiment here starts anew. To be called
// when an experiment is complete, or is to begin from nothing.
void forget_runs(const std::string& folder);

// The common end of an experiment: saves and prints the report of what was done, unless that is `nothing`.
// One that is complete forgets its pieces. kInterrupted if it was interrupted, else what failed.
Status end_of_run(const Report& report, const std::string& folder, bool nothing, bool interrupted,
                  const Status& failure);

}  // namespace nido
