#include "nido/recorder/mcap_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

#include "mcap_bytes.h"

namespace nido::mcap {
namespace {

// No honest chunk is larger; one that says so would only eat the memory.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30U;
// Messages outside of chunks are read in pieces of about this size.
constexpr std::uint64_t kLooseBytes = std::uint64_t{4} << 20U;

// A piece of the file that holds messages: a chunk record, or a run of records outside of chunks.
struct Block {
  std::uint64_t offset = 0;  // of the chunk's content, or of the first record
  std::uint64_t length = 0;
  bool is_chunk = false;
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::set<std::uint16_t> channels;  // with messages in it; empty: not known
};

struct Entry {
  std::uint64_t log_time_ns = 0;
  std::size_t offset = 0;  // of the message's content
  std::size_t length = 0;
};

// A block in memory, with what is left of it to be handed out.
struct Loaded {
  std::shared_ptr<const std::string> bytes;
  std::vector<Entry> entries;  // by log time
  std::size_t at = 0;
};

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

// Walks over the records of some bytes; false when they end in mid-record.
template <class Function>
bool each_record(std::string_view bytes, const Function& function) {
  Cursor cursor(bytes);
  while (cursor.left() > 0) {
    const auto op = static_cast<Op>(cursor.take<std::uint8_t>());
    const auto content = cursor.bytes(cursor.take<std::uint64_t>());
    if (!cursor.ok()) return false;
    function(op, content);
  }
  return true;
}

class FileReader final : public Reader {
 public:
  FileReader(std::string path, int fd, std::uint64_t size) : path_(std::move(path)), fd_(fd), size_(size) {}
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  ~FileReader() override { ::close(fd_); }

  Status begin() {
    std::string magic;
    if (!read(0, kMagic.size(), magic) || magic != kMagic) {
      return Error{ErrorCode::kInvalidArgument, path_ + " is no MCAP file: it does not begin as one"};
    }
    if (!read_summary()) {
      if (auto status = scan(); !status) return status;
    }
    // stable: where chunks begin at the same time, the file's order holds
    std::stable_sort(blocks_.begin(), blocks_.end(),
                     [](const Block& a, const Block& b) { return a.start_ns < b.start_ns; });
    rewind(0, {});
    return {};
  }

  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const override { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return metadata_; }
  [[nodiscard]] const std::map<std::uint16_t, std::uint64_t>& message_counts() const override {
    return counts_;
  }
  [[nodiscard]] std::uint64_t start_ns() const override { return start_ns_; }
  [[nodiscard]] std::uint64_t end_ns() const override { return end_ns_; }
  [[nodiscard]] const std::string& damage() const override { return damage_; }

  void rewind(std::uint64_t start_ns, std::set<std::uint16_t> channels) override {
    from_ns_ = start_ns;
    wanted_ = std::move(channels);
    next_block_ = 0;
    loaded_.clear();
    current_.reset();
  }

  std::optional<Message> next() override {
    for (;;) {
      std::erase_if(loaded_, [](const Loaded& one) { return one.at == one.entries.size(); });
      // the first of the earliest; of blocks that were loaded earlier when equal
      const auto first =
          std::min_element(loaded_.begin(), loaded_.end(), [](const Loaded& a, const Loaded& b) {
            return a.entries[a.at].log_time_ns < b.entries[b.at].log_time_ns;
          });
      const bool more = next_block_ < blocks_.size();
      if (more && (first == loaded_.end() ||
                   blocks_[next_block_].start_ns <= first->entries[first->at].log_time_ns)) {
        load_next();
        continue;
      }
      if (first == loaded_.end()) return std::nullopt;
      const Entry& entry = first->entries[first->at++];
      current_ = first->bytes;
      Cursor content(std::string_view(*current_).substr(entry.offset, entry.length));
      Message message;
      message.channel_id = content.take<std::uint16_t>();
      message.sequence = content.take<std::uint32_t>();
      message.log_time_ns = content.take<std::uint64_t>();
      message.publish_time_ns = content.take<std::uint64_t>();
      message.data = content.rest();
      return message;
    }
  }

 private:
  bool read(std::uint64_t offset, std::uint64_t length, std::string& bytes) const {
    if (offset > size_ || length > size_ - offset) return false;
    bytes.resize(length);
    std::size_t got = 0;
    while (got < length) {
      const ssize_t count = pread(fd_, bytes.data() + got, length - got, static_cast<off_t>(offset + got));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      got += static_cast<std::size_t>(count);
    }
    return true;
  }

  void note(const std::string& sentence) {
    if (damage_.find(sentence) == std::string::npos) damage_ += (damage_.empty() ? "" : "; ") + sentence;
  }

  void learn_schema(std::string_view content) {
    Cursor cursor(content);
    Schema schema;
    schema.id = cursor.take<std::uint16_t>();
    schema.name = cursor.text();
    schema.encoding = cursor.text();
    schema.data = cursor.text();
    if (cursor.ok() && schema.id != 0) schemas_.emplace(schema.id, std::move(schema));
  }
  void learn_channel(std::string_view content) {
    Cursor cursor(content);
    Channel channel;
    channel.id = cursor.take<std::uint16_t>();
    channel.schema_id = cursor.take<std::uint16_t>();
    channel.topic = cursor.text();
    channel.message_encoding = cursor.text();
    channel.metadata = cursor.map();
    if (cursor.ok()) channels_.emplace(channel.id, std::move(channel));
  }
  void learn_metadata(std::string_view content) {
    Cursor cursor(content);
    Metadata metadata;
    metadata.name = cursor.text();
    metadata.entries = cursor.map();
    if (cursor.ok()) metadata_.push_back(std::move(metadata));
  }

  // True if the file ends as it should and its summary says where everything is.
  bool read_summary() {
    std::string tail;
    const std::uint64_t tail_size = kFooterSize + kMagic.size();
    if (size_ < kMagic.size() + tail_size || !read(size_ - tail_size, tail_size, tail) ||
        !tail.ends_with(kMagic)) {
      return false;
    }
    Cursor footer(tail);
    const auto op = static_cast<Op>(footer.take<std::uint8_t>());
    const auto length = footer.take<std::uint64_t>();
    const auto start = footer.take<std::uint64_t>();
    footer.take<std::uint64_t>();
    const auto crc = footer.take<std::uint32_t>();
    const std::uint64_t footer_start = size_ - tail_size;
    if (op != Op::kFooter || length != kFooterSize - kRecordHead || start < kMagic.size() ||
        start > footer_start) {
      return false;
    }
    std::string summary;
    const std::uint64_t checked = footer_start - start + kFooterSize - 4;
    if (!read(start, checked, summary)) return false;
    if (crc != 0 && crc_of(summary) != crc) {
      note("the summary does not fit its checksum, so the file was gone through");
      return false;
    }
    summary.resize(footer_start - start);
    bool has_statistics = false;
    std::uint64_t messages = 0;
    const bool whole = each_record(summary, [&](Op record, std::string_view content) {
      if (record == Op::kSchema) learn_schema(content);
      if (record == Op::kChannel) learn_channel(content);
      if (record == Op::kChunkIndex) learn_chunk(content);
      if (record == Op::kStatistics) {
        has_statistics = true;
        messages = learn_statistics(content);
      }
      if (record == Op::kMetadataIndex) {
        Cursor cursor(content);
        const auto offset = cursor.take<std::uint64_t>();
        const auto size = cursor.take<std::uint64_t>();
        std::string bytes;
        if (cursor.ok() && size > kRecordHead && read(offset, size, bytes)) {
          each_record(bytes, [&](Op inner, std::string_view text) {
            if (inner == Op::kMetadata) learn_metadata(text);
          });
        }
      }
    });
    // without an index, or with counts missing, only the data themselves can tell
    const bool usable = whole && has_statistics && (messages == 0 || (!blocks_.empty() && !counts_.empty()));
    if (!usable) forget();
    return usable;
  }

  void forget() {
    schemas_.clear();
    channels_.clear();
    metadata_.clear();
    counts_.clear();
    blocks_.clear();
    start_ns_ = end_ns_ = 0;
  }

  void learn_chunk(std::string_view content) {
    Cursor cursor(content);
    Block block;
    block.is_chunk = true;
    block.start_ns = cursor.take<std::uint64_t>();
    block.end_ns = cursor.take<std::uint64_t>();
    block.offset = cursor.take<std::uint64_t>() + kRecordHead;
    block.length = cursor.take<std::uint64_t>() - kRecordHead;
    Cursor offsets(cursor.text());
    while (offsets.left() > 0 && offsets.ok()) {
      block.channels.insert(offsets.take<std::uint16_t>());
      offsets.take<std::uint64_t>();
    }
    if (cursor.ok()) blocks_.push_back(std::move(block));
  }

  std::uint64_t learn_statistics(std::string_view content) {
    Cursor cursor(content);
    const auto messages = cursor.take<std::uint64_t>();
    cursor.bytes(2 + 4 + 4 + 4 + 4);
    start_ns_ = cursor.take<std::uint64_t>();
    end_ns_ = cursor.take<std::uint64_t>();
    Cursor counts(cursor.text());
    while (counts.left() > 0 && counts.ok()) {
      const auto id = counts.take<std::uint16_t>();
      counts_[id] = counts.take<std::uint64_t>();
    }
    return messages;
  }

  // Goes through the data section from the front, up to where the file is whole.
  Status scan() {
    std::uint64_t at = kMagic.size();
    bool ended = false;
    std::string bytes;
    while (!ended && size_ - at >= kRecordHead) {
      if (!read(at, kRecordHead, bytes)) break;
      Cursor head(bytes);
      const auto op = static_cast<Op>(head.take<std::uint8_t>());
      const auto length = head.take<std::uint64_t>();
      // zeros are what a file system leaves of a file that was not written to its end
      if (static_cast<std::uint8_t>(op) == 0 || length > size_ - at - kRecordHead) break;
      const std::uint64_t content = at + kRecordHead;
      const std::uint64_t record_length = kRecordHead + length;
      switch (op) {
        case Op::kDataEnd:
        case Op::kFooter:
          ended = true;
          break;
        case Op::kSchema:
          if (read(content, length, bytes)) learn_schema(bytes);
          break;
        case Op::kChannel:
          if (read(content, length, bytes)) learn_channel(bytes);
          break;
        case Op::kMetadata:
          if (read(content, length, bytes)) learn_metadata(bytes);
          break;
        case Op::kMessage:
          if (!blocks_.empty() && !blocks_.back().is_chunk &&
              blocks_.back().offset + blocks_.back().length == at && blocks_.back().length < kLooseBytes) {
            blocks_.back().length += record_length;
          } else {
            blocks_.push_back({at, record_length, false, 0, 0, {}});
          }
          break;
        case Op::kChunk:
          blocks_.push_back({content, length, true, 0, 0, {}});
          break;
        default:
          break;  // indexes, attachments, and what later versions of the format add
      }
      if (!ended) at += record_length;
    }
    if (!ended) {
      note("it ends in the middle, at byte " + std::to_string(at) + " of " + std::to_string(size_) +
           ": was its writer killed?");
    }
    // what the summary would have told
    for (Block& block : blocks_) {
      const auto records = load(block);
      if (!records) continue;
      each_record(*records, [&](Op op, std::string_view record) {
        if (op != Op::kMessage || record.size() < kMessageHead) return;
        Cursor cursor(record);
        const auto channel = cursor.take<std::uint16_t>();
        cursor.take<std::uint32_t>();
        const auto log_time_ns = cursor.take<std::uint64_t>();
        const bool first_in_file = counts_.empty();
        const bool first_in_block = block.channels.empty();
        block.start_ns = first_in_block ? log_time_ns : std::min(block.start_ns, log_time_ns);
        block.end_ns = first_in_block ? log_time_ns : std::max(block.end_ns, log_time_ns);
        start_ns_ = first_in_file ? log_time_ns : std::min(start_ns_, log_time_ns);
        end_ns_ = std::max(end_ns_, log_time_ns);
        block.channels.insert(channel);
        ++counts_[channel];
      });
    }
    std::erase_if(blocks_, [](const Block& block) { return block.channels.empty(); });
    return unsupported_.empty() ? Status() : Status(Error{ErrorCode::kUnsupported, unsupported_});
  }

  // The records of a block; null, and noted, if they are damaged. Learns its schemas and channels.
  std::shared_ptr<const std::string> load(const Block& block) {
    auto records = std::make_shared<std::string>();
    const std::string place =
        "the chunk at byte " + std::to_string(block.offset) + " is damaged and left out";
    if (!block.is_chunk) {
      if (!read(block.offset, block.length, *records)) return nullptr;
    } else {
      if (!read(block.offset, block.length, raw_)) {
        note(place);
        return nullptr;
      }
      Cursor cursor(raw_);
      cursor.bytes(8 + 8);
      const auto size = cursor.take<std::uint64_t>();
      const auto crc = cursor.take<std::uint32_t>();
      const auto compression = cursor.text();
      const auto packed = cursor.bytes(cursor.take<std::uint64_t>());
      if (!cursor.ok() || size > kMostChunkBytes || !unpack(compression, packed, size, *records) ||
          (crc != 0 && crc_of(*records) != crc)) {
        note(place);
        return nullptr;
      }
    }
    const bool whole = each_record(*records, [&](Op op, std::string_view content) {
      if (op == Op::kSchema) learn_schema(content);
      if (op == Op::kChannel) learn_channel(content);
    });
    if (!whole) note(place);
    return records;
  }

  bool unpack(std::string_view compression, std::string_view packed, std::uint64_t size, std::string& bytes) {
    if (compression.empty()) {
      bytes = packed;
      return packed.size() == size;
    }
    if (compression != kZstd) {
      unsupported_ = path_ + " is compressed with '" + std::string(compression) +
                     "'; nido reads zstd and files that are not compressed";
      note(unsupported_);
      return false;
    }
    bytes.resize(size);
    return ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()) == size;
  }

  void load_next() {
    const Block& block = blocks_[next_block_++];
    const bool is_wanted =
        wanted_.empty() || block.channels.empty() ||
        std::any_of(wanted_.begin(), wanted_.end(), [&](auto id) { return block.channels.contains(id); });
    if (block.end_ns < from_ns_ || !is_wanted) return;
    Loaded loaded;
    loaded.bytes = load(block);
    if (!loaded.bytes) return;
    each_record(*loaded.bytes, [&](Op op, std::string_view content) {
      if (op != Op::kMessage || content.size() < kMessageHead) return;
      Cursor cursor(content);
      const auto channel = cursor.take<std::uint16_t>();
      cursor.take<std::uint32_t>();
      const auto log_time_ns = cursor.take<std::uint64_t>();
      if (log_time_ns < from_ns_ || !channels_.contains(channel)) return;
      if (!wanted_.empty() && !wanted_.contains(channel)) return;
      loaded.entries.push_back(
          {log_time_ns, static_cast<std::size_t>(content.data() - loaded.bytes->data()), content.size()});
    });
    std::stable_sort(loaded.entries.begin(), loaded.entries.end(),
                     [](const Entry& a, const Entry& b) { return a.log_time_ns < b.log_time_ns; });
    loaded_.push_back(std::move(loaded));
  }

  const std::string path_;
  const int fd_;
  const std::uint64_t size_;
  std::string damage_;
  std::string unsupported_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Metadata> metadata_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::vector<Block> blocks_;  // by start
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;

  std::uint64_t from_ns_ = 0;
  std::set<std::uint16_t> wanted_;
  std::size_t next_block_ = 0;
  std::vector<Loaded> loaded_;
  std::shared_ptr<const std::string> current_;  // what the last message's data lie in
  std::string raw_;
};

}  // namespace

const std::map<std::string, std::string>* Reader::metadata_named(const std::string& name) const {
  const auto& all = metadata();
  const auto found =
      std::find_if(all.rbegin(), all.rend(), [&](const Metadata& one) { return one.name == name; });
  return found == all.rend() ? nullptr : &found->entries;
}

std::uint64_t Reader::message_count() const {
  std::uint64_t count = 0;
  for (const auto& [id, messages] : message_counts()) count += messages;
  return count;
}

Result<std::unique_ptr<Reader>> Reader::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    const auto code = errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kFailed;
    return Error{code, path + " cannot be read: " + std::system_category().message(errno)};
  }
  struct stat info {};
  if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(fd);
    return Error{ErrorCode::kInvalidArgument, path + " is no file"};
  }
  auto reader = std::make_unique<FileReader>(path, fd, static_cast<std::uint64_t>(info.st_size));
  if (auto status = reader->begin(); !status) return status.error();
  return std::unique_ptr<Reader>(std::move(reader));
}

}  // namespace nido::mcap
