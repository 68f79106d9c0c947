#include "nido/launcher/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <ctime>
#include <fstream>

namespace nido {
namespace fs = std::filesystem;
namespace {

Error cannot_write(const fs::path& path, const std::error_code& error) {
  return {ErrorCode::kFailed, fmt::format("{} cannot be written: {}", path.string(), error.message())};
}

Status write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file)
    return Error{ErrorCode::kFailed, fmt::format("{} cannot be written: is the disk full?", path.string())};
  return {};
}

// A link that always points somewhere: made beside, then moved over the old one.
Status point_latest_to(const fs::path& out, const fs::path& target) {
  std::error_code error;
  const fs::path latest = out / "latest";
  if (fs::exists(fs::symlink_status(latest, error)) && !fs::is_symlink(latest, error)) {
    return Error{ErrorCode::kFailed,
                 fmt::format("{} is no link: move it away, it names the last run", latest.string())};
  }
  const fs::path fresh = out / fmt::format(".latest-{}", getpid());
  fs::remove(fresh, error);
  fs::create_directory_symlink(target, fresh, error);
  if (error) return cannot_write(fresh, error);
  fs::rename(fresh, latest, error);
  if (error) return cannot_write(latest, error);
  return {};
}

// The owner of the clock drives it with Node::publish_clock, which in lockstep waits for the others.
std::string clock_of(const App& app, const AppProcess& process) {
  if (process.clock == "lockstep") return app.lockstep ? "lockstep" : "simulated";
  if (process.clock == "owner") return app.lockstep ? "lockstep" : "wall";
  return process.clock;
}

// Connections that end at ports of the process: "/vision/left:i" belongs to vision, "/icubSim/..." to the
// clock's owner or to whoever has no port folder of its own name.
std::vector<std::pair<std::string, std::string>> connections_of(const App& app, const AppProcess& process) {
  const auto folder_of = [](const std::string& port) { return port.substr(1, port.find('/', 1) - 1); };
  std::vector<std::pair<std::string, std::string>> mine;
  for (const auto& connection : app.connections) {
    const std::string folder = folder_of(connection.second);
    bool named = false;
    for (const auto& other : app.processes) named = named || other.name == folder;
    if (folder == process.name || (!named && process.clock == "owner")) mine.push_back(connection);
  }
  return mine;
}

}  // namespace

Result<RunFolder> make_run_folder(const App& app, const std::string& wanted) {
  std::error_code error;
  RunFolder folder;
  if (!wanted.empty()) {
    folder.path = fs::absolute(wanted);
    fs::create_directories(folder.path, error);
    if (error) return cannot_write(folder.path, error);
    // a report of an earlier run must not be taken for this one's
    fs::remove(folder.path / "report.json", error);
  } else {
    const fs::path out = fs::absolute("out");
    fs::create_directories(out, error);
    if (error) return cannot_write(out, error);
    const std::time_t now = std::time(nullptr);
    const std::string base = fmt::format("{:%Y%m%d-%H%M%S}-{}", fmt::localtime(now), app.name);
    // two runs in one second
    for (int number = 1; folder.path.empty(); ++number) {
      const fs::path candidate = out / (number == 1 ? base : fmt::format("{}-{}", base, number));
      if (fs::create_directory(candidate, error)) {
        folder.path = candidate;
      } else if (error || number > 1000) {
        return cannot_write(candidate, error);
      }
    }
    if (auto status = point_latest_to(out, folder.path.filename()); !status) return status.error();
  }
  for (const char* inner : {"nodes", "logs"}) {
    fs::create_directories(folder.path / inner, error);
    if (error) return cannot_write(folder.path / inner, error);
  }
  for (const auto& entry : fs::directory_iterator(folder.path / "logs", error))
    fs::remove(entry.path(), error);
  if (auto status = write_text(folder.path / "app.yaml", dump_app(app)); !status) return status.error();
  return folder;
}

Result<fs::path> write_node_file(const App& app, const AppProcess& process, const RunSettings& settings,
                                 const Places& places, const RunFolder& folder) {
  YAML::Node lockstep_nodes(YAML::NodeType::Sequence);
  if (app.lockstep) {
    for (const auto& other : app.processes) {
      if (other.clock == "lockstep") lockstep_nodes.push_back(other.name);
    }
  }
  const std::map<std::string, YAML::Node> values = {
      {"app", YAML::Node(app.name)},
      {"robot_file", YAML::Node(settings.robot_file.string())},
      {"world_file", YAML::Node(settings.world_file.string())},
      {"seed", YAML::Node(app.seed)},
      {"hand", YAML::Node(app.hand)},
      {"rate", YAML::Node(app.rate)},
      {"lockstep", YAML::Node(app.lockstep)},
      {"lockstep_nodes", lockstep_nodes},
      {"audio", app.audio},
      {"domain", YAML::Node(settings.domain)},
      {"config", YAML::Node(places.config.string())},
      {"out", YAML::Node(folder.path.string())},
      {"for_s", YAML::Node(app.for_s)},
  };
  YAML::Node node;
  node["name"] = process.name;
  node["domain"] = settings.domain;
  node["clock"] = clock_of(app, process);
  node["period_s"] = process.period_s;
  node["seed"] = app.seed;
  node["parameters"] = fill_references(process.parameters, values);
  node["connections"] = YAML::Node(YAML::NodeType::Sequence);
  for (const auto& [output, input] : connections_of(app, process)) {
    YAML::Node connection;
    connection["out"] = output;
    connection["in"] = input;
    node["connections"].push_back(connection);
  }
  YAML::Emitter out;
  out << node;
  const fs::path path = folder.path / "nodes" / (process.name + ".yaml");
  if (auto status = write_text(path, std::string(out.c_str()) + "\n"); !status) return status.error();
  return path;
}

}  // namespace nido
