#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>

// How MCAP lays out values: little-endian integers, text and maps with their length in front.
namespace nido::mcap {

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead = 1 + 8;                    // opcode, length
inline constexpr std::size_t kFooterSize = kRecordHead + 8 + 8 + 4;  // with its head
inline constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;           // of a message's content
inline constexpr std::string_view kZstd = "zstd";

template <class T>
void put(std::string& bytes, T value) {
  static_assert(std::is_unsigned_v<T>);
  char text[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    text[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
  bytes.append(text, sizeof(T));
}
inline void put_text(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes.append(text);
}
inline void put_map(std::string& bytes, const std::map<std::string, std::string>& map) {
  std::string content;
  for (const auto& [key, value] : map) {
    put_text(content, key);
    put_text(content, value);
  }
  put_text(bytes, content);
}
inline void put_record(std::string& bytes, Op op, std::string_view content) {
  put(bytes, static_cast<std::uint8_t>(op));
  put(bytes, static_cast<std::uint64_t>(content.size()));
  bytes.append(content);
}

// Takes values off the front of some bytes. When they do not suffice, ok() turns false for good and zeros
// come.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

  template <class T>
  T take() {
    const std::string_view text = bytes(sizeof(T));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(text[i])) << (8 * i);
    }
    return static_cast<T>(value);
  }
  std::string_view bytes(std::uint64_t count) {
    if (!ok_ || count > bytes_.size()) {
      ok_ = false;
      bytes_ = {};
      return {};
    }
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  std::string_view text() { return bytes(take<std::uint32_t>()); }
  std::map<std::string, std::string> map() {
    std::map<std::string, std::string> entries;
    Cursor content(text());
    while (content.ok() && content.left() > 0) {
      const auto key = content.text();
      const auto value = content.text();
      if (content.ok()) entries[std::string(key)] = std::string(value);
    }
    ok_ = ok_ && content.ok();
    return entries;
  }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace nido::mcap
