#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/recorder/mcap.h"

namespace nido::mcap {

// Reads an MCAP file of any writer: with its summary, or, when that is not there (the writer was killed) or
// does not fit, by going through the file. Keeps one chunk in memory, or as many as overlap in time. Not
// thread-safe.
class Reader {
 public:
  // kNotFound without such a file, kInvalidArgument for one that is no MCAP.
  static Result<std::unique_ptr<Reader>> open(const std::string& path);
  virtual ~Reader() = default;

  [[nodiscard]] virtual const std::map<std::uint16_t, Schema>& schemas() const = 0;
  [[nodiscard]] virtual const std::map<std::uint16_t, Channel>& channels() const = 0;
  [[nodiscard]] virtual const std::vector<Metadata>& metadata() const = 0;
  // The entries of the last metadata record of this name; nothing if there is none.
  [[nodiscard]] const std::map<std::string, std::string>* metadata_named(const std::string& name) const;
  [[nodiscard]] virtual const std::map<std::uint16_t, std::uint64_t>& message_counts() const = 0;
  [[nodiscard]] std::uint64_t message_count() const;
  // Log times of the first and last message; 0 without any.
  [[nodiscard]] virtual std::uint64_t start_ns() const = 0;
  [[nodiscard]] virtual std::uint64_t end_ns() const = 0;
  // What is wrong with the file, in a sentence: it ends in mid-record, a chunk is damaged. Empty if nothing.
  // Grows when next() meets a damaged chunk, which it leaves out.
  [[nodiscard]] virtual const std::string& damage() const = 0;

  // Starts again from the first message at or after start_ns; only these channels, all if empty.
  virtual void rewind(std::uint64_t start_ns = 0, std::set<std::uint16_t> channels = {}) = 0;
  // The next message in the order of log times, in file order where these are equal; nothing at the end. Its
  // data are there until the next call.
  virtual std::optional<Message> next() = 0;
};

}  // namespace nido::mcap
