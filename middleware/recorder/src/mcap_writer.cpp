#include "nido/recorder/mcap_writer.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <vector>

#include "mcap_bytes.h"

namespace nido::mcap {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

struct ChunkIndex {
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};
struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

struct ContextDeleter {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};

class FileWriter final : public Writer {
 public:
  FileWriter(std::string path, int fd, const WriterOptions& options)
      : path_(std::move(path)), fd_(fd), options_(options), compressor_(ZSTD_createCCtx()) {}
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  ~FileWriter() override {
    (void)close();
    ::close(fd_);
  }

  Status begin() {
    std::string content;
    put_text(content, "");  // no profile
    put_text(content, options_.library);
    std::string bytes(kMagic);
    put_record(bytes, Op::kHeader, content);
    return append(bytes);
  }

  Result<std::uint16_t> add_schema(const Schema& schema) override {
    if (schemas_.size() >= 65535) return too_many("schemas");
    std::string content;
    const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
    put(content, id);
    put_text(content, schema.name);
    put_text(content, schema.encoding);
    put_text(content, schema.data);
    schemas_.push_back({std::move(content), 0, false});
    return id;
  }

  Result<std::uint16_t> add_channel(const Channel& channel) override {
    if (channels_.size() >= 65535) return too_many("channels");
    if (channel.schema_id > schemas_.size()) {
      return Error{ErrorCode::kInvalidArgument,
                   "channel " + channel.topic + " names a schema that is not there"};
    }
    std::string content;
    const auto id = static_cast<std::uint16_t>(channels_.size());
    put(content, id);
    put(content, channel.schema_id);
    put_text(content, channel.topic);
    put_text(content, channel.message_encoding);
    put_map(content, channel.metadata);
    channels_.push_back({std::move(content), channel.schema_id, false});
    counts_.push_back(0);
    return id;
  }

  Status write(const Message& message) override {
    if (auto status = usable(); !status) return status;
    if (message.channel_id >= channels_.size()) {
      return Error{ErrorCode::kInvalidArgument,
                   path_ + " has no channel " + std::to_string(message.channel_id)};
    }
    // whoever reads only this chunk and those before it knows the channel
    introduce(message.channel_id, chunk_);
    const std::uint64_t offset = chunk_.size();
    put(chunk_, static_cast<std::uint8_t>(Op::kMessage));
    put(chunk_, static_cast<std::uint64_t>(kMessageHead + message.data.size()));
    put(chunk_, message.channel_id);
    put(chunk_, message.sequence);
    put(chunk_, message.log_time_ns);
    put(chunk_, message.publish_time_ns);
    chunk_.append(message.data);
    if (!chunk_begun_) {
      chunk_begun_ = SteadyClock::now();
      chunk_start_ns_ = chunk_end_ns_ = message.log_time_ns;
    }
    chunk_start_ns_ = std::min(chunk_start_ns_, message.log_time_ns);
    chunk_end_ns_ = std::max(chunk_end_ns_, message.log_time_ns);
    std::string& index = chunk_indexes_[message.channel_id];
    put(index, message.log_time_ns);
    put(index, offset);
    ++counts_[message.channel_id];
    return chunk_.size() >= options_.chunk_bytes ? flush() : Status();
  }

  Status write(const Metadata& metadata) override {
    if (auto status = usable(); !status) return status;
    std::string content;
    put_text(content, metadata.name);
    put_map(content, metadata.entries);
    std::string record;
    put_record(record, Op::kMetadata, content);
    metadata_.push_back({file_bytes_, record.size(), metadata.name});
    return append(record);
  }

  Status flush() override {
    if (auto status = usable(); !status) return status;
    if (!chunk_begun_) return {};
    const std::string_view records = compressed_chunk();
    ChunkIndex chunk;
    chunk.start_ns = chunk_start_ns_;
    chunk.end_ns = chunk_end_ns_;
    chunk.offset = file_bytes_;
    chunk.uncompressed_size = chunk_.size();
    chunk.compressed_size = records.size();
    std::string head;
    put(head, chunk.start_ns);
    put(head, chunk.end_ns);
    put(head, chunk.uncompressed_size);
    put(head, crc_of(chunk_));
    put_text(head, compression());
    put(head, chunk.compressed_size);
    std::string record;
    put(record, static_cast<std::uint8_t>(Op::kChunk));
    put(record, static_cast<std::uint64_t>(head.size() + records.size()));
    record += head;
    record += records;
    chunk.length = record.size();
    for (const auto& [channel, entries] : chunk_indexes_) {
      chunk.message_index_offsets[channel] = chunk.offset + record.size();
      std::string content;
      put(content, channel);
      put_text(content, entries);
      put_record(record, Op::kMessageIndex, content);
    }
    chunk.message_index_length = record.size() - chunk.length;
    // one write: a process that is killed leaves whole chunks
    if (auto status = append(record); !status) return status;
    start_ns_ = chunks_.empty() ? chunk.start_ns : std::min(start_ns_, chunk.start_ns);
    end_ns_ = std::max(end_ns_, chunk.end_ns);
    chunks_.push_back(std::move(chunk));
    chunk_.clear();
    chunk_indexes_.clear();
    chunk_begun_.reset();
    return {};
  }

  [[nodiscard]] std::optional<std::chrono::nanoseconds> chunk_age() const override {
    if (!chunk_begun_) return std::nullopt;
    return SteadyClock::now() - *chunk_begun_;
  }

  Status close() override {
    if (closed_) return {};
    if (auto status = flush(); !status) {
      closed_ = true;
      return status;
    }
    // channels on which nothing came
    std::string rest;
    for (std::size_t id = 0; id < channels_.size(); ++id) introduce(static_cast<std::uint16_t>(id), rest);
    std::string content;
    put(content, crc_of(rest, data_crc_));
    put_record(rest, Op::kDataEnd, content);
    Status status = append(rest);
    if (status) status = append(summary());
    closed_ = true;
    return status;
  }

  [[nodiscard]] std::uint64_t file_bytes() const override { return file_bytes_; }

 private:
  struct Introduced {
    std::string content;
    std::uint16_t schema_id = 0;
    bool done = false;
  };

  [[nodiscard]] Error too_many(const std::string& what) const {
    return {ErrorCode::kFailed,
            path_ + " has no room for more " + what + ": 65535 are the limit of the format"};
  }
  [[nodiscard]] Status usable() const {
    if (failure_) return *failure_;
    if (closed_) return Error{ErrorCode::kFailed, path_ + " is closed already"};
    return {};
  }
  [[nodiscard]] std::string_view compression() const {
    return options_.compression == Compression::kZstd ? kZstd : "";
  }

  void introduce(std::uint16_t channel_id, std::string& bytes) {
    Introduced& channel = channels_[channel_id];
    if (channel.done) return;
    channel.done = true;
    if (channel.schema_id > 0) {
      Introduced& schema = schemas_[channel.schema_id - 1U];
      if (!schema.done) put_record(bytes, Op::kSchema, schema.content);
      schema.done = true;
    }
    put_record(bytes, Op::kChannel, channel.content);
  }

  std::string_view compressed_chunk() {
    if (options_.compression == Compression::kNone) return chunk_;
    compressed_.resize(ZSTD_compressBound(chunk_.size()));
    const std::size_t size = ZSTD_compressCCtx(compressor_.get(), compressed_.data(), compressed_.size(),
                                               chunk_.data(), chunk_.size(), options_.compression_level);
    return std::string_view(compressed_).substr(0, size);
  }

  Status append(std::string_view bytes) {
    std::string_view left = bytes;
    while (!left.empty()) {
      const ssize_t written = ::write(fd_, left.data(), left.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        failure_ = Error{ErrorCode::kFailed,
                         path_ + " cannot be written any more: " + std::system_category().message(errno)};
        return *failure_;
      }
      left.remove_prefix(static_cast<std::size_t>(written));
    }
    data_crc_ = crc_of(bytes, data_crc_);
    file_bytes_ += bytes.size();
    return {};
  }

  // Everything after the data: copies of the schemas and channels, the indexes, and where each group of them
  // is.
  std::string summary() {
    std::string bytes;
    std::string offsets;
    const std::uint64_t start = file_bytes_;
    const auto group = [&](Op op, const std::vector<std::string>& contents) {
      if (contents.empty()) return;
      const std::uint64_t begin = start + bytes.size();
      for (const auto& content : contents) put_record(bytes, op, content);
      std::string offset;
      put(offset, static_cast<std::uint8_t>(op));
      put(offset, begin);
      put(offset, start + bytes.size() - begin);
      put_record(offsets, Op::kSummaryOffset, offset);
    };
    const auto contents_of = [](const std::vector<Introduced>& from) {
      std::vector<std::string> contents;
      for (const auto& one : from) {
        if (one.done) contents.push_back(one.content);
      }
      return contents;
    };
    const auto schemas = contents_of(schemas_);
    group(Op::kSchema, schemas);
    group(Op::kChannel, contents_of(channels_));
    group(Op::kStatistics, {statistics(schemas.size())});
    std::vector<std::string> chunks;
    for (const auto& chunk : chunks_) chunks.push_back(content_of(chunk));
    group(Op::kChunkIndex, chunks);
    std::vector<std::string> metadata;
    for (const auto& index : metadata_) {
      std::string content;
      put(content, index.offset);
      put(content, index.length);
      put_text(content, index.name);
      metadata.push_back(content);
    }
    group(Op::kMetadataIndex, metadata);
    const std::uint64_t offset_start = start + bytes.size();
    bytes += offsets;
    put(bytes, static_cast<std::uint8_t>(Op::kFooter));
    put(bytes, static_cast<std::uint64_t>(kFooterSize - kRecordHead));
    put(bytes, start);
    put(bytes, offset_start);
    put(bytes, crc_of(bytes));
    return bytes.append(kMagic);
  }

  [[nodiscard]] std::string statistics(std::size_t schema_count) const {
    std::uint64_t messages = 0;
    std::string counts;
    for (std::size_t id = 0; id < counts_.size(); ++id) {
      messages += counts_[id];
      put(counts, static_cast<std::uint16_t>(id));
      put(counts, counts_[id]);
    }
    std::string content;
    put(content, messages);
    put(content, static_cast<std::uint16_t>(schema_count));
    put(content, static_cast<std::uint32_t>(channels_.size()));
    put(content, std::uint32_t{0});  // attachments
    put(content, static_cast<std::uint32_t>(metadata_.size()));
    put(content, static_cast<std::uint32_t>(chunks_.size()));
    put(content, start_ns_);
    put(content, end_ns_);
    put_text(content, counts);
    return content;
  }

  [[nodiscard]] std::string content_of(const ChunkIndex& chunk) const {
    std::string offsets;
    for (const auto& [channel, offset] : chunk.message_index_offsets) {
      put(offsets, channel);
      put(offsets, offset);
    }
    std::string content;
    put(content, chunk.start_ns);
    put(content, chunk.end_ns);
    put(content, chunk.offset);
    put(content, chunk.length);
    put_text(content, offsets);
    put(content, chunk.message_index_length);
    put_text(content, compression());
    put(content, chunk.compressed_size);
    put(content, chunk.uncompressed_size);
    return content;
  }

  const std::string path_;
  const int fd_;
  const WriterOptions options_;
  const std::unique_ptr<ZSTD_CCtx, ContextDeleter> compressor_;
  std::optional<Error> failure_;
  bool closed_ = false;
  std::uint64_t file_bytes_ = 0;
  std::uint32_t data_crc_ = 0;

  std::vector<Introduced> schemas_;   // id - 1
  std::vector<Introduced> channels_;  // id
  std::vector<std::uint64_t> counts_;
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;

  std::string chunk_;
  std::string compressed_;
  std::map<std::uint16_t, std::string> chunk_indexes_;
  std::optional<SteadyClock::time_point> chunk_begun_;
  std::uint64_t chunk_start_ns_ = 0;
  std::uint64_t chunk_end_ns_ = 0;
};

}  // namespace

Result<std::unique_ptr<Writer>> Writer::create(const std::string& path, const WriterOptions& options) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    const auto code = errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kFailed;
    return Error{code, path + " cannot be made: " + std::system_category().message(errno)};
  }
  auto writer = std::make_unique<FileWriter>(path, fd, options);
  if (auto status = writer->begin(); !status) return status.error();
  return std::unique_ptr<Writer>(std::move(writer));
}

}  // namespace nido::mcap
