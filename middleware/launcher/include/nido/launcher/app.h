#pragma once

#include <yaml-cpp/yaml.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/launcher/schema.h"

namespace nido {

// What happens when a process ends in mid-run.
struct RestartPolicy {
  bool on_failure = false;   // false: never restarted
  int max_restarts = 3;      // in any window_s; one more and the process is given up
  double window_s = 60;      // wall time
  double backoff_s = 0.2;    // wall time before the first restart; doubles with each one in the window
  double backoff_max_s = 5;  // wall time
  bool fail_the_run = true;  // when given up: the run fails, or goes on without the process
};

// One process of an app.
struct AppProcess {
  std::string name;
  std::string program;                  // name of an executable beside `nido`, or a path
  std::string clock;                    // "owner", "lockstep", "simulated", "wall"
  double period_s = 0.01;               // of its ticks
  double ready_timeout_s = 30;          // wall time
  std::vector<std::string> depends_on;  // processes that must be ready before this one is started
  std::map<std::string, std::string> environment;
  YAML::Node parameters;  // may hold ${references}
  RestartPolicy restart;
};

// An app file, checked, with every default filled in.
struct App {
  std::string file;
  std::string name;
  std::string summary;
  std::string robot;  // name or file
  std::string world;  // name or file
  std::uint64_t seed = 1;
  std::string hand = "right";  // or "left": the one that acts
  std::string rate;            // "max" or a number
  bool lockstep = true;
  int domain = -1;                    // -1: ROS_DOMAIN_ID, or 0
  double for_s = 0;                   // simulated time; 0: until the outcome
  double wall_limit_s = 600;          // wall time after which a run without outcome is ended as failed
  YAML::Node audio;                   // what the robot hears
  std::string story;                  // port of StageEvent whose events are told on the terminal; empty: none
  std::string outcome;                // port of StageEvent whose event "outcome" ends the run; empty: none
  std::vector<AppProcess> processes;  // as in the file
  std::vector<std::size_t> start_order;  // indices: a process after those it depends on
  std::vector<std::pair<std::string, std::string>> connections;  // output port, input port
  YAML::Node document;  // the whole, for --dump: itself a valid app file
};

// The keys of an app file: meanings, bounds, defaults.
const Schema& app_schema();

// Names that ${...} may hold in parameters and environment of an app file; in connections ${hand} alone.
const std::vector<std::string>& app_reference_names();

// The override of `--set TEXT`, TEXT being KEY=VALUE. The key is a dotted path in the app file, or a key of
// `defaults`
// ("seed"), or PROCESS.KEY for a parameter of a process ("vision.threshold"). The value is YAML.
Result<Override> parse_set(const std::string& text, const YAML::Node& document);

// Reads and checks an app file. `options`: overrides of the command line, in their order; `sets`: texts of
// --set.
Result<App> load_app(const std::string& file, const std::vector<Override>& options = {},
                     const std::vector<std::string>& sets = {});

// The app as an app file with every default filled in.
std::string dump_app(const App& app);

// Replaces ${NAME} in every text of `node`; a text that is only a reference becomes the value itself, of any
// kind. The names must be of app_reference_names().
YAML::Node fill_references(const YAML::Node& node, const std::map<std::string, YAML::Node>& values);

}  // namespace nido
