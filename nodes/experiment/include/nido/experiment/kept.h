#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
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
  // A file in run/ with which the run counts as done though the app failed, as a robot may: "report.json".
  // Empty: it must end well.
  std::string result = {};
};

// Arguments of nido launch for a run that is repeatable to the bit and as fast as the machine: seed,
// lockstep, rate max, then `more`.
[[nodiscard]] std::vector<std::string> in_lockstep(std::uint64_t seed, const std::vector<std::string>& more);

// Where and while a piece is done.
struct Lane {
  int domain;                      // DDS domain that nothing else uses
  const InterruptFlag& interrupt;  // once raised, what runs is to end
};

// A piece that needs no app: whether the one that was asked for in these words was done in this folder
// before, and the mark that it is done now, to be made when all of its results are there. kFailed where the
// folder cannot be written.
[[nodiscard]] bool was_done(const std::string& folder, const std::string& asked);
[[nodiscard]] Status mark_done(const std::string& folder, const std::string& asked);

// Runs an app in the lane's domain, or does nothing if the same one was done in this folder before. Errors as
// of run_app().
Status run_app_once(const AppRun& run, const Lane& lane);
// Does pieces 0 .. count - 1, one in each domain at a time, in threads: `work` gets the piece and its lane.
// Begins no piece after an interruption or a failure; the first failure.
Status side_by_side(int count, const std::vector<DomainLease>& domains, const InterruptFlag& interrupt,
                    const std::function<Status(int piece, const Lane& lane)>& work);

// Forgets that pieces were done, in this folder and below: the next experiment here starts anew. To be called
// when an experiment is complete, or is to begin from nothing.
void forget_runs(const std::string& folder);

// The common end of an experiment: saves and prints the report of what was done, unless that is `nothing`.
// One that is complete forgets its pieces. kInterrupted if it was interrupted, else what failed.
Status end_of_run(const Report& report, const std::string& folder, bool nothing, bool interrupted,
                  const Status& failure);

// An experiment that is done piece by piece.
struct Pieces {
  std::string what;  // for the progress bar
  std::string out;   // folder of the report
  int count = 1;
  int jobs = 1;              // at once
  int domain = kFreeDomain;  // of the first job
  long total = 1;            // what `progress` will be in the end
  // How much is done, for the progress bar; by default Report::trials.
  std::function<long(const Report&)> progress = {};
  bool forget_earlier = false;  // does again what an earlier, interrupted experiment did in this folder
};

// Does the pieces side by side; `work` gives what came of one, `report_of` makes the report of all that are
// done, by their numbers, and `note` a word about it for the progress bar. The report is saved after every
// piece. Ends as end_of_run().
template <class PieceResult>
Status run_pieces(const Pieces& pieces,
                  const std::function<Result<PieceResult>(int piece, const Lane& lane)>& work,
                  const std::function<Report(const std::map<int, PieceResult>&)>& report_of,
                  const std::function<std::string(const Report&)>& note = {}) {
  const auto started = std::chrono::steady_clock::now();
  if (pieces.forget_earlier) forget_runs(pieces.out);
  const auto domains = take_domains(pieces.domain, std::min(pieces.jobs, pieces.count));
  if (!domains) return domains.error();
  std::mutex mutex;
  std::map<int, PieceResult> results;
  const auto report_now = [&] {
    Report report = report_of(results);
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return report;
  };
  const InterruptFlag interrupt;
  ProgressBar progress(pieces.what, pieces.total);
  const Status failure =
      side_by_side(pieces.count, *domains, interrupt, [&](int piece, const Lane& lane) -> Status {
        auto result = work(piece, lane);
        if (!result) return result.error();
        const std::scoped_lock lock(mutex);
        results.emplace(piece, std::move(*result));
        const Report report = report_now();
        progress.update(pieces.progress ? pieces.progress(report) : report.trials, note ? note(report) : "");
        return report.save(pieces.out);
      });
  return end_of_run(report_now(), pieces.out, results.empty(), interrupt.raised(), failure);
}

}  // namespace nido
