#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "client_connection.h"
#include "nido/interfaces/spoken_to.h"
#include "nido/middleware/typed_port.h"
#include "nido/wrappers/clients.h"
#include "nido/wrappers/servers.h"
#include "stamps.h"

namespace nido {
namespace {

// pieces that a slow reader may be behind, about two and a half seconds
constexpr std::size_t kPiecesKept = 128;

class AudioServer final : public IServer {
 public:
  AudioServer(std::string stem, IAudioGrabberSound& audio, std::int64_t period_ns, std::string frame_id)
      : stem_(std::move(stem)),
        audio_(audio),
        due_(period_ns),
        frame_id_(std::move(frame_id)),
        piece_frames_(static_cast<std::size_t>(period_ns * audio.sample_rate_hz() / 1'000'000'000)) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::Audio>(stem_ + ":o", Profile::kEvent, kPiecesKept);
    if (!output) return output.error();
    output_ = std::move(*output);
    if (auto* spoken_to = dynamic_cast<ISpokenTo*>(&audio_)) {
      auto service = node.open_service(
          stem_ + "/rpc:i", [spoken_to](const std::string& line) { return answer_of(*spoken_to, line); });
      if (!service) return service.error();
      service_ = std::move(*service);
    }
    return audio_.start();
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    // more than one piece when the caller's period is longer than a piece
    for (;;) {
      Result<Sound> sound = audio_.get_sound(piece_frames_);
      if (!sound) return Error{sound.error().code, stem_ + ": " + sound.error().message};
      if (sound->samples.empty()) return {};
      const bool is_last = sound->frames() < piece_frames_;
      msgs::Audio message;
      message.header(header(sound->stamp_ns, frame_id_));
      message.sample_rate_hz(static_cast<std::uint32_t>(sound->sample_rate_hz));
      message.channels(static_cast<std::uint32_t>(sound->channels));
      message.samples(std::move(sound->samples));
      if (Status written = output_->write(message); !written) return written;
      if (is_last) return {};
    }
  }

 private:
  static std::string answer_of(ISpokenTo& spoken_to, const std::string& line) {
    constexpr std::string_view kSay = "say ";
    if (!line.starts_with(kSay)) return "say TEXT: somebody in the room says it to the robot";
    const Result<double> begin_s = spoken_to.say(line.substr(kSay.size()));
    if (!begin_s) return "[fail] \"" + begin_s.error().message + "\"";
    return fmt::format("ok, at {:.2f} s", *begin_s);
  }

  const std::string stem_;
  IAudioGrabberSound& audio_;
  Due due_;
  const std::string frame_id_;
  const std::size_t piece_frames_;
  std::unique_ptr<Output<msgs::Audio>> output_;
  std::unique_ptr<Node::Service> service_;
};

class AudioClient final : public IAudioGrabberSound {
 public:
  AudioClient(Node& node, ClientOptions options) : node_(node), options_(std::move(options)) {}

  Status open() {
    auto input = open_connected<msgs::Audio>(node_, options_, "", Profile::kEvent, kPiecesKept);
    if (!input) return input.error();
    input_ = std::move(*input);
    // rate and channels are told by the first piece
    if (!input_->wait_for_message(options_.timeout_s)) {
      return Error{ErrorCode::kTimeout,
                   options_.remote + ":o: no sound within " + std::to_string(options_.timeout_s) + " s"};
    }
    const std::optional<msgs::Audio> first = input_->take();
    if (!first || first->channels() == 0 || first->sample_rate_hz() == 0) {
      return Error{ErrorCode::kFailed, options_.remote + ":o: sound without a rate or channels"};
    }
    sample_rate_hz_ = static_cast<int>(first->sample_rate_hz());
    channels_ = static_cast<int>(first->channels());
    return {};
  }

  int sample_rate_hz() const override { return sample_rate_hz_; }
  int channels() const override { return channels_; }

  Status start() override {
    const std::lock_guard lock(mutex_);
    if (!started_) forget();
    started_ = true;
    return {};
  }
  Status stop() override {
    const std::lock_guard lock(mutex_);
    forget();
    started_ = false;
    return {};
  }

  Result<Sound> get_sound(std::size_t max_frames) override {
    const std::lock_guard lock(mutex_);
    if (!started_) return Error{ErrorCode::kFailed, options_.remote + ": start() was not called"};
    if (rest_.samples.empty()) {
      if (std::optional<msgs::Audio> message = input_->take()) {
        if (static_cast<int>(message->channels()) != channels_ ||
            static_cast<int>(message->sample_rate_hz()) != sample_rate_hz_) {
          return Error{ErrorCode::kFailed, options_.remote + ":o: the sound's rate or channels changed"};
        }
        rest_ = {to_ns(message->header().stamp()), sample_rate_hz_, channels_, std::move(message->samples())};
      }
    }
    const std::size_t frames = std::min(max_frames, rest_.frames());
    const auto end = rest_.samples.begin() + static_cast<std::ptrdiff_t>(frames) * channels_;
    Sound sound{rest_.stamp_ns, sample_rate_hz_, channels_, {rest_.samples.begin(), end}};
    rest_.samples.erase(rest_.samples.begin(), end);
    rest_.stamp_ns += static_cast<std::int64_t>(frames) * 1'000'000'000 / sample_rate_hz_;
    return sound;
  }

 private:
  void forget() {
    input_->take_latest();
    rest_.samples.clear();
  }

  Node& node_;
  const ClientOptions options_;
  std::mutex mutex_;
  std::unique_ptr<Input<msgs::Audio>> input_;
  int sample_rate_hz_ = 0;
  int channels_ = 0;
  bool started_ = false;
  Sound rest_;  // of the piece that was begun
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_audio(Node& node, const std::string& stem, IAudioGrabberSound& audio,
                                             std::int64_t period_ns, const std::string& frame_id) {
  auto server = std::make_unique<AudioServer>(stem, audio, period_ns, frame_id);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<IAudioGrabberSound>> audio_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<AudioClient>(node, options);
  if (Status opened = client->open(); !opened) return opened.error();
  return std::unique_ptr<IAudioGrabberSound>(std::move(client));
}

}  // namespace nido
