// nido-bench-image: 640x480 rgb8 from one process to another, at 30 Hz and as fast as it goes
// (docs/bench.md).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstring>
#include <mutex>
#include <sstream>
#include <thread>

#include "bench_options.h"
#include "child.h"
#include "image_way.h"
#include "report.h"

namespace nido::bench {

namespace {

// What the receiving process has seen since it was asked last.
class Tally {
 public:
  void note(std::span<const std::uint8_t> pixels) {
    const long long arrived_ns = now_ns();
    std::int64_t first = 0;
    std::int64_t last = 0;
    if (pixels.size() != kImage_bytes) return;
    std::memcpy(&first, pixels.data(), sizeof first);
    std::memcpy(&last, pixels.data() + pixels.size() - sizeof last, sizeof last);
    const std::lock_guard lock(mutex_);
    last_ns_ = arrived_ns;
    if (first == last) {
      latencies_ns_.push_back(arrived_ns - first);
    } else {
      ++torn_;
    }
  }
  // "TORN LAST_NS LATENCY_NS..."
  std::string take() {
    const std::lock_guard lock(mutex_);
    std::string text = std::to_string(torn_) + " " + std::to_string(last_ns_);
    for (const long long latency_ns : latencies_ns_) text += " " + std::to_string(latency_ns);
    latencies_ns_.clear();
    torn_ = 0;
    return text;
  }

 private:
  std::mutex mutex_;
  std::vector<long long> latencies_ns_;
  long long last_ns_ = 0;
  int torn_ = 0;
};

struct Seen {
  int torn = 0;
  long long last_ns = 0;
  std::vector<double> latency_us;
};

struct Contender {
  const ImageWay* way = nullptr;
  std::unique_ptr<ImageSource> source;
  std::unique_ptr<Child> child;

  [[nodiscard]] Result<Seen> ask() const {
    child->say("tell");
    const auto line = child->hear(10.0);
    if (!line) return Error{ErrorCode::kTimeout, way->who + ": the receiving process does not answer"};
    std::istringstream words(*line);
    Seen seen;
    words >> seen.torn >> seen.last_ns;
    for (double latency_ns = 0; words >> latency_ns;) seen.latency_us.push_back(latency_ns * 1e-3);
    return seen;
  }
};

int receive(const std::vector<ImageWay>& ways, const std::string& who, int domain,
            const std::string& address) {
  live_no_longer_than_parent();
  for (const ImageWay& way : ways) {
    if (way.who != who) continue;
    Tally tally;
    return exit_code(way.receive(
        domain, address, [&](std::span<const std::uint8_t> pixels) { tally.note(pixels); },
        [&] {
          while (hear_parent()) tell_parent(tally.take());
        }));
  }
  return 2;
}

}  // namespace

int image_main(int argc, char** argv) {
  const std::vector<ImageWay> ways = {nido_image(), nido_image_copied(), bare_ring_image(),
                                      plain_fast_dds_image(), unix_socket_image()};
  Options options;
  int count = 150;
  int burst = 300;
  std::string who;
  std::string address;
  CLI::App app{"Measures images from process to process. Example: nido bench image --json"};
  options.add_to(app);
  app.add_option("--count", count, "images at 30 Hz")->check(CLI::Range(10, 100000));
  app.add_option("--burst", burst, "images as fast as they go")->check(CLI::Range(10, 100000));
  app.add_option("--receive", who)->group("");
  app.add_option("--address", address)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!who.empty()) return receive(ways, who, options.domain, address);

  Report report("image");
  std::vector<Contender> contenders;
  for (const ImageWay& way : ways) {
    if (!way.absent.empty()) {
      report.leave_out(way.who, way.absent);
      continue;
    }
    Contender contender;
    contender.way = &way;
    auto source = way.send(options.domain);
    if (!source) return exit_code(source.error());
    contender.source = std::move(*source);
    std::vector<std::string> arguments{"--receive", way.who, "--domain", std::to_string(options.domain)};
    if (const std::string place = contender.source->address(); !place.empty()) {
      arguments.insert(arguments.end(), {"--address", place});
    }
    contender.child = std::make_unique<Child>(arguments);
    if (Status status = contender.source->connect(); !status) return exit_code(status);
    contenders.push_back(std::move(contender));
  }

  // a picture that was taken somewhere: filling a message is one copy of it, with the time at both ends
  std::vector<std::uint8_t> picture(kImage_bytes);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = static_cast<std::uint8_t>(i * 7);
  const auto send = [&picture](Contender& contender) {
    const std::int64_t begin_ns = now_ns();
    contender.source->send([&](std::uint8_t* pixels) {
      std::memcpy(pixels, picture.data(), picture.size());
      std::memcpy(pixels, &begin_ns, sizeof begin_ns);
      std::memcpy(pixels + kImage_bytes - sizeof begin_ns, &begin_ns, sizeof begin_ns);
    });
  };

  // 30 Hz, one contender after the other within each period
  const auto step = std::chrono::nanoseconds(1'000'000'000 / 30) / contenders.size();
  constexpr int kWarmUp = 10;
  auto due = std::chrono::steady_clock::now();
  for (int i = -kWarmUp; i < count; ++i) {
    for (Contender& contender : contenders) {
      std::this_thread::sleep_until(due += step);
      if (i == 0) {
        if (auto seen = contender.ask(); !seen) return exit_code(seen.error());
      }
      send(contender);
    }
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // what is under way
  std::vector<double> p50_us;
  for (Contender& contender : contenders) {
    auto seen = contender.ask();
    if (!seen) return exit_code(seen.error());
    const std::string& name = contender.way->who;
    report.add_quantiles(name, "image_30hz", seen->latency_us, "us");
    report.add(name, "image_30hz_received", static_cast<double>(seen->latency_us.size()) / count, "1",
               static_cast<std::size_t>(count));
    report.add(name, "image_30hz_torn", seen->torn, "1", static_cast<std::size_t>(count));
    p50_us.push_back(seen->latency_us.empty() ? 0 : quantile(seen->latency_us, 0.5));
  }
  for (std::size_t i = 1; i < contenders.size(); ++i) {
    report.add(contenders[0].way->who + " to " + contenders[i].way->who, "image_30hz_p50_ratio",
               p50_us[0] / p50_us[i], "1", static_cast<std::size_t>(count));
  }

  for (Contender& contender : contenders) {
    const long long begin_ns = now_ns();
    for (int i = 0; i < burst; ++i) send(contender);
    const long long sent_ns = now_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    auto seen = contender.ask();
    if (!seen) return exit_code(seen.error());
    const auto n = static_cast<std::size_t>(burst);
    const auto rate = [&](double images, long long until_ns) {
      return images / (static_cast<double>(until_ns - begin_ns) * 1e-9);
    };
    report.add(contender.way->who, "image_burst_sent", rate(burst, sent_ns), "Hz", n);
    report.add(contender.way->who, "image_burst_received",
               rate(static_cast<double>(seen->latency_us.size()), seen->last_ns), "Hz", n);
    report.add(contender.way->who, "image_burst_fraction",
               static_cast<double>(seen->latency_us.size()) / burst, "1", n);
  }
  report.print(options.json);
  return 0;
}

}  // namespace nido::bench

int main(int argc, char** argv) { return nido::bench::image_main(argc, argv); }
