#include "nido/experiment/kept.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <thread>

#include "nido/experiment/launched_app.h"

namespace nido {
namespace fs = std::filesystem;
namespace {
constexpr const char* kMark = "run.done";  // what was asked for, beside its results
}

bool was_done(const std::string& folder, const std::string& asked) {
  std::ifstream mark(fs::path(folder) / kMark);
  return std::string(std::istreambuf_iterator<char>(mark), {}) == asked;
}

Status mark_done(const std::string& folder, const std::string& asked) {
  const fs::path file = fs::path(folder) / kMark;
  std::ofstream mark(file);
  mark << asked;
  return mark.flush() ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + file.string()}};
}

std::vector<std::string> in_lockstep(std::uint64_t seed, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"--seed", std::to_string(seed), "--rate", "max", "--lockstep"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

Status run_app_once(const AppRun& run, const Lane& lane) {
  const fs::path folder = fs::absolute(run.folder);
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) return Error{ErrorCode::kFailed, folder.string() + ": " + failure.message()};
  const std::string asked = fmt::format("{}\n{}\n", run.app, fmt::join(run.arguments, "\n"));
  if (was_done(folder.string(), asked)) return {};
  std::error_code absent;
  fs::remove(folder / kMark, absent);
  fs::remove_all(folder / "run", absent);  // of another run: its results would be taken for these
  std::vector<std::string> arguments = run.arguments;
  for (const std::string& word : {std::string("--domain"), std::to_string(lane.domain), std::string("--out"),
                                  (folder / "run").string()}) {
    arguments.push_back(word);
  }
  if (const Status ran = run_app(run.app, arguments, (folder / "launch.log").string(), lane.interrupt);
      !ran) {
    const bool counts = ran.error().code == ErrorCode::kFailed && !run.result.empty() &&
                        fs::exists(folder / "run" / run.result, absent);
    if (!counts) return ran;
  }
  return mark_done(folder.string(), asked);
}

Status side_by_side(int count, const std::vector<DomainLease>& domains, const InterruptFlag& interrupt,
                    const std::function<Status(int piece, const Lane& lane)>& work) {
  std::mutex mutex;
  int next = 0;
  Status failure;
  const auto work_in = [&](const Lane& lane) {
    while (true) {
      int piece = 0;
      {
        const std::scoped_lock lock(mutex);
        if (!failure || next >= count || interrupt.raised()) return;
        piece = next++;
      }
      const Status done = work(piece, lane);
      const std::scoped_lock lock(mutex);
      if (!done && failure) failure = done;
    }
  };
  {
    std::vector<std::jthread> lanes;
    for (const DomainLease& domain : domains) lanes.emplace_back(work_in, Lane{domain.number(), interrupt});
  }
  return failure;
}

void forget_runs(const std::string& folder) {
  std::error_code failure;
  std::vector<fs::path> marks;
  for (auto entry = fs::recursive_directory_iterator(folder, failure);
       !failure && entry != fs::recursive_directory_iterator(); entry.increment(failure)) {
    if (entry->path().filename() == kMark) marks.push_back(entry->path());
  }
  for (const fs::path& mark : marks) fs::remove(mark, failure);
}

Status end_of_run(const Report& report, const std::string& folder, bool nothing, bool interrupted,
                  const Status& failure) {
  if (!nothing) {
    if (const Status saved = save_and_print(report, folder); !saved) return saved;
  }
  if (interrupted || (!failure && failure.error().code == ErrorCode::kInterrupted)) {
    return Error{ErrorCode::kInterrupted, "interrupted; what is done is kept, the same command goes on"};
  }
  if (failure) forget_runs(folder);
  return failure;
}

}  // namespace nido
