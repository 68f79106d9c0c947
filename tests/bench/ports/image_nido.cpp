// Images through nido's ports.
#include <atomic>
#include <thread>

#include "image_way.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"

namespace nido::bench {

namespace {

constexpr double kPatience_s = 20.0;

Result<std::unique_ptr<Node>> make_node(const std::string& name, int domain) {
  NodeOptions options;
  options.name = name;
  options.domain = domain;
  options.handle_signals = false;
  return Node::create(std::move(options));
}

class Source final : public ImageSource {
 public:
  static Result<std::unique_ptr<ImageSource>> make(int domain) {
    auto self = std::make_unique<Source>();
    auto node = make_node("image_source", domain);
    if (!node) return node.error();
    self->node_ = std::move(*node);
    auto out = self->node_->open_output<msgs::Image>("/bench/image:o", Profile::kSensor);
    if (!out) return out.error();
    self->out_ = std::move(*out);
    self->image_.width(kWidth);
    self->image_.height(kHeight);
    self->image_.step(kWidth * 3);
    self->image_.encoding("rgb8");
    self->image_.data().resize(kImage_bytes);
    return std::unique_ptr<ImageSource>(std::move(self));
  }
  Status connect() override {
    if (out_->wait_for_readers(1, kPatience_s)) return {};
    return Error{ErrorCode::kTimeout, "the receiving node did not appear"};
  }
  void send(const std::function<void(std::uint8_t*)>& fill) override {
    fill(image_.data().data());
    (void)out_->write(image_);
  }

 private:
  std::unique_ptr<Node> node_;
  std::unique_ptr<Output<msgs::Image>> out_;
  msgs::Image image_;
};

Status receive(int domain, const std::string& /*address*/, const ImageSink& sink,
               const std::function<void()>& wait) {
  auto node = make_node("image_sink", domain);
  if (!node) return node.error();
  auto in = (*node)->open_input<msgs::Image>("/bench/image:i", Profile::kSensor);
  if (!in) return in.error();
  if (auto status = (*in)->connect("/bench/image:o"); !status) return status;
  std::atomic<bool> is_over{false};
  std::thread worker([&] {
    while (!is_over) {
      if (!(*in)->wait_for_message(0.2)) continue;
      while (const auto image = (*in)->take()) sink(image->data());
    }
  });
  wait();
  is_over = true;
  worker.join();
  return {};
}

}  // namespace

ImageWay nido_image() { return {"nido port", "", Source::make, receive}; }

}  // namespace nido::bench
