#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "contents.h"
#include "mcap_core.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/mcap_reader.h"
#include "nido/recorder/mcap_writer.h"
#include "temp_folder.h"

namespace nido::mcap {
namespace {

using test::Contents;
using test::contents_of;
using test::TempFolder;

std::string bytes_of(const std::string& file) { return test::read_text(file); }

// What a second implementation makes of the file: JSON, or a complaint.
nlohmann::json checked(const std::string& file) {
  const std::string command = std::string(PYTHON3) + " " + CHECK_MCAP + " " + file + " 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  EXPECT_EQ(pclose(pipe), 0) << text;
  return nlohmann::json::parse(text, nullptr, false);
}

// A file of three channels on two types, of many chunks; what was written, by topic.
Contents write_some(const std::string& file, const WriterOptions& options, int messages = 300) {
  auto writer = Writer::create(file, options);
  EXPECT_TRUE(writer.ok()) << writer.error().message;
  EXPECT_TRUE((*writer)->write(Metadata{"first", {{"key", "value"}, {"empty", ""}}}).ok());
  const auto one = (*writer)->add_schema({0, "a::B", "omgidl", "module a { struct B { long x; }; };"});
  const auto two = (*writer)->add_schema({0, "a::C", "omgidl", "module a { struct C { string x; }; };"});
  const std::array<std::uint16_t, 3> channels = {
      *(*writer)->add_channel({0, *one, "/a/b:o", "cdr", {{"profile", "state"}}}),
      *(*writer)->add_channel({0, *two, "/a/c:o", "cdr", {}}),
      *(*writer)->add_channel({0, 0, "/never", "cdr", {{"type", "x/msg/Y"}}})};
  std::mt19937 random(7);
  Contents written{{"/a/b:o", {}}, {"/a/c:o", {}}, {"/never", {}}};
  for (int i = 0; i < messages; ++i) {
    const std::size_t which = random() % 2;
    std::string data(random() % 400, '\0');
    for (char& byte : data) byte = static_cast<char>(random() % 7);
    Message message{channels[which], static_cast<std::uint32_t>(i + 1),
                    1000U + 10U * static_cast<unsigned>(i), 900U + 10U * static_cast<unsigned>(i), data};
    EXPECT_TRUE((*writer)->write(message).ok());
    written[which == 0 ? "/a/b:o" : "/a/c:o"].push_back(
        {message.sequence, message.log_time_ns, message.publish_time_ns, data});
  }
  EXPECT_TRUE((*writer)->write(Metadata{"last", {{"total", "0"}}}).ok());
  EXPECT_TRUE((*writer)->close().ok());
  EXPECT_TRUE((*writer)->close().ok());
  EXPECT_FALSE((*writer)->write(Metadata{"late", {}}).ok());
  return written;
}

WriterOptions small_chunks(Compression compression = Compression::kZstd) {
  WriterOptions options;
  options.compression = compression;
  options.chunk_bytes = 2000;
  return options;
}

TEST(Mcap, WhatIsWrittenIsRead) {
  const TempFolder folder;
  for (const auto compression : {Compression::kNone, Compression::kZstd}) {
    const std::string file = (folder.path() / "a.mcap").string();
    const auto written = write_some(file, small_chunks(compression));
    auto reader = Reader::open(file);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ((*reader)->damage(), "");
    EXPECT_EQ((*reader)->message_count(), 300U);
    EXPECT_EQ((*reader)->start_ns(), 1000U);
    EXPECT_EQ((*reader)->end_ns(), 1000U + 2990U);
    EXPECT_EQ(contents_of(**reader), written);
    ASSERT_NE((*reader)->metadata_named("first"), nullptr);
    EXPECT_EQ((*reader)->metadata_named("first")->at("key"), "value");
    EXPECT_EQ((*reader)->metadata_named("last")->at("total"), "0");
    EXPECT_EQ((*reader)->metadata_named("no such"), nullptr);
    EXPECT_EQ((*reader)->schemas().at(1).name, "a::B");
    EXPECT_EQ((*reader)->channels().at(0).metadata.at("profile"), "state");
  }
}

TEST(Mcap, AnotherImplementationFindsNothingWrong) {
  const TempFolder folder;
  for (const auto compression : {Compression::kNone, Compression::kZstd}) {
    const std::string file = (folder.path() / "a.mcap").string();
    const auto written = write_some(file, small_chunks(compression));
    const auto report = checked(file);
    ASSERT_TRUE(report.is_object());
    for (const auto& [topic, messages] : written)
      EXPECT_EQ(report["messages"][topic], messages.size()) << topic;
    EXPECT_EQ(report["metadata"]["first"]["key"], "value");
    EXPECT_EQ(report["schemas"]["a::B"], "omgidl");
  }
  const std::string file = (folder.path() / "empty.mcap").string();
  write_some(file, {}, 0);
  EXPECT_TRUE(checked(file).is_object());
}

TEST(Mcap, OnlyWhatIsAskedForIsRead) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  const auto written = write_some(file, small_chunks());
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader.ok());
  (*reader)->rewind(2000, {1});
  std::size_t count = 0;
  while (const auto message = (*reader)->next()) {
    EXPECT_EQ(message->channel_id, 1);
    EXPECT_GE(message->log_time_ns, 2000U);
    ++count;
  }
  const auto& all = written.at("/a/c:o");
  EXPECT_EQ(count,
            std::count_if(all.begin(), all.end(), [](const auto& one) { return one.log_time_ns >= 2000; }));
  EXPECT_GT(count, 0U);
}

TEST(Mcap, MessagesComeInTheOrderOfTheirTimes) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  {
    WriterOptions options = small_chunks();
    options.chunk_bytes = 300;
    auto writer = Writer::create(file, options);
    ASSERT_TRUE(writer.ok());
    const auto channel = (*writer)->add_channel({0, 0, "/a", "cdr", {}});
    std::mt19937 random(3);
    for (std::uint32_t i = 0; i < 200; ++i) {
      // chunks overlap in time, and times repeat
      const std::uint64_t time_ns = i + random() % 40;
      ASSERT_TRUE((*writer)->write(Message{*channel, i, time_ns, time_ns, "0123456789"}).ok());
    }
    ASSERT_TRUE((*writer)->close().ok());
  }
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader.ok());
  const auto messages = contents_of(**reader).at("/a");
  ASSERT_EQ(messages.size(), 200U);
  for (std::size_t i = 1; i < messages.size(); ++i) {
    const auto& before = messages[i - 1];
    EXPECT_TRUE(before.log_time_ns < messages[i].log_time_ns ||
                (before.log_time_ns == messages[i].log_time_ns && before.sequence < messages[i].sequence))
        << i;
  }
}

// The offsets of a file's records outside of chunks.
std::vector<std::size_t> record_offsets(const std::string& bytes) {
  std::vector<std::size_t> offsets;
  for (std::size_t at = 8; at + 9 <= bytes.size() - 8;) {
    offsets.push_back(at);
    std::uint64_t length = 0;
    for (std::size_t i = 0; i < 8; ++i)
      length |= std::uint64_t{static_cast<unsigned char>(bytes[at + 1 + i])} << 8 * i;
    at += 9 + length;
  }
  return offsets;
}

TEST(Mcap, AFileCutAnywhereGivesItsWholeChunks) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  const auto written = write_some(file, small_chunks(), 60);
  const std::string bytes = bytes_of(file);
  // where each chunk ends, and how many messages there are up to there
  std::vector<std::pair<std::size_t, std::size_t>> chunk_ends;
  const auto offsets = record_offsets(bytes);
  {
    std::size_t messages = 0;
    auto reader = Reader::open(file);
    ASSERT_TRUE(reader.ok());
    for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
      if (bytes[offsets[i]] != 0x06) continue;
      const std::string part = (folder.path() / "part.mcap").string();
      std::ofstream(part, std::ios::binary) << bytes.substr(0, offsets[i + 1]);
      auto prefix = Reader::open(part);
      ASSERT_TRUE(prefix.ok());
      EXPECT_GT((*prefix)->message_count(), messages);
      messages = (*prefix)->message_count();
      chunk_ends.emplace_back(offsets[i + 1], messages);
    }
    EXPECT_EQ(messages, 60U);
  }
  ASSERT_GT(chunk_ends.size(), 3U);
  const std::string cut = (folder.path() / "cut.mcap").string();
  std::ofstream(cut, std::ios::binary) << bytes;
  for (std::size_t length = bytes.size() - 1; length >= 8; --length) {
    ASSERT_EQ(truncate(cut.c_str(), static_cast<off_t>(length)), 0);
    auto reader = Reader::open(cut);
    ASSERT_TRUE(reader.ok()) << length;
    std::size_t expected = 0;
    for (const auto& [end, messages] : chunk_ends) {
      if (end <= length) expected = messages;
    }
    ASSERT_EQ((*reader)->message_count(), expected) << "cut at " << length;
    std::size_t got = 0;
    for (const auto& [topic, messages] : contents_of(**reader)) {
      const auto& all = written.at(topic);
      ASSERT_LE(messages.size(), all.size());
      for (std::size_t i = 0; i < messages.size(); ++i) ASSERT_EQ(messages[i], all[i]);
      got += messages.size();
    }
    ASSERT_EQ(got, expected);
    // all is said in the summary or by going through; only a file without its end is called damaged
    const bool ends_before_data_end = length < offsets[offsets.size() - 1];
    if (ends_before_data_end && (*reader)->damage().empty()) {
      // cut within the summary: the data section is whole
      EXPECT_EQ(expected, 60U) << length;
    }
  }
  ASSERT_EQ(truncate(cut.c_str(), 7), 0);
  EXPECT_FALSE(Reader::open(cut).ok());
}

TEST(Mcap, RecordsThatAreNotKnownAreSkipped) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  const auto written = write_some(file, small_chunks());
  const std::string bytes = bytes_of(file);
  const std::string strange =
      std::string("\xAB\x05\0\0\0\0\0\0\0hello", 14) + std::string("\x55\0\0\0\0\0\0\0\0", 9);
  // between all records of the data section; the summary's offsets are wrong then, so it is cut off
  std::string mixed = bytes.substr(0, 8);
  const auto offsets = record_offsets(bytes);
  for (std::size_t i = 0; i + 1 < offsets.size() && bytes[offsets[i]] != 0x0F; ++i) {
    mixed += bytes.substr(offsets[i], offsets[i + 1] - offsets[i]) + strange;
  }
  const std::string other = (folder.path() / "b.mcap").string();
  std::ofstream(other, std::ios::binary) << mixed;
  EXPECT_EQ(contents_of(other), written);
}

TEST(Mcap, FilesWithoutChunksAreRead) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  const auto record = [](char op, const std::string& content) {
    std::string bytes(1, op);
    for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<char>(content.size() >> (8 * i)));
    return bytes + content;
  };
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string bytes = magic + record(1, std::string(8, '\0'));
  bytes += record(4, std::string("\x03\0\0\0\2\0\0\0/a\3\0\0\0cdr\0\0\0\0", 21));
  for (char i = 0; i < 5; ++i) {
    std::string message("\x03\0", 2);
    message += std::string(1, i) + std::string(3, '\0');
    message += std::string(1, static_cast<char>(5 - i)) + std::string(15, '\0') + "data";
    bytes += record(5, message);
  }
  bytes += record(15, std::string(4, '\0')) + record(2, std::string(20, '\0')) + magic;
  std::ofstream(file, std::ios::binary) << bytes;
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ((*reader)->damage(), "");
  const auto messages = contents_of(**reader)["/a"];
  ASSERT_EQ(messages.size(), 5U);
  EXPECT_EQ(messages.front().sequence, 4U);  // the earliest
  EXPECT_EQ(messages.front().data, "data");
}

TEST(Mcap, DamageIsNamedAndTheRestIsRead) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  const auto written = write_some(file, small_chunks());
  const std::string good = bytes_of(file);
  const auto offsets = record_offsets(good);
  std::vector<std::size_t> chunks;
  for (const auto offset : offsets) {
    if (good[offset] == 0x06) chunks.push_back(offset);
  }
  // a byte in the middle of a chunk in the middle
  std::string bytes = good;
  bytes[chunks[chunks.size() / 2] + 300] ^= 0x40;
  std::ofstream(file, std::ios::binary) << bytes;
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader.ok());
  std::size_t count = 0;
  for (const auto& [topic, messages] : contents_of(**reader)) count += messages.size();
  EXPECT_LT(count, 300U);
  EXPECT_GT(count, 200U);
  EXPECT_NE((*reader)->damage().find("is damaged"), std::string::npos) << (*reader)->damage();
  // a byte in the summary: the data are gone through instead
  bytes = good;
  bytes[bytes.size() - 100] ^= 0x01;
  std::ofstream(file, std::ios::binary) << bytes;
  auto again = Reader::open(file);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(contents_of(**again), written);
  EXPECT_NE((*again)->damage().find("summary"), std::string::npos);
}

TEST(Mcap, AnyBytesAreReadOrRefusedButNeverBelieved) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  write_some(file, small_chunks(Compression::kNone), 40);
  const std::string good = bytes_of(file);
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    std::string bytes = good;
    for (int i = 0; i < 1 + trial % 8; ++i)
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<char>(random());
    std::ofstream(file, std::ios::binary) << bytes;
    auto reader = Reader::open(file);
    if (!reader) continue;
    std::size_t count = 0;
    while (const auto message = (*reader)->next()) {
      ASSERT_TRUE((*reader)->channels().contains(message->channel_id));
      ASSERT_LT(++count, 10000U);
    }
  }
}

TEST(Mcap, TroubleIsSaidInASentence) {
  const TempFolder folder;
  auto missing = Reader::open((folder.path() / "no.mcap").string());
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  auto text = Reader::open(folder.write("text.mcap", "this is a letter"));
  ASSERT_FALSE(text.ok());
  EXPECT_EQ(text.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(text.error().message.find("no MCAP file"), std::string::npos);
  EXPECT_FALSE(Reader::open(folder.path().string()).ok());
  EXPECT_EQ(Writer::create((folder.path() / "no" / "a.mcap").string()).error().code, ErrorCode::kNotFound);
  // a disk that is full
  auto full = Writer::create("/dev/full");
  ASSERT_FALSE(full.ok());
  EXPECT_NE(full.error().message.find("No space"), std::string::npos) << full.error().message;
}

TEST(Mcap, EveryTypesTextIsUnderstoodByOthers) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  auto writer = Writer::create(file);
  ASSERT_TRUE(writer.ok());
  const auto types = idl_types();
  EXPECT_GT(types.size(), 20U);
  for (const auto type : types) {
    const auto schema =
        (*writer)->add_schema({0, scoped_name_of(type), "omgidl", std::string(idl_text_of(type))});
    ASSERT_TRUE(schema.ok());
    ASSERT_TRUE((*writer)->add_channel({0, *schema, "/" + std::string(type), "cdr", {}}).ok());
  }
  ASSERT_TRUE((*writer)->close().ok());
  const auto view = test::view_with_mcap_core(file);
  if (!view.absent.empty()) GTEST_SKIP() << view.absent;
  EXPECT_EQ(view.complaint, "");
  EXPECT_EQ(view.contents["schemas"], types.size());
}

TEST(Mcap, EveryTypeHasItsText) {
  const std::string image(idl_text_of("sensor_msgs/msg/Image"));
  EXPECT_NE(image.find("struct Image"), std::string::npos);
  EXPECT_NE(image.find("struct Header"), std::string::npos);
  EXPECT_LT(image.find("struct Time"), image.find("struct Header"));
  EXPECT_LT(image.find("struct Header"), image.find("struct Image"));
  EXPECT_EQ(image.find("dds_"), std::string::npos);
  EXPECT_NE(std::string(idl_text_of("nido_msgs/msg/Percepts")).find("struct Percept {"), std::string::npos);
  EXPECT_TRUE(idl_text_of("other/msg/Type").empty());
  EXPECT_EQ(scoped_name_of("sensor_msgs/msg/Image"), "sensor_msgs::msg::Image");
  EXPECT_EQ(ros_name_of("sensor_msgs::msg::Image"), "sensor_msgs/msg/Image");
}

}  // namespace
}  // namespace nido::mcap
