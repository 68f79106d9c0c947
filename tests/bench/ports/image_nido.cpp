// Images through nido's ports.
#include <atomic>
#include <thread>

#include "bench_node.h"
#include "image_way.h"
#include "nido/middleware/image_port.h"
#include "nido/middleware/typed_port.h"

namespace nido::bench {

namespace {

// Painted where it is read.
class Source final : public ImageSource {
 public:
  static Result<std::unique_ptr<ImageSource>> make(int domain) {
    auto self = std::make_unique<Source>();
    auto node = make_node("image_source", domain);
    if (!node) return node.error();
    self->node_ = std::move(*node);
    auto out = ImageOutput::open(*self->node_, "/bench/image:o");
    if (!out) return out.error();
    self->out_ = std::move(*out);
    return std::unique_ptr<ImageSource>(std::move(self));
  }
  Status connect() override {
    if (out_->port().wait_for_readers(1, kPatience_s)) return {};
    return Error{ErrorCode::kTimeout, "the receiving node did not appear"};
  }
  void send(const std::function<void(std::uint8_t*)>& fill) override {
    auto pixels = out_->begin({kWidth, kHeight, kWidth * 3, "rgb8", "left_eye"}, Time{});
    if (!pixels) return;
    fill(pixels->data());
    (void)out_->send();
  }

 private:
  std::unique_ptr<Node> node_;
  std::unique_ptr<ImageOutput> out_;
};

Status receive(int domain, const std::string& /*address*/, const ImageSink& sink,
               const std::function<void()>& wait) {
  auto node = make_node("image_sink", domain);
  if (!node) return node.error();
  auto in = open_image_input(**node, "/bench/image:i", Profile::kSensor,
                             [&sink](const ImageView& image, const Arrival&) { sink(image.pixels); });
  if (!in) return in.error();
  if (auto status = (*in)->connect("/bench/image:o"); !status) return status;
  wait();
  return {};
}

// The usual way: messages that are made, copied and taken.
class CopySource final : public ImageSource {
 public:
  static Result<std::unique_ptr<ImageSource>> make(int domain) {
    auto self = std::make_unique<CopySource>();
    auto node = make_node("image_copy_source", domain);
    if (!node) return node.error();
    self->node_ = std::move(*node);
    auto out = self->node_->open_output<msgs::Image>("/bench/copy:o", Profile::kSensor);
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

Status receive_copy(int domain, const std::string& /*address*/, const ImageSink& sink,
                    const std::function<void()>& wait) {
  auto node = make_node("image_copy_sink", domain);
  if (!node) return node.error();
  auto in = (*node)->open_input<msgs::Image>("/bench/copy:i", Profile::kSensor);
  if (!in) return in.error();
  if (auto status = (*in)->connect("/bench/copy:o"); !status) return status;
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

ImageWay nido_image() { return {"nido image port", "", Source::make, receive}; }
ImageWay nido_image_copied() { return {"nido port of images", "", CopySource::make, receive_copy}; }

}  // namespace nido::bench
