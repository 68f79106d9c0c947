#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/recorder/mcap.h"

namespace nido::mcap {

struct WriterOptions {
  Compression compression = Compression::kZstd;
  int compression_level = 1;                        // of zstd: 1 is quick
  std::size_t chunk_bytes = std::size_t{4} << 20U;  // a chunk ends when it has got this long, uncompressed
  std::string library = "nido";
};

// Writes an MCAP file: chunks with their indexes, then the summary. What flush() has returned from survives
// the death of the process, and a reader finds it without a summary. Not thread-safe.
class Writer {
 public:
  // kNotFound if the folder is not there, kFailed if the file cannot be made. An old file is emptied.
  static Result<std::unique_ptr<Writer>> create(const std::string& path, const WriterOptions& options = {});
  // Closes; a failure of that is lost here.
  virtual ~Writer() = default;

  // Ids are given by the writer; the ids of the arguments do not matter. kFailed beyond 65535.
  virtual Result<std::uint16_t> add_schema(const Schema& schema) = 0;
  virtual Result<std::uint16_t> add_channel(const Channel& channel) = 0;
  // Copies the data into the chunk, which is written when it is full. The channel must be of this file.
  // After a failure (a full disk) every later call fails in the same words; close() keeps what was written.
  virtual Status write(const Message& message) = 0;
  virtual Status write(const Metadata& metadata) = 0;
  // Ends the chunk and hands it to the operating system.
  virtual Status flush() = 0;
  // Time since the first message of the chunk that is not written yet; nothing without such a message.
  [[nodiscard]] virtual std::optional<std::chrono::nanoseconds> chunk_age() const = 0;
  // Flushes and writes the summary; nothing can be written after that. Twice is no error.
  virtual Status close() = 0;

  [[nodiscard]] virtual std::uint64_t file_bytes() const = 0;
};

}  // namespace nido::mcap
