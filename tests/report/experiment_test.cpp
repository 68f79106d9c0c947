// What experiments share: domains of their own, pieces that are kept, pieces side by side.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "nido/experiment/domain.h"
#include "nido/experiment/kept.h"

namespace nido {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("nido_experiment_test_" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

TEST(Domains, NoTwoAreTheSameAndAFreedOneComesAgain) {
  auto domains = take_domains(kFreeDomain, 3);
  ASSERT_TRUE(domains) << domains.error().message;
  std::set<int> numbers;
  for (const auto& domain : *domains) numbers.insert(domain.number());
  EXPECT_EQ(numbers.size(), 3U);
  const int freed = domains->front().number();
  domains->erase(domains->begin());
  const auto next = DomainLease::take();
  ASSERT_TRUE(next);
  EXPECT_LE(next->number(), freed);  // the lowest that is free
  EXPECT_EQ(numbers.count(next->number()), next->number() == freed ? 1U : 0U);
}

TEST(Domains, ThoseThatAreAskedForAreGiven) {
  const auto domains = take_domains(7, 2);
  ASSERT_TRUE(domains);
  EXPECT_EQ((*domains)[0].number(), 7);
  EXPECT_EQ((*domains)[1].number(), 8);
}

TEST(Pieces, OneThatWasDoneIsNotStartedAgain) {
  const Folder folder;
  const InterruptFlag interrupt;
  const AppRun run{"there_is_no_such_app", {"--seed", "4"}, folder.path().string()};
  const auto mark = [&](const std::string& asked) {
    std::ofstream(folder.path() / "run.done") << asked;
    fs::create_directories(folder.path() / "run");
    std::ofstream(folder.path() / "run" / "result") << "kept";
  };
  mark("there_is_no_such_app\n--seed\n4\n");
  EXPECT_TRUE(run_app_once(run, {44, interrupt}));
  EXPECT_TRUE(fs::exists(folder.path() / "run" / "result"));

  // results of another seed are no results: they go, and the app is started, which fails here
  mark("there_is_no_such_app\n--seed\n5\n");
  EXPECT_FALSE(run_app_once(run, {44, interrupt}));
  EXPECT_FALSE(fs::exists(folder.path() / "run" / "result"));

  mark("there_is_no_such_app\n--seed\n4\n");
  forget_runs(folder.path().string());
  EXPECT_FALSE(run_app_once(run, {44, interrupt}));
}

TEST(Pieces, OneWithoutAnAppIsMarkedByWhatWasAskedFor) {
  const Folder folder;
  const std::string piece = (folder.path() / "pieces" / "0001").string();
  EXPECT_FALSE(was_done(piece, "seed 4"));
  EXPECT_FALSE(mark_done(piece, "seed 4"));  // no folder, so no results
  fs::create_directories(piece);
  ASSERT_TRUE(mark_done(piece, "seed 4"));
  EXPECT_TRUE(was_done(piece, "seed 4"));
  EXPECT_FALSE(was_done(piece, "seed 5"));
  forget_runs(folder.path().string());
  EXPECT_FALSE(was_done(piece, "seed 4"));
}

// A user who asks a long experiment to end does not wait for its piece.
TEST(Pieces, AnInterruptionEndsTheAppThatRuns) {
  const Folder folder;
  const InterruptFlag interrupt;
  const std::jthread somebody([&](const std::stop_token& ended) {
    const fs::path begun = folder.path() / "run" / "app.yaml";
    while (!ended.stop_requested() && !fs::exists(begun)) std::this_thread::sleep_for(10ms);
    if (fs::exists(begun)) std::raise(SIGTERM);
  });
  const Status ran =
      run_app_once({"grasp_learning", {"--lockstep"}, folder.path().string()}, {44, interrupt});
  ASSERT_FALSE(ran);
  EXPECT_EQ(ran.error().code, ErrorCode::kInterrupted) << ran.error().message;
}

TEST(Pieces, SideBySideEachIsDoneOnceInADomainOfItsOwn) {
  const auto domains = take_domains(3, 2);
  ASSERT_TRUE(domains);
  const InterruptFlag interrupt;
  std::array<std::atomic<int>, 9> done{};
  std::array<std::atomic<int>, 5> at_work{};
  std::atomic<bool> met{false};
  const Status all = side_by_side(9, *domains, interrupt, [&](int piece, const Lane& lane) -> Status {
    auto& here = at_work[static_cast<std::size_t>(lane.domain)];
    if (++here > 1) met = true;
    ++done[static_cast<std::size_t>(piece)];
    --here;
    return {};
  });
  EXPECT_TRUE(all);
  for (const auto& times : done) EXPECT_EQ(times, 1);
  EXPECT_FALSE(met);
}

TEST(Pieces, AFailureOrAnInterruptionEndsThem) {
  const auto domains = take_domains(3, 1);
  ASSERT_TRUE(domains);
  const InterruptFlag interrupt;
  int begun = 0;
  const Status failed = side_by_side(9, *domains, interrupt, [&](int piece, const Lane&) -> Status {
    ++begun;
    if (piece == 2) return Error{ErrorCode::kFailed, "this one"};
    return {};
  });
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "this one");
  EXPECT_EQ(begun, 3);

  begun = 0;
  EXPECT_TRUE(side_by_side(9, *domains, interrupt, [&](int piece, const Lane&) -> Status {
    ++begun;
    if (piece == 1) std::raise(SIGINT);
    return {};
  }));
  EXPECT_EQ(begun, 2);
}

TEST(Pieces, TheReportHasWhatIsDoneAndTellsOfAFailure) {
  const Folder folder;
  Pieces pieces{.what = "pieces", .out = folder.path().string(), .count = 4, .domain = 3, .total = 4};
  const auto report_of = [](const std::map<int, int>& done) {
    Report report;
    report.name = "pieces";
    report.trials = static_cast<long>(done.size());
    for (const auto& [piece, result] : done)
      report.add(std::to_string(piece), {static_cast<double>(result), ""});
    return report;
  };
  const Status all = run_pieces<int>(
      pieces,
      [](int piece, const Lane& lane) -> Result<int> {
        if (piece == 3) return Error{ErrorCode::kFailed, "this one"};
        return 10 * piece + lane.domain;
      },
      report_of);
  ASSERT_FALSE(all);
  EXPECT_EQ(all.error().message, "this one");
  std::ifstream file(folder.path() / "report.json");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(text.find("23"), std::string::npos) << text;  // piece 2 in domain 3
  EXPECT_NE(text.find("\"trials\": 3"), std::string::npos) << text;
}

}  // namespace
}  // namespace nido
