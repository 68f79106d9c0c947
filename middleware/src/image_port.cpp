#include "nido/middleware/image_port.h"

#include <cstring>
#include <optional>

namespace nido {

namespace {

// CDR as Fast DDS writes sensor_msgs/msg/Image: little endian, numbers at multiples of their size, counted
// from behind the encapsulation.
constexpr std::size_t kEncapsulation_bytes = 4;

class CdrWriter {
 public:
  // Without a place: only counts.
  explicit CdrWriter(std::uint8_t* place) : place_(place) {}
  void number(std::uint32_t value) {
    align();
    bytes(&value, sizeof value);
  }
  void octet(std::uint8_t value) { bytes(&value, sizeof value); }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes(value.c_str(), value.size() + 1);
  }
  [[nodiscard]] std::size_t size() const { return kEncapsulation_bytes + size_; }

 private:
  void align() {
    constexpr std::uint32_t kZero = 0;
    bytes(&kZero, (4 - size_ % 4) % 4);
  }
  void bytes(const void* from, std::size_t count) {
    if (place_ != nullptr) {
      std::memcpy(place_ + kEncapsulation_bytes + size_, from, count);
    }
    size_ += count;
  }
  std::uint8_t* const place_;
  std::size_t size_ = 0;
};

// Everything before the pixels. Returns where they begin.
[[gnu::hot]] std::size_t write_head(std::uint8_t* place, const ImageFormat& format, Time time,
                                    std::size_t pixels) {
  if (place != nullptr) {
    constexpr std::uint8_t kLittleEndian[kEncapsulation_bytes] = {0, 1, 0, 0};
    std::memcpy(place, kLittleEndian, sizeof kLittleEndian);
  }
  CdrWriter out(place);
  out.number(static_cast<std::uint32_t>(time.ns / 1'000'000'000));
  out.number(static_cast<std::uint32_t>(time.ns % 1'000'000'000));
  out.text(format.frame_id);
  out.number(format.height);
  out.number(format.width);
  out.text(format.encoding);
  out.octet(0);
  out.number(format.step);
  out.number(static_cast<std::uint32_t>(pixels));
  return out.size();
}

class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> from) : from_(from) {}
  std::uint32_t number() {
    at_ += (4 - at_ % 4) % 4;
    std::uint32_t value = 0;
    if (has(sizeof value)) {
      std::memcpy(&value, from_.data() + at_, sizeof value);
      at_ += sizeof value;
    }
    return value;
  }
  void octet() { at_ += has(1) ? 1 : 0; }
  std::span<const std::uint8_t> bytes(std::size_t count) {
    if (!has(count)) {
      return {};
    }
    const auto part = from_.subspan(at_, count);
    at_ += count;
    return part;
  }
  std::string_view text() {
    const auto part = bytes(number());
    if (part.empty() || part.back() != 0) {
      is_whole_ = false;
      return {};
    }
    return {reinterpret_cast<const char*>(part.data()), part.size() - 1};
  }
  [[nodiscard]] bool is_whole() const { return is_whole_; }

 private:
  bool has(std::size_t count) {
    is_whole_ = is_whole_ && at_ <= from_.size() && count <= from_.size() - at_;
    return is_whole_;
  }
  const std::span<const std::uint8_t> from_;
  std::size_t at_ = 0;
  bool is_whole_ = true;
};

}  // namespace

Result<std::unique_ptr<ImageOutput>> ImageOutput::open(Node& node, const std::string& port_name,
                                                       Profile profile) {
  auto port = node.open_raw_output(port_name, message_type_of<msgs::Image>(), profile, 16);
  if (!port) {
    return port.error();
  }
  auto self = std::make_unique<ImageOutput>();
  self->port_ = std::move(*port);
  return self;
}

[[gnu::hot]] Result<std::span<std::uint8_t>> ImageOutput::begin(const ImageFormat& format, Time time) {
  const std::size_t pixels = std::size_t{format.height} * format.step;
  if (pixels == 0 || pixels > 1'000'000'000) {
    return Error{ErrorCode::kInvalidArgument, "an image of " + std::to_string(format.height) + " rows of " +
                                                  std::to_string(format.step) +
                                                  " bytes is not allowed: 1 to 1000000000 bytes in all"};
  }
  bytes_ = 0;
  const std::size_t head = write_head(nullptr, format, time, pixels);
  auto place = loan(*port_, head + pixels);
  if (!place) {
    return place;
  }
  write_head(place->data(), format, time, pixels);
  bytes_ = head + pixels;
  return place->subspan(head);
}

[[gnu::hot]] Status ImageOutput::send() {
  if (bytes_ == 0) {
    return Error{ErrorCode::kInvalidArgument,
                 "port " + port_->name() + " has no image to send: begin() first"};
  }
  return write_loan(*port_, std::exchange(bytes_, 0));
}

[[gnu::hot]] Result<ImageView> view_image(std::span<const std::uint8_t> payload) {
  const auto broken = [&] {
    return Error{ErrorCode::kInvalidArgument,
                 "these " + std::to_string(payload.size()) + " bytes are not a whole image message"};
  };
  if (payload.size() < kEncapsulation_bytes || payload[1] != 1) {
    return broken();
  }
  CdrReader in(payload.subspan(kEncapsulation_bytes));
  ImageView view;
  const auto seconds = static_cast<std::int32_t>(in.number());
  view.time.ns = std::int64_t{seconds} * 1'000'000'000 + in.number();
  view.frame_id = in.text();
  view.height = in.number();
  view.width = in.number();
  view.encoding = in.text();
  in.octet();
  view.step = in.number();
  view.pixels = in.bytes(in.number());
  return in.is_whole() ? Result<ImageView>(view) : Result<ImageView>(broken());
}

Result<std::unique_ptr<RawInput>> open_image_input(
    Node& node, const std::string& port_name, Profile profile,
    std::function<void(const ImageView& image, const Arrival& arrival)> handler) {
  return open_with_handler(node, port_name, message_type_of<msgs::Image>(), profile, [&](RawInput& input) {
    return hand_over_payload(
        input, [handler = std::move(handler)](std::span<const std::uint8_t> payload, const Arrival& arrival) {
          if (const auto image = view_image(payload)) {
            handler(*image, arrival);
          }
        });
  });
}

}  // namespace nido
