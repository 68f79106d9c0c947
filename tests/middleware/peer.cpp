// A process for the tests to start, talk to and kill. The first argument says what it does, the others are a
// node's.

#include <signal.h>
#include <sys/prctl.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <random>
#include <sstream>
#include <thread>
#include <vector>

#include "even_text.h"
#include "nido/middleware/direct_port.h"
#include "nido/middleware/image_port.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"

namespace nido {

namespace {

// Everything that a node has seen, as a number (FNV-1a).
class Hash {
 public:
  void add(const std::string& text) {
    for (const char c : text) {
      value_ = (value_ ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    }
    value_ = (value_ ^ 0xffU) * 1099511628211ULL;
  }
  [[nodiscard]] std::string text() const {
    char digits[20];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value_));
    return digits;
  }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

msgs::String words(const std::string& value) {
  msgs::String message;
  message.data(value);
  return message;
}

void say(const std::string& line) { std::cout << line << std::endl; }

void take_all(Input<msgs::String>& in, Time now, Hash& hash) {
  while (auto received = in.take_received()) {
    hash.add(std::to_string(now.ns) + " " + received->source + " " + std::to_string(received->sequence) +
             " " + received->message.data());
  }
}

// Member of a lockstep: three ports, answers depend on everything seen before; works for a random time.
Status member(Node& node) {
  const std::string name = node.options().name;
  auto out = node.open_output<msgs::String>("/" + name + "/out:o", Profile::kEvent);
  auto state = node.open_output<msgs::String>("/" + name + "/state:o", Profile::kState);
  auto command = node.open_output<msgs::String>("/" + name + "/command:o", Profile::kCommand);
  auto in = node.open_input<msgs::String>("/" + name + "/in:i", Profile::kEvent, 1000);
  if (!out || !state || !command || !in) {
    return Error{ErrorCode::kFailed, "cannot open the ports"};
  }
  const auto most_us = node.parameter<int>("jitter_us", 0);
  std::minstd_rand chance(std::random_device{}());
  Hash hash;
  long ticks = 0;
  node.set_ready();
  auto status = node.run([&](Time now) -> Status {
    take_all(**in, now, hash);
    if (*most_us > 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(chance() % static_cast<unsigned>(*most_us)));
    }
    if (++ticks == 1) {
      say("TICKING");
    }
    (void)(*out)->write(words("first " + hash.text()));
    (void)(*out)->write(words("second " + hash.text()));
    if (ticks % 3 == 0) {
      (void)(*state)->write(words("state " + hash.text()));
    }
    return (*command)->write(words("command " + hash.text()));
  });
  say("HASH " + hash.text() + " " + std::to_string(ticks));
  return status;
}

// Owner of the clock: so many ticks of 10 ms.
Status owner(Node& node) {
  auto out = node.open_output<msgs::String>("/owner/out:o", Profile::kEvent);
  auto image = node.open_output<msgs::Image>("/owner/image:o", Profile::kSensor);
  auto second_image = node.open_output<msgs::Image>("/owner/image2:o", Profile::kSensor);
  auto in = node.open_input<msgs::String>("/owner/in:i", Profile::kEvent, 1000);
  msgs::Image picture;
  picture.data().resize(320 * 240 * 3);
  if (!out || !image || !second_image || !in) {
    return Error{ErrorCode::kFailed, "cannot open the ports"};
  }
  const auto ticks = node.parameter<int>("ticks", 100);
  Hash hash;
  node.set_ready();
  // nobody is there to get these: the first ticks may not wait for them
  (void)(*image)->write(picture);
  (void)(*second_image)->write(picture);
  std::chrono::steady_clock::time_point begin;
  for (int tick = 1; tick <= *ticks; ++tick) {
    const Time now{tick * 10'000'000LL};
    (void)(*out)->write(words("tick " + hash.text()));
    if (tick % 3 == 0) {
      picture.data()[static_cast<std::size_t>(tick)] = static_cast<std::uint8_t>(tick);
      (void)(*image)->write(picture);
      (void)(*second_image)->write(picture);
    }
    if (auto status = node.publish_clock(now); !status) {
      return status;
    }
    if (tick == 10) {
      say("TICKING");
    }
    if (tick == 1) {
      begin = std::chrono::steady_clock::now();
    }
    take_all(**in, now, hash);
  }
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  say("HASH " + hash.text() + " " + std::to_string(*ticks));
  say("US_PER_TICK " + std::to_string(wall_s / std::max(1, *ticks - 1) * 1e6));
  return {};
}

// Member of a lockstep that looks at two images.
Status viewer(Node& node) {
  const std::string name = node.options().name;
  auto left = node.open_input<msgs::Image>("/" + name + "/left:i", Profile::kSensor);
  auto right = node.open_input<msgs::Image>("/" + name + "/right:i", Profile::kSensor);
  if (!left || !right) {
    return Error{ErrorCode::kFailed, "cannot open the ports"};
  }
  Hash hash;
  long pairs = 0;
  node.set_ready();
  auto status = node.run([&](Time now) -> Status {
    const auto a = (*left)->take_latest();
    const auto b = (*right)->take_latest();
    if (a && b && a->data() == b->data()) {
      ++pairs;
      hash.add(std::to_string(now.ns) + " " + std::string(a->data().begin(), a->data().end()));
    }
    return {};
  });
  say("HASH " + hash.text() + " " + std::to_string(pairs));
  return status;
}

// Publishes numbers on /source/count:o, one for each line that it reads, and says so.
Status source(Node& node) {
  auto out = node.open_output<msgs::String>("/source/count:o", Profile::kEvent);
  if (!out) {
    return out.error();
  }
  node.set_ready();
  say("READY");
  int count = 0;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "wait") {
      say((*out)->wait_for_readers(1, 20.0) ? "CONNECTED" : "ALONE");
      continue;
    }
    (void)(*out)->write(words(line + " " + std::to_string(++count)));
    say("WROTE");
  }
  return {};
}

// Says what it gets; dies at the word "die", inside the call that delivers it as far as others can tell.
Status listener(Node& node) {
  // of profile state it also gets the last message from before its time
  const auto state = node.parameter<bool>("state", false);
  auto in =
      node.open_input<msgs::String>("/listener/in:i", state && *state ? Profile::kState : Profile::kEvent);
  if (!in) {
    return in.error();
  }
  const auto patience_s = node.parameter<double>("patience_s", 20.0);
  if (!(*in)->wait_for_sources(1, patience_s ? *patience_s : 20.0)) {
    return Error{ErrorCode::kTimeout, "no source"};
  }
  node.set_ready();
  say("READY");
  for (;;) {
    if (!(*in)->wait_for_message(3600.0)) {
      continue;
    }
    while (const auto message = (*in)->take()) {
      if (message->data() == "die") {
        std::_Exit(4);
      }
      say("GOT " + message->data().substr(0, 40));
    }
  }
}

// Runs until it is told to stop.
Status idle(Node& node) {
  auto out = node.open_output<msgs::String>("/idle/out:o", Profile::kState);
  if (!out) {
    return out.error();
  }
  node.set_ready();
  say("READY");
  return node.run([](Time) { return Status(); });
}

std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// A picture in which each byte is the same.
constexpr std::uint32_t kPictureWidth_px = 320;
constexpr std::uint32_t kPictureHeight_px = 240;

Status write_picture(ImageOutput& eye, int number) {
  auto place = eye.begin({kPictureWidth_px, kPictureHeight_px, kPictureWidth_px * 3, "rgb8", "eye"}, Time{});
  if (!place) {
    return place.error();
  }
  std::fill(place->begin(), place->end(), static_cast<std::uint8_t>(number));
  return eye.send();
}

bool is_whole(const msgs::Image& picture) {
  const auto& data = picture.data();
  return data.size() == std::size_t{kPictureWidth_px} * kPictureHeight_px * 3 &&
         std::all_of(data.begin(), data.end(), [&](std::uint8_t byte) { return byte == data.front(); });
}

std::string camera_port(int camera) { return "/giver/camera" + std::to_string(camera) + ":o"; }

// Writes `count` numbered commands, each with the time when it was due, when it reads "go"; and, as a robot
// does on the same thread, the pictures of `cameras` at 30 Hz.
Status giver(Node& node) {
  auto out = node.open_output<msgs::String>("/giver/command:o", Profile::kCommand);
  const auto count = node.parameter<int>("count", 1000);
  const auto cameras = node.parameter<int>("cameras", 0);
  if (!out || !count || !cameras) {
    return Error{ErrorCode::kFailed, "cannot begin"};
  }
  std::vector<std::unique_ptr<ImageOutput>> eyes;
  for (int camera = 0; camera < *cameras; ++camera) {
    auto eye = ImageOutput::open(node, camera_port(camera));
    if (!eye) {
      return eye.error();
    }
    eyes.push_back(std::move(*eye));
  }
  node.set_ready();
  bool all = (*out)->wait_for_readers(1, 30.0);
  for (const auto& eye : eyes) {
    all = all && eye->port().wait_for_readers(1, 30.0);
  }
  say(all ? "CONNECTED" : "ALONE");
  std::string line;
  std::getline(std::cin, line);
  double longest_ms = 0;
  for (int i = 1; i <= *count; ++i) {
    const std::int64_t due_ns = steady_ns();
    if (i % 16 == 1) {
      for (const auto& eye : eyes) {
        (void)write_picture(*eye, i / 16);
      }
      longest_ms = std::max(longest_ms, static_cast<double>(steady_ns() - due_ns) * 1e-6);
    }
    if (auto status = (*out)->write(words(std::to_string(i) + " " + std::to_string(due_ns))); !status) {
      return status;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  say("GIVEN pictures held up at most " + std::to_string(longest_ms) + " ms");
  std::getline(std::cin, line);
  return {};
}

// Takes as many, and at least so many `pictures`; says whether they came once each and in order, and how long
// they took.
Status taker(Node& node) {
  auto in = node.open_input<msgs::String>("/taker/command:i", Profile::kCommand);
  const auto count = node.parameter<int>("count", 1000);
  const auto cameras = node.parameter<int>("cameras", 0);
  const auto least_pictures = node.parameter<int>("pictures", 0);
  if (!in || !count || !cameras || !least_pictures) {
    return Error{ErrorCode::kFailed, "cannot begin"};
  }
  std::vector<std::unique_ptr<Input<msgs::Image>>> eyes;
  for (int camera = 0; camera < *cameras; ++camera) {
    auto eye =
        node.open_input<msgs::Image>("/taker/camera" + std::to_string(camera) + ":i", Profile::kSensor);
    if (!eye) {
      return eye.error();
    }
    if (auto status = (*eye)->connect(camera_port(camera)); !status) {
      return status;
    }
    eyes.push_back(std::move(*eye));
  }
  if (!(*in)->wait_for_sources(1, 30.0)) {
    return Error{ErrorCode::kTimeout, "no source"};
  }
  node.set_ready();
  say("READY");
  std::vector<double> delays_ms;
  bool in_order = true;
  int pictures = 0;
  int broken = 0;
  const auto is_done = [&] {
    return static_cast<int>(delays_ms.size()) >= *count && pictures >= *least_pictures;
  };
  while (!is_done() && (*in)->wait_for_message(30.0)) {
    for (auto message = (*in)->take(); message && static_cast<int>(delays_ms.size()) < *count;
         message = (*in)->take()) {
      std::istringstream text(message->data());
      int number = 0;
      std::int64_t written_ns = 0;
      text >> number >> written_ns;
      delays_ms.push_back(static_cast<double>(steady_ns() - written_ns) * 1e-6);
      in_order = in_order && number == static_cast<int>(delays_ms.size());
    }
    for (const auto& eye : eyes) {
      while (const auto picture = eye->take()) {
        ++(is_whole(*picture) ? pictures : broken);
      }
    }
  }
  std::sort(delays_ms.begin(), delays_ms.end());
  const auto share = [&](double part) {
    return delays_ms.empty()
               ? 0.0
               : delays_ms[static_cast<std::size_t>(part * static_cast<double>(delays_ms.size() - 1))];
  };
  say("DELAY_MS p50 " + std::to_string(share(0.5)) + " p99 " + std::to_string(share(0.99)) + "; " +
      std::to_string(pictures) + " pictures" + (broken > 0 ? ", others broken" : ""));
  say("TAKEN " + std::to_string(delays_ms.size()) + (in_order ? " in order" : " out of order"));
  return {};
}

// Writes and reads without a pause, small and large, until it is killed.
Status victim(Node& node) {
  // a test that is killed itself leaves none behind
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::string name = node.options().name;
  auto out = node.open_output<msgs::String>("/" + name + "/out:o", Profile::kEvent);
  auto in = open_direct_input<msgs::String>(
      node, "/" + name + "/in:i", Profile::kEvent,
      [](const msgs::String& message, const Arrival&) { is_even(message.data()) ? void() : std::abort(); });
  if (!out || !in) {
    return Error{ErrorCode::kFailed, "cannot open the ports"};
  }
  if (auto status = (*in)->connect("/watcher/out:o"); !status) {
    return status;
  }
  node.set_ready();
  say("READY");
  std::minstd_rand chance(static_cast<unsigned>(node.options().seed));
  for (char letter = 'a';; letter = letter == 'z' ? 'a' : static_cast<char>(letter + 1)) {
    const std::size_t size = chance() % 4 == 0 ? 40000 + chance() % 100000 : 1 + chance() % 200;
    (void)(*out)->write(words(std::string(size, letter)));
  }
}

// Does not look at signals.
Status stubborn(Node& node) {
  node.set_ready();
  say("READY");
  for (;;) {
    std::this_thread::sleep_for(std::chrono::hours(1));
  }
}

}  // namespace

}  // namespace nido

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto body = what == "member"     ? nido::member
                    : what == "owner"    ? nido::owner
                    : what == "viewer"   ? nido::viewer
                    : what == "source"   ? nido::source
                    : what == "listener" ? nido::listener
                    : what == "idle"     ? nido::idle
                    : what == "giver"    ? nido::giver
                    : what == "taker"    ? nido::taker
                    : what == "stubborn" ? nido::stubborn
                    : what == "victim"   ? nido::victim
                                         : nullptr;
  if (body == nullptr) {
    std::cerr << "peer: '" << what << "' is unknown\n";
    return 2;
  }
  return nido::node_main(argc - 1, argv + 1, what, body);
}
