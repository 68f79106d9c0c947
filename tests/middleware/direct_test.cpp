// Handlers, images in place, loops without allocations.
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <new>
#include <sstream>

#include "nido/middleware/direct_port.h"
#include "nido/middleware/image_port.h"
#include "test_node.h"

namespace {

std::atomic<long> g_allocations{0};
// only of threads that say so
thread_local bool t_is_counted = false;

void* allocate(std::size_t size) {
  if (t_is_counted) {
    g_allocations.fetch_add(1);
  }
  if (void* memory = std::malloc(size == 0 ? 1 : size)) {
    return memory;
  }
  throw std::bad_alloc();
}

}  // namespace

// With some options GCC takes one of these into its caller and not the other, and sees free() for what came
// from operator new.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace nido::testing {

namespace {

// Waits for a number to be reached.
class Tally {
 public:
  void add() {
    {
      const std::lock_guard lock(mutex_);
      ++count_;
    }
    changed_.notify_all();
  }
  bool wait_for(int count) {
    return wait_until([this, count] { return count_ >= count; });
  }
  // Asks at every change.
  template <class Holds>
  bool wait_until(Holds holds) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(kPatience_s), holds);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int count_ = 0;
};

TEST(Direct, AHandlerGetsEachMessageInOrderAndNoneIsKept) {
  const auto giver = make_node("giver");
  const auto taker = make_node("taker");
  const auto out = make_output<msgs::String>(*giver, "/giver/out:o", Profile::kCommand);
  std::vector<std::string> got;
  Tally tally;
  auto in = open_direct_input<msgs::String>(*taker, "/taker/in:i", Profile::kCommand,
                                            [&](const msgs::String& message, const Arrival& arrival) {
                                              EXPECT_EQ(arrival.source, "/giver/out:o");
                                              EXPECT_EQ(arrival.sequence, got.size() + 1);
                                              got.push_back(message.data());
                                              tally.add();
                                            });
  ASSERT_TRUE(in.ok()) << in.error().message;
  ASSERT_TRUE((*in)->connect("/giver/out:o"));
  ASSERT_TRUE(out->wait_for_readers(1, kPatience_s));
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(out->write(text(std::to_string(i))));
  }
  ASSERT_TRUE(tally.wait_for(1000));
  EXPECT_FALSE((*in)->take());
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_EQ(got[i], std::to_string(i));
  }
  const auto second = hand_over(**in, [](const void*, const Arrival&) {});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kInvalidArgument);
}

TEST(Direct, InLockstepThereAreNoHandlers) {
  auto options = options_of("stepper");
  options.clock = ClockMode::kLockstep;
  const auto node = make_node(std::move(options));
  const auto in = open_direct_input<msgs::String>(*node, "/stepper/in:i", Profile::kEvent,
                                                  [](const msgs::String&, const Arrival&) {});
  ASSERT_FALSE(in.ok());
  EXPECT_EQ(in.error().code, ErrorCode::kUnsupported);
}

// true if the address lies in memory that a lane shares
bool is_shared(const void* address) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    char dash = 0;
    words >> std::hex >> begin >> dash >> end;
    const auto place = reinterpret_cast<std::uintptr_t>(address);
    if (place >= begin && place < end) {
      return line.find("memfd:nido-lane") != std::string::npos;
    }
  }
  return false;
}

// An output of images and an input that hands each of them over, connected.
class ImageLine {
 public:
  using Handler = std::function<void(const ImageView& image, const Arrival& arrival)>;
  ImageLine(Profile profile, Handler handler) : giver_(make_node("giver")), taker_(make_node("taker")) {
    auto out = ImageOutput::open(*giver_, "/giver/image:o", profile);
    auto in = open_image_input(*taker_, "/taker/image:i", profile, std::move(handler));
    EXPECT_TRUE(out.ok()) << out.error().message;
    EXPECT_TRUE(in.ok()) << in.error().message;
    out_ = std::move(*out);
    in_ = std::move(*in);
    EXPECT_TRUE(in_->connect("/giver/image:o"));
    EXPECT_TRUE(out_->port().wait_for_readers(1, kPatience_s));
  }
  [[nodiscard]] ImageOutput& out() { return *out_; }
  [[nodiscard]] Node& taker() { return *taker_; }
  [[nodiscard]] ConnectionCounters counters() const { return in_->connections().at(0); }
  // An image of 640 columns that begins with a number.
  void send(std::uint8_t first, std::uint32_t rows = 480) {
    auto pixels = out_->begin({640, rows, 1920, "rgb8", "eye"}, Time{});
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    pixels->front() = first;
    ASSERT_TRUE(out_->send());
  }
  void close_output() { out_.reset(); }

 private:
  std::unique_ptr<Node> giver_;
  std::unique_ptr<Node> taker_;
  std::unique_ptr<ImageOutput> out_;
  std::unique_ptr<RawInput> in_;
};

TEST(Direct, ImagesAreReadWhereTheyWerePaintedAndByOrdinaryInputsToo) {
  Tally tally;
  std::vector<std::uint8_t> firsts;
  ImageLine line(Profile::kEvent, [&](const ImageView& image, const Arrival&) {
    EXPECT_EQ(image.width, 640U);
    EXPECT_EQ(image.height, 480U);
    EXPECT_EQ(image.step, 1920U);
    EXPECT_EQ(image.encoding, "rgb8");
    EXPECT_EQ(image.frame_id, "left_eye");
    EXPECT_EQ(image.time.ns, 5'000'000'007);
    EXPECT_EQ(image.pixels.size(), 921600U);
    EXPECT_EQ(image.pixels.front(), image.pixels.back());
    EXPECT_TRUE(is_shared(image.pixels.data()));
    EXPECT_TRUE(is_shared(&image.pixels.back()));
    firsts.push_back(image.pixels.front());
    tally.add();
  });
  const auto ordinary = make_input<msgs::Image>(line.taker(), "/taker/ordinary:i", Profile::kEvent);
  ASSERT_TRUE(ordinary->connect("/giver/image:o"));
  ASSERT_TRUE(line.out().port().wait_for_readers(2, kPatience_s));
  for (int i = 1; i <= 30; ++i) {
    auto pixels = line.out().begin({640, 480, 1920, "rgb8", "left_eye"}, Time{5'000'000'007});
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    ASSERT_EQ(pixels->size(), 921600U);
    EXPECT_TRUE(is_shared(pixels->data()));
    std::fill(pixels->begin(), pixels->end(), static_cast<std::uint8_t>(i));
    ASSERT_TRUE(line.out().send());
    ASSERT_TRUE(ordinary->wait_for_message(kPatience_s));
    const auto image = ordinary->take();
    ASSERT_TRUE(image);
    EXPECT_EQ(image->header().frame_id(), "left_eye");
    EXPECT_EQ(image->header().stamp().sec(), 5);
    EXPECT_EQ(image->encoding(), "rgb8");
    ASSERT_EQ(image->data().size(), 921600U);
    EXPECT_EQ(image->data().back(), i);
    ASSERT_TRUE(tally.wait_for(i));
    EXPECT_EQ(firsts.back(), i);
  }
  EXPECT_FALSE(line.out().send().ok()) << "there is no image to send";
}

TEST(Direct, AnImageThatWasBegunAndNotSentKeepsNobodyWaiting) {
  Tally tally;
  std::vector<std::uint8_t> firsts;
  ImageLine line(Profile::kEvent, [&](const ImageView& image, const Arrival&) {
    firsts.push_back(image.pixels.front());
    tally.add();
  });
  const std::vector<std::uint8_t> expected{0, 1, 2, 3, 4, 5, 6, 7};
  for (const std::uint8_t i : expected) {
    for (const bool is_sent : {false, true}) {
      auto pixels = line.out().begin({640, 480, 1920, "rgb8", "eye"}, Time{});
      ASSERT_TRUE(pixels.ok()) << pixels.error().message;
      std::fill(pixels->begin(), pixels->end(), is_sent ? i : 99);
      if (is_sent) {
        ASSERT_TRUE(line.out().send());
      }
    }
    ASSERT_TRUE(tally.wait_for(i + 1));
  }
  EXPECT_EQ(firsts, expected);
  EXPECT_EQ(line.counters().received, expected.size());
  EXPECT_EQ(line.counters().lost, 0U);
}

TEST(Direct, LargeAndSmallImagesComeInTheirOrder) {
  Tally tally;
  std::vector<std::uint64_t> sequences;
  std::vector<std::uint8_t> firsts;
  std::vector<std::size_t> sizes;
  ImageLine line(Profile::kEvent, [&](const ImageView& image, const Arrival& arrival) {
    sequences.push_back(arrival.sequence);
    firsts.push_back(image.pixels.front());
    sizes.push_back(image.pixels.size());
    tally.add();
  });
  // large ones are told on a board when the input has read all, and go over the socket when it is behind
  constexpr int kRounds = 200;
  constexpr std::array<std::uint32_t, 6> kRows{2, 2, 480, 480, 2, 480};
  std::vector<std::uint8_t> expected_firsts;
  std::vector<std::size_t> expected_sizes;
  for (int round = 0; round < kRounds; ++round) {
    for (const std::uint32_t rows : kRows) {
      expected_firsts.push_back(static_cast<std::uint8_t>(expected_firsts.size()));
      expected_sizes.push_back(std::size_t{rows} * 1920);
      line.send(expected_firsts.back(), rows);
    }
    ASSERT_TRUE(tally.wait_for(static_cast<int>(expected_firsts.size())));
  }
  EXPECT_EQ(firsts, expected_firsts);
  EXPECT_EQ(sizes, expected_sizes);
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    ASSERT_EQ(sequences[i], i + 1);
  }
  EXPECT_EQ(line.counters().lost, 0U);
}

TEST(Direct, AnInputThatWasBehindGetsTheNextImages) {
  Tally tally;
  Tally let_go;
  std::atomic<std::uint64_t> newest{0};
  ImageLine line(Profile::kSensor, [&](const ImageView&, const Arrival& arrival) {
    EXPECT_GT(arrival.sequence, newest.load());
    newest = arrival.sequence;
    tally.add();
    EXPECT_TRUE(arrival.sequence != 3 || let_go.wait_for(1));
  });
  std::uint64_t written = 0;
  const auto write = [&] {
    line.send(0);
    ++written;
  };
  for (int i = 1; i <= 3; ++i) {
    write();
    ASSERT_TRUE(tally.wait_for(i));
  }
  // it is busy with the third one: three more wait for it, the others are lost
  for (int i = 0; i < 30; ++i) {
    write();
  }
  let_go.add();
  ASSERT_TRUE(tally.wait_until([&] { return newest.load() == 6; }));
  for (int i = 0; i < 20; ++i) {
    write();
    ASSERT_TRUE(tally.wait_until([&] { return newest.load() == written; })) << "image " << written;
  }
  EXPECT_EQ(line.counters().received, written - 27);
  EXPECT_EQ(line.counters().lost, 27U);
}

TEST(Direct, TheLastImageBeforeAnOutputGoesIsRead) {
  for (int round = 0; round < 10; ++round) {
    Tally tally;
    std::vector<std::uint8_t> firsts;
    ImageLine line(Profile::kEvent, [&](const ImageView& image, const Arrival&) {
      firsts.push_back(image.pixels.front());
      tally.add();
    });
    const std::vector<std::uint8_t> expected{1, 2, 3};
    for (const std::uint8_t first : expected) {
      line.send(first);
      ASSERT_TRUE(first == 3 || tally.wait_for(first));
    }
    line.close_output();
    ASSERT_TRUE(tally.wait_for(3)) << "round " << round;
    EXPECT_EQ(firsts, expected);
  }
}

TEST(Direct, ACutImageIsRefused) {
  msgs::Image image;
  image.header().frame_id("eye");
  image.width(4);
  image.height(2);
  image.step(12);
  image.encoding("rgb8");
  image.data().assign(24, 9);
  msgs::TypeSupportOf<msgs::Image>::type support;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(support.getSerializedSizeProvider(&image)());
  ASSERT_TRUE(support.serialize(&image, &payload));
  const auto whole = view_image({payload.data, payload.length});
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->frame_id, "eye");
  EXPECT_EQ(whole->step, 12U);
  EXPECT_EQ(whole->pixels.size(), 24U);
  for (std::size_t size = 0; size < payload.length; ++size) {
    EXPECT_FALSE(view_image({payload.data, size}).ok()) << size;
  }
}

TEST(Direct, AControlLoopAllocatesNothing) {
  const auto robot = make_node("robot");
  const auto loop = make_node("loop");
  const auto states = make_output<msgs::JointState>(*robot, "/robot/state:o", Profile::kState);
  const auto commands_out = make_output<msgs::JointCommand>(*loop, "/loop/command:o", Profile::kCommand);
  std::atomic<int> commands{0};
  auto commands_in = open_direct_input<msgs::JointCommand>(
      *robot, "/robot/command:i", Profile::kCommand,
      [&](const msgs::JointCommand& command, const Arrival&) { commands += command.value().size() == 16; });
  auto states_in =
      loop->open_raw_input("/loop/state:i", message_type_of<msgs::JointState>(), Profile::kState, 1);
  // the thread that receives for the loop is counted, too
  auto witness = open_direct_input<msgs::JointState>(
      *loop, "/loop/witness:i", Profile::kState,
      [](const msgs::JointState&, const Arrival&) { t_is_counted = true; });
  ASSERT_TRUE(commands_in.ok() && states_in.ok() && witness.ok());
  ASSERT_TRUE((*commands_in)->connect("/loop/command:o"));
  ASSERT_TRUE((*states_in)->connect("/robot/state:o"));
  ASSERT_TRUE((*witness)->connect("/robot/state:o"));
  ASSERT_TRUE(states->wait_for_readers(2, kPatience_s));
  ASSERT_TRUE(commands_out->wait_for_readers(1, kPatience_s));

  msgs::JointState sent;
  msgs::JointState state;
  msgs::JointCommand command;
  sent.name().resize(16, "joint");
  sent.position().resize(16);
  sent.velocity().resize(16);
  sent.effort().resize(16);
  command.mode("direct");
  command.joint().resize(16);
  command.value().resize(16);
  constexpr int kWarmUp = 200;
  constexpr int kRounds = 1000;
  for (int i = 0; i < kWarmUp + kRounds; ++i) {
    if (i == kWarmUp) {
      g_allocations = 0;
    }
    sent.position()[3] = i;
    ASSERT_TRUE(states->write(sent));
    t_is_counted = true;
    ASSERT_TRUE((*states_in)->wait_for_message(kPatience_s));
    ASSERT_TRUE(take_latest_into(**states_in, state));
    for (std::size_t joint = 0; joint < 16; ++joint) {
      command.joint()[joint] = static_cast<std::int32_t>(joint);
      command.value()[joint] = 0.5 * state.position()[joint];
    }
    const auto status = commands_out->write(command);
    t_is_counted = false;
    ASSERT_TRUE(status.ok());
    ASSERT_EQ(state.position()[3], i);
  }
  EXPECT_EQ(g_allocations.load(), 0);
  EXPECT_GT(commands.load(), kRounds / 2);
}

}  // namespace

}  // namespace nido::testing
