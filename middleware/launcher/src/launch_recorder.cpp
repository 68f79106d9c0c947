#include "launch_recorder.h"

#include <fmt/format.h>

#include <filesystem>

#include "launch_run.h"

namespace nido {
namespace fs = std::filesystem;

Status add_recorder(App& app, const std::string& wanted) {
  const fs::path file = fs::absolute(wanted);
  std::error_code error;
  if (!fs::is_directory(file.parent_path(), error)) {
    return Error{ErrorCode::kNotFound,
                 fmt::format("--record {}: there is no folder {}", wanted, shown_path(file.parent_path()))};
  }
  AppProcess recorder;
  recorder.name = kRecorder;
  recorder.program = "nido-recorder";
  recorder.clock = app.lockstep ? "lockstep" : "wall";
  recorder.parameters["file"] = file.string();
  recorder.parameters["nodes"] = YAML::Node(YAML::NodeType::Sequence);
  bool has_clock = false;
  for (auto& process : app.processes) {
    if (process.name == kRecorder) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("app '{}' has a process '{}' of its own: give that another name to use --record",
                      app.name, kRecorder)};
    }
    has_clock = has_clock || process.clock == "owner";
    if (process.clock == "owner" || process.clock == "lockstep") {
      recorder.parameters["nodes"].push_back(process.name);
    }
    process.depends_on.emplace_back(kRecorder);
  }
  recorder.parameters["simulated"] = has_clock;
  app.start_order.insert(app.start_order.begin(), app.processes.size());
  app.processes.push_back(std::move(recorder));
  return {};
}

}  // namespace nido
