#include <mutex>
#include <utility>

#include "client_connection.h"
#include "nido/middleware/typed_port.h"
#include "nido/wrappers/clients.h"
#include "nido/wrappers/servers.h"
#include "stamps.h"

namespace nido {
namespace {

// sounds that may wait: a sentence is one of them, a stream of pieces of 20 ms many
constexpr std::size_t kSoundsKept = 512;

class SpeakerServer final : public IServer {
 public:
  SpeakerServer(Node& node, std::string stem, IAudioRender& speaker)
      : node_(node), stem_(std::move(stem)), speaker_(speaker) {}

  Status open() {
    auto input = node_.open_input<msgs::Audio>(stem_ + ":i", Profile::kEvent, kSoundsKept);
    if (!input) return input.error();
    input_ = std::move(*input);
    return speaker_.start();
  }

  Status publish(std::int64_t /*now_ns*/) override {
    while (const auto message = input_->take()) {
      const Status played =
          speaker_.render({to_ns(message->header().stamp()), static_cast<int>(message->sample_rate_hz()),
                           static_cast<int>(message->channels()), message->samples()});
      // whoever sent it is not this process's business to end for
      if (!played) node_.log_warning(stem_ + ":i: " + played.error().message);
    }
    return {};
  }

 private:
  Node& node_;
  const std::string stem_;
  IAudioRender& speaker_;
  std::unique_ptr<Input<msgs::Audio>> input_;
};

class SpeakerClient final : public IAudioRender {
 public:
  SpeakerClient(Node& node, ClientOptions options) : node_(node), options_(std::move(options)) {}

  Status open() {
    auto output = node_.open_output<msgs::Audio>(options_.local + ":o", Profile::kEvent, kSoundsKept);
    if (!output) return output.error();
    output_ = std::move(*output);
    const std::string speaker = options_.remote + ":i";
    if (Status connected = connect_output(node_, output_->name(), speaker, options_.timeout_s); !connected) {
      return connected;
    }
    if (!output_->wait_for_readers(1, options_.timeout_s)) {
      return Error{ErrorCode::kNotFound, speaker + " does not take from " + output_->name()};
    }
    return {};
  }

  Status start() override {
    const std::lock_guard lock(mutex_);
    started_ = true;
    return {};
  }
  Status stop() override {
    const std::lock_guard lock(mutex_);
    started_ = false;
    return {};
  }

  Status render(const Sound& sound) override {
    const std::lock_guard lock(mutex_);
    if (!started_) return Error{ErrorCode::kFailed, options_.remote + ": start() was not called"};
    if (Status valid = check_sound(sound); !valid) return valid;
    msgs::Audio message;
    message.header(header(sound.stamp_ns, ""));
    message.sample_rate_hz(static_cast<std::uint32_t>(sound.sample_rate_hz));
    message.channels(static_cast<std::uint32_t>(sound.channels));
    message.samples(sound.samples);
    return output_->write(message);
  }

 private:
  Node& node_;
  const ClientOptions options_;
  std::mutex mutex_;
  std::unique_ptr<Output<msgs::Audio>> output_;
  bool started_ = false;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_speaker(Node& node, const std::string& stem, IAudioRender& speaker) {
  auto server = std::make_unique<SpeakerServer>(node, stem, speaker);
  if (Status opened = server->open(); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<IAudioRender>> speaker_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<SpeakerClient>(node, options);
  if (Status opened = client->open(); !opened) return opened.error();
  return std::unique_ptr<IAudioRender>(std::move(client));
}

}  // namespace nido
