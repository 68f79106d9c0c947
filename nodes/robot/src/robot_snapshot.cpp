#include "src/robot_snapshot.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace nido {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "nido robot snapshot 1";

json to_json(const LimitedControlBoard::Memory& memory) {
  json streams = json::array();
  for (const LimitedControlBoard::Stream& stream : memory.streams) {
    streams.push_back({{"mode", std::string(to_string(stream.mode))},
                       {"wanted", stream.wanted},
                       {"sent", stream.sent},
                       {"renewed_ns", stream.renewed_ns}});
  }
  json targets = json::array();
  for (const std::optional<double>& target_rad : memory.target_rad)
    targets.push_back(target_rad ? json(*target_rad) : json());
  return {{"streams", streams},
          {"target_rad", targets},
          {"is_driven", memory.is_driven},
          {"stepped_ns", memory.stepped_ns}};
}

// Throws json::exception.
Result<LimitedControlBoard::Memory> memory_of(const json& from) {
  LimitedControlBoard::Memory memory;
  for (const json& stream : from.at("streams")) {
    const auto mode = control_mode_from_string(stream.at("mode").get<std::string>());
    if (!mode) return Error{ErrorCode::kInvalidArgument, "a joint has a mode that is none"};
    memory.streams.push_back({*mode, stream.at("wanted").get<double>(), stream.at("sent").get<double>(),
                              stream.at("renewed_ns").get<std::int64_t>()});
  }
  for (const json& target : from.at("target_rad"))
    memory.target_rad.push_back(target.is_null() ? std::nullopt : std::optional(target.get<double>()));
  from.at("is_driven").get_to(memory.is_driven);
  from.at("stepped_ns").get_to(memory.stepped_ns);
  return memory;
}

}  // namespace

Status write_robot_snapshot(const RobotSnapshot& snapshot, const std::filesystem::path& path) {
  json boards = json::object();
  for (const auto& [name, memory] : snapshot.boards) boards[name] = to_json(memory);
  const json file = {{"format", kFormat},
                     {"time_ns", snapshot.time_ns},
                     {"boards", boards},
                     {"simulation", json::parse(snapshot.simulation)}};
  std::filesystem::path half_written = path;
  half_written += ".part";
  std::ofstream out(half_written, std::ios::binary | std::ios::trunc);
  out << file.dump() << "\n";
  out.close();
  std::error_code trouble;
  if (out) std::filesystem::rename(half_written, path, trouble);
  if (!out || trouble)
    return Error{ErrorCode::kFailed, "cannot write the snapshot " + path.string() + ": is there its folder?"};
  return {};
}

Result<RobotSnapshot> read_robot_snapshot(const std::filesystem::path& path) {
  const auto refuse = [&path](const std::string& why) {
    return Error{ErrorCode::kInvalidArgument, path.string() + ": " + why};
  };
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kNotFound, "there is no snapshot " + path.string()};
  std::ostringstream text;
  text << file.rdbuf();
  RobotSnapshot snapshot;
  try {
    const json read = json::parse(text.str());
    if (!read.is_object() || read.value("format", "") != kFormat)
      return refuse(std::string("is no snapshot of a robot: its format is not \"") + kFormat + "\"");
    read.at("time_ns").get_to(snapshot.time_ns);
    if (snapshot.time_ns <= 0) return refuse("its time is not after the start");
    snapshot.simulation = read.at("simulation").dump();
    for (const auto& [name, board] : read.at("boards").items()) {
      Result<LimitedControlBoard::Memory> memory = memory_of(board);
      if (!memory) return refuse(memory.error().message);
      snapshot.boards.emplace(name, std::move(*memory));
    }
  } catch (const json::exception& e) {
    return refuse(e.what());
  }
  return snapshot;
}

}  // namespace nido
