// Frames by lines of text.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "nido/textproto/task_text.h"
#include "task_words.h"

namespace nido {
namespace {

using namespace task_words;
using text_line::text_of;
using text_line::word;

constexpr std::size_t kPose = 7;

// a name as a string, whatever is in it
std::string quoted(const std::string& name) { return format_text({TextValue{name}}); }

class AskedFrames final : public IFrameTransforms {
 public:
  explicit AskedFrames(AskLine ask) : ask_(std::move(ask)) {}

  Result<std::vector<Frame>> frames() const override {
    const Result<Values> words = answered(ask_, "get frames");
    if (!words) return words.error();
    std::vector<Frame> all;
    const TextValue::List* list = words->empty() ? nullptr : words->front().list();
    if (list == nullptr) return strange();
    for (const TextValue& entry : *list) {
      if (entry.list() == nullptr || entry.list()->size() != 3 || !entry.list()->back().is_number()) {
        return strange();
      }
      all.push_back({std::string(text_of(*entry.list(), 0)), std::string(text_of(*entry.list(), 1)),
                     entry.list()->back().number() != 0});
    }
    return all;
  }
  Result<FrameTransform> transform(const std::string& base, const std::string& frame) const override {
    const Result<Values> words =
        answered(ask_, fmt::format("get transform {} {}", quoted(base), quoted(frame)));
    if (!words) return words.error();
    const auto n = flat(*words, {0, kPose});
    const Result<Eigen::Isometry3d> pose = n ? pose_from(std::span(*n).subspan(1)) : strange();
    if (!pose) return strange();
    return FrameTransform{*pose, std::llround(n->front() * 1e9)};
  }
  Status put(const std::string& parent, const std::string& name,
             const Eigen::Isometry3d& X_ParentFrame) override {
    // what cannot be written down as a place and a quaternion
    if (!X_ParentFrame.matrix().allFinite() || !X_ParentFrame.linear().isUnitary(1e-6)) {
      return Error{ErrorCode::kInvalidArgument, "the pose of a frame has finite numbers and a turn"};
    }
    std::string line = fmt::format("put {} {}", quoted(parent), quoted(name));
    for (const double number : pose_numbers(X_ParentFrame)) line += " " + format_number(number);
    return ordered(ask_, line);
  }
  Status remove(const std::string& name) override { return ordered(ask_, "remove " + quoted(name)); }

 private:
  AskLine ask_;
};

}  // namespace

std::string frames_reply(IFrameTransforms& frames, const std::string& line) {
  const Result<Values> parsed = parse_text(line);
  if (!parsed) return fail(parsed.error().message);
  const Values& words = *parsed;
  const auto name = [&](std::size_t at) { return std::string(text_of(words, at)); };
  if (name(0) == "get" && name(1) == "frames" && words.size() == 2) {
    const Result<std::vector<Frame>> all = frames.frames();
    if (!all) return fail(all.error().message);
    TextValue::List list;
    for (const Frame& frame : *all) {
      list.push_back({TextValue::List{{frame.name}, {frame.parent}, {frame.is_put ? 1LL : 0LL}}});
    }
    return format_text({word("is"), TextValue{TextValue::Word{"frames"}}, {std::move(list)}, word("ok")});
  }
  if (name(0) == "get" && name(1) == "transform" && words.size() == 4) {
    const Result<FrameTransform> found = frames.transform(name(2), name(3));
    if (!found) return fail(found.error().message);
    return fmt::format("[is] transform {} {} [ok]",
                       format_number(static_cast<double>(found->stamp_ns) * 1e-9),
                       list(pose_numbers(found->X_BaseFrame)));
  }
  if (name(0) == "put" && words.size() == 3 + kPose) {
    const Result<Eigen::Isometry3d> pose = pose_from(numbers_from(words, 3));
    return pose ? outcome(frames.put(name(1), name(2), *pose)) : fail(pose.error().message);
  }
  if (name(0) == "remove" && words.size() == 2) return outcome(frames.remove(name(1)));
  return fail(
      "get frames, get transform BASE FRAME, put PARENT FRAME X Y Z QX QY QZ QW and remove FRAME are "
      "understood");
}

std::unique_ptr<IFrameTransforms> asked_frames(AskLine ask) {
  return std::make_unique<AskedFrames>(std::move(ask));
}

}  // namespace nido
