#include "nido/report/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>

namespace nido {

namespace {

// a signal handler can reach nothing else
std::atomic<bool> interrupted{false};  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void note_interrupt(int) { interrupted = true; }

}  // namespace

ProgressBar::ProgressBar(std::string what, long total)
    : what_(std::move(what)),
      total_(std::max(1L, total)),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()) {
  update(0);
}

ProgressBar::~ProgressBar() {
  if (terminal_) fmt::print(stderr, "\n");
}

void ProgressBar::update(long done, const std::string& note) {
  const long percent = 100 * std::clamp(done, 0L, total_) / total_;
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  // as if all were equally long
  const std::string left =
      done > 0 && done < total_
          ? fmt::format(", {:.0f} s left",
                        elapsed_s * static_cast<double>(total_ - done) / static_cast<double>(done))
          : "";
  if (terminal_) {
    constexpr long kWidth = 30;
    const auto filled = static_cast<std::size_t>(percent * kWidth / 100);
    fmt::print(stderr, "\r{} [{}{}] {}/{} {:.0f} s{} {}\033[K", what_, std::string(filled, '#'),
               std::string(kWidth - filled, '.'), done, total_, elapsed_s, left, note);
    std::fflush(stderr);
  } else if (percent / 10 != shown_ / 10 || shown_ < 0) {
    fmt::print(stderr, "{}: {} of {} after {:.0f} s{} {}\n", what_, done, total_, elapsed_s, left, note);
  }
  shown_ = percent;
}

InterruptFlag::InterruptFlag() {
  interrupted = false;
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

InterruptFlag::~InterruptFlag() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool InterruptFlag::raised() const { return interrupted; }

}  // namespace nido
