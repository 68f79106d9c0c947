#include "nido/launcher/app.h"

namespace nido {
namespace {

std::string port_rule(const std::string& text) {
  if (text.size() > 1 && text.front() == '/') return "";
  return "a port name starts with a slash, as /vision/objects:o";
}
std::string output_rule(const std::string& text) {
  if (port_rule(text).empty() && !text.ends_with(":i")) return "";
  return "the name of an output port starts with a slash and does not end in :i";
}
std::string input_rule(const std::string& text) {
  if (port_rule(text).empty() && text.ends_with(":i")) return "";
  return "the name of an input port starts with a slash and ends in :i";
}
std::string name_rule(const std::string& text) {
  if (!text.empty() &&
      text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
          std::string::npos) {
    return "";
  }
  return "a name is made of letters, digits, _ and -";
}
std::string not_empty_rule(const std::string& text) { return text.empty() ? "it must not be empty" : ""; }

const Schema& audio_schema() {
  static const Schema schema{
      "audio",
      "",
      {{.key = "source",
        .fallback = "silence",
        .meaning = "where the robot's microphone gets its sound from",
        .allowed = {"wav", "synthesis", "microphone", "silence"}},
       {.key = "text", .meaning = "what is said, for source synthesis", .rule = not_empty_rule},
       {.key = "voice", .meaning = "espeak-ng voice, for source synthesis", .rule = not_empty_rule},
       {.key = "file", .meaning = "sound file, for source wav", .rule = not_empty_rule},
       {.key = "start_s",
        .kind = ValueKind::kNumber,
        .fallback = "1.0",
        .meaning = "simulated time at which the sound starts, s",
        .min = 0}}};
  return schema;
}

const Schema& defaults_schema() {
  static const Schema schema{"defaults",
                             "",
                             {{.key = "robot",
                               .fallback = "icub_sim",
                               .meaning = "robot file: a name in config/robots, or a path",
                               .rule = not_empty_rule},
                              {.key = "world",
                               .fallback = "table",
                               .meaning = "world file: a name in config/worlds, or a path",
                               .rule = not_empty_rule},
                              {.key = "seed",
                               .kind = ValueKind::kInteger,
                               .fallback = "1",
                               .meaning = "seeds every random generator of the run",
                               .min = 0,
                               .max = 4294967295.0},
                              {.key = "hand",
                               .fallback = "right",
                               .meaning = "the hand that acts, for ${hand} in parameters and connections",
                               .allowed = {"right", "left"}},
                              {.key = "rate",
                               .kind = ValueKind::kNumberOrMax,
                               .fallback = "max",
                               .meaning = "simulated seconds in a second, or max"},
                              {.key = "lockstep",
                               .kind = ValueKind::kFlag,
                               .fallback = "true",
                               .meaning = "the simulator waits for every node at every tick: repeatable"},
                              {.key = "domain",
                               .kind = ValueKind::kInteger,
                               .meaning = "DDS domain; ROS_DOMAIN_ID or 0 if it is not given",
                               .min = 0,
                               .max = 101},
                              {.key = "for_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "0",
                               .meaning = "simulated time after which the run ends, s; 0: at the outcome",
                               .min = 0},
                              {.key = "wall_limit_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "600",
                               .meaning = "a run without outcome is ended after this wall time, s",
                               .min = 1},
                              {.key = "audio",
                               .kind = ValueKind::kMap,
                               .fallback = "{}",
                               .meaning = "what the robot hears",
                               .inner = &audio_schema()}}};
  return schema;
}

const Schema& restart_schema() {
  static const Schema schema{"restart",
                             "",
                             {{.key = "policy",
                               .fallback = "never",
                               .meaning = "when a process that ended is started again",
                               .allowed = {"never", "on-failure"}},
                              {.key = "max",
                               .kind = ValueKind::kInteger,
                               .fallback = "3",
                               .meaning = "restarts in a window before it is given up",
                               .min = 1,
                               .max = 100},
                              {.key = "window_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "60",
                               .meaning = "length of the window, wall s",
                               .min = 0.1},
                              {.key = "backoff_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "0.2",
                               .meaning = "wall s before the first restart, doubled with each",
                               .min = 0},
                              {.key = "backoff_max_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "5",
                               .meaning = "longest wall time before a restart, s",
                               .min = 0},
                              {.key = "escalate",
                               .fallback = "fail",
                               .meaning = "when it is given up: the run fails, or goes on without it",
                               .allowed = {"fail", "go-on"}}}};
  return schema;
}

const Schema& process_schema() {
  static const Schema schema{
      "process",
      "name",
      {{.key = "name",
        .required = true,
        .meaning = "the node's name, unique in its domain",
        .rule = name_rule},
       {.key = "program",
        .required = true,
        .meaning = "an executable beside nido, or a path",
        .rule = not_empty_rule},
       {.key = "clock",
        .fallback = "lockstep",
        .meaning = "owner drives /clock; lockstep: the owner waits for it when the run is in lockstep",
        .allowed = {"owner", "lockstep", "simulated", "wall"}},
       {.key = "period_s",
        .kind = ValueKind::kNumber,
        .fallback = "0.01",
        .meaning = "period of its ticks, s",
        .min = 0.001,
        .max = 10},
       {.key = "depends_on",
        .kind = ValueKind::kTextList,
        .fallback = "[]",
        .meaning = "processes that must be ready before it is started"},
       {.key = "ready_timeout_s",
        .kind = ValueKind::kNumber,
        .fallback = "30",
        .meaning = "wall time within which it must be ready, s",
        .min = 0.1,
        .max = 3600},
       {.key = "environment",
        .kind = ValueKind::kTextMap,
        .fallback = "{}",
        .meaning = "environment variables"},
       {.key = "parameters",
        .kind = ValueKind::kAnyMap,
        .fallback = "{}",
        .meaning = "the node's own settings"},
       {.key = "restart",
        .kind = ValueKind::kMap,
        .fallback = "{}",
        .meaning = "what happens when it ends in mid-run",
        .inner = &restart_schema()}}};
  return schema;
}

const Schema& connection_schema() {
  static const Schema schema{"connection",
                             "",
                             {{.key = "out", .required = true, .meaning = "output port", .rule = output_rule},
                              {.key = "in", .required = true, .meaning = "input port", .rule = input_rule}}};
  return schema;
}

}  // namespace

const Schema& app_schema() {
  static const Schema schema{
      "app",
      "",
      {{.key = "name", .required = true, .meaning = "the app's name", .rule = name_rule},
       {.key = "summary", .fallback = "''", .meaning = "what it does, in a sentence"},
       {.key = "defaults",
        .kind = ValueKind::kMap,
        .fallback = "{}",
        .meaning = "what options of nido launch replace",
        .inner = &defaults_schema()},
       {.key = "story",
        .meaning = "port of StageEvent whose events are told on the terminal",
        .rule = output_rule},
       {.key = "outcome",
        .meaning = "port of StageEvent whose event 'outcome' ends the run",
        .rule = output_rule},
       {.key = "processes",
        .kind = ValueKind::kList,
        .required = true,
        .meaning = "what is started",
        .inner = &process_schema()},
       {.key = "connections",
        .kind = ValueKind::kList,
        .fallback = "[]",
        .meaning = "which output feeds which input",
        .inner = &connection_schema()}}};
  return schema;
}

const std::vector<std::string>& app_reference_names() {
  static const std::vector<std::string> names = {
      "app",    "robot_file", "world_file", "seed",  "rate", "lockstep", "audio", "lockstep_nodes",
      "domain", "config",     "out",        "for_s", "hand"};
  return names;
}

}  // namespace nido
