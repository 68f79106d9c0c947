// Connections made and dropped, processes killed while they write: in the fast tier a few, in the full one as
// many as it takes to see the smallest leak.

#include <malloc.h>
#include <sys/resource.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "child_process.h"
#include "even_text.h"
#include "nido/middleware/direct_port.h"
#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

// what one output holds for the readers of a moment at most, twice
constexpr std::size_t kMostPool = 128;

std::size_t entries_of(const std::string& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

// What a process takes of its machine.
struct Footprint {
  std::size_t files = 0;  // open ones but for `pool`
  std::string what;       // these files
  std::size_t pool = 0;   // memory that outputs share with inputs, to be used again
  std::size_t threads = 0;
  std::size_t memory_kb = 0;     // resident, of its own
  std::set<std::string> shared;  // in /dev/shm
  std::set<std::string> names;   // of the test's domain, sockets in the abstract namespace
};

Footprint own_footprint() {
  malloc_trim(0);
  Footprint now;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string file = std::filesystem::read_symlink(entry.path(), gone);
    const bool is_pool = file.find("nido-lane") != std::string::npos;
    ++(is_pool ? now.pool : now.files);
    if (!is_pool) {
      now.what += file + " ";
    }
  }
  now.threads = entries_of("/proc/self/task");
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word && word != "RssAnon:";) {
  }
  status >> now.memory_kb;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
    now.shared.insert(entry.path().filename());
  }
  std::ifstream sockets("/proc/net/unix");
  const std::string own = "@nido/" + std::to_string(own_domain()) + "/";
  for (std::string line; std::getline(sockets, line);) {
    if (const auto at = line.find(own); at != std::string::npos) {
      now.names.insert(line.substr(at));
    }
  }
  return now;
}

std::ostream& operator<<(std::ostream& out, const Footprint& print) {
  return out << print.memory_kb << " KB, " << print.files << " files and " << print.pool
             << " of shared memory, " << print.threads << " threads";
}

// Waits until nothing is held any more of what `before` did not hold, but for memory.
// `spare_files`: the first time that something is said to a participant opens a socket or two for good.
void expect_all_given_back(const Footprint& before, std::size_t spare_files = 4) {
  Footprint now;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    now = own_footprint();
  } while (
      (now.files > before.files + spare_files || now.threads > before.threads || now.names != before.names) &&
      std::chrono::steady_clock::now() < deadline);
  EXPECT_LE(now.files, before.files + spare_files) << now.what;
  EXPECT_LE(now.threads, before.threads);
  EXPECT_LE(now.pool, kMostPool);
  EXPECT_EQ(now.names, before.names);
  for (const std::string& name : now.shared) {
    // other programs may use it meanwhile, this one must not
    EXPECT_TRUE(before.shared.contains(name) || name.find("nido") == std::string::npos) << name;
  }
}

// Each thread makes and drops `each` connections; every tenth waits for a message, the others end in whatever
// state they are.
void connect_and_disconnect(Node& node, int thread, int each) {
  const std::string name = "/many/in" + std::to_string(thread) + ":i";
  const auto in = make_input<String>(node, name, Profile::kState);
  std::minstd_rand chance(static_cast<unsigned>(thread + 1));
  for (int i = 0; i < each && !::testing::Test::HasFailure(); ++i) {
    ASSERT_TRUE(in->connect("/source/out:o"));
    if (i % 10 == 0) {
      ASSERT_TRUE(in->wait_for_message(kPatience_s)) << "connection " << i;
    } else {
      std::this_thread::sleep_for(std::chrono::microseconds(chance() % 1000));
    }
    ASSERT_TRUE(in->disconnect("/source/out:o"));
    while (in->take()) {
    }
  }
}

void connect_many_times(int warm_up, int count, std::size_t most_growth_kb) {
  constexpr int kThreads = 4;
  const auto source = make_node("source");
  const auto out = make_output<String>(*source, "/source/out:o", Profile::kState);
  ASSERT_TRUE(out->write(text(std::string(100, 'a'))));
  const auto node = make_node("many");
  const auto round = [&](int connections) {
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] { connect_and_disconnect(*node, i, connections / kThreads); });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
  };
  round(warm_up);
  const Footprint before = own_footprint();
  const auto begin = std::chrono::steady_clock::now();
  round(count);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  expect_all_given_back(before);
  EXPECT_EQ(out->reader_count(), 0U);
  const Footprint after = own_footprint();
  std::cout << count << " connections in " << took_s << " s; before: " << before << "; after: " << after
            << "\n";
  // Fast DDS 2.9.1 keeps 144 bytes for every reader that a participant has ever had (reader_status_ of its
  // EDP)
  EXPECT_LE(after.memory_kb,
            before.memory_kb + most_growth_kb + static_cast<std::size_t>(count) * 160 / 1024);
}

// One place after the other is filled by a process that writes and reads without a pause and is killed at
// some moment after its first messages.
class Killer {
 public:
  Killer(Node& watcher, int place) : name_("victim" + std::to_string(place)) {
    chance_.seed(static_cast<unsigned>(place + 1));
    auto in = open_direct_input<String>(watcher, "/watcher/" + name_ + ":i", Profile::kEvent,
                                        [this](const String& message, const Arrival&) {
                                          torn_ += is_even(message.data()) ? 0 : 1;
                                          ++received_;
                                        });
    EXPECT_TRUE(in.ok()) << in.error().message;
    in_ = std::move(*in);
    EXPECT_TRUE(in_->connect("/" + name_ + "/out:o"));
  }
  void kill(int count) {
    for (int i = 0; i < count && !::testing::Test::HasFailure(); ++i) {
      const long seen = received_.load();
      ChildProcess victim(NIDO_TEST_PEER, {"victim", "--domain", std::to_string(own_domain()), "--name",
                                           name_, "--seed", std::to_string(1 + chance_() % 1000000)});
      ASSERT_EQ(victim.line_with("READY"), "") << name_ << ", life " << i << ": " << victim.seen();
      ASSERT_TRUE(comes_after(seen)) << name_ << ", life " << i << ": nothing came";
      std::this_thread::sleep_for(std::chrono::microseconds(chance_() % 3000));
      victim.signal(SIGKILL);
      ASSERT_NE(victim.wait_for_end(), -1);
    }
  }
  [[nodiscard]] long received() const { return received_; }
  [[nodiscard]] long torn() const { return torn_; }
  // The last one's end is known as soon as what it had sent is read.
  [[nodiscard]] bool becomes_alone() const {
    return becomes_true([this] { return !in_->connections().at(0).live; });
  }

 private:
  bool comes_after(long seen) const {
    return becomes_true([this, seen] { return received_ != seen; });
  }
  static bool becomes_true(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) {
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  const std::string name_;
  std::minstd_rand chance_;
  std::atomic<long> received_{0};
  std::atomic<long> torn_{0};
  std::unique_ptr<RawInput> in_;
};

void kill_many(int warm_up, int count, std::size_t most_growth_kb) {
  constexpr int kPlaces = 4;
  const auto watcher = make_node("watcher");
  const auto out = make_output<String>(*watcher, "/watcher/out:o", Profile::kEvent);
  std::atomic<bool> is_over{false};
  std::thread writer([&] {
    for (char letter = 'a'; !is_over; letter = letter == 'z' ? 'a' : static_cast<char>(letter + 1)) {
      EXPECT_TRUE(out->write(text(std::string(letter % 4 == 0 ? 100000 : 100, letter))));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  std::vector<std::unique_ptr<Killer>> killers;
  for (int place = 0; place < kPlaces; ++place) {
    killers.push_back(std::make_unique<Killer>(*watcher, place));
  }
  const auto round = [&](int deaths) {
    std::vector<std::thread> threads;
    for (auto& killer : killers) {
      threads.emplace_back([&] { killer->kill(deaths / kPlaces); });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
  };
  const Footprint empty = own_footprint();
  // DDS's own way to the last process of each place is closed when another one comes
  round(warm_up);
  expect_all_given_back(empty, kPlaces);
  const Footprint before = own_footprint();
  const auto begin = std::chrono::steady_clock::now();
  round(count);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  expect_all_given_back(before, kPlaces);
  EXPECT_EQ(out->reader_count(), 0U);
  is_over = true;
  writer.join();
  long received = 0;
  for (const auto& killer : killers) {
    EXPECT_EQ(killer->torn(), 0);
    EXPECT_TRUE(killer->becomes_alone());
    received += killer->received();
  }
  const Footprint after = own_footprint();
  std::cout << count << " deaths in " << took_s << " s, " << received
            << " messages, none torn; before: " << before << "; after: " << after << "\n";
  EXPECT_LE(after.memory_kb, before.memory_kb + most_growth_kb);
}

TEST(Endurance, ConnectsAndDisconnects) { connect_many_times(40, 200, 20000); }
TEST(Endurance, ProcessesDieWhileTheyWrite) { kill_many(4, 8, 20000); }

// a leak of thirty bytes each would be seen
TEST(EnduranceFull, ConnectsAndDisconnects) { connect_many_times(2000, 100'000, 3000); }
TEST(EnduranceFull, ProcessesDieWhileTheyWrite) { kill_many(400, 10'000, 4000); }

TEST(EnduranceFull, TwelveHundredInputsGetEveryMessage) {
  constexpr std::size_t kInputs = 1200;
  const auto giver = make_node("giver");
  const auto taker = make_node("taker");
  const auto out = make_output<String>(*giver, "/giver/out:o", Profile::kEvent, 100);
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  if (files.rlim_cur < 4 * kInputs) {
    GTEST_SKIP() << "this system grants a process " << files.rlim_cur
                 << " files, three for each input are needed";
  }
  std::vector<std::unique_ptr<Input<String>>> inputs;
  for (std::size_t i = 0; i < kInputs; ++i) {
    inputs.push_back(
        make_input<String>(*taker, "/taker/in" + std::to_string(i) + ":i", Profile::kEvent, 100));
    ASSERT_TRUE(inputs.back()->connect("/giver/out:o"));
  }
  ASSERT_TRUE(out->wait_for_readers(kInputs, 5 * kPatience_s));
  for (const auto& input : inputs) {
    ASSERT_TRUE(input->wait_for_sources(1, kPatience_s));
  }
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(out->write(text(std::to_string(i))));
  }
  for (const auto& input : inputs) {
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(input->wait_for_message(kPatience_s));
      ASSERT_EQ(input->take()->data(), std::to_string(i));
    }
  }
}

}  // namespace

}  // namespace nido::testing
