// nido: the command line (docs/cli.md).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>

#include "completion.h"
#include "nido/interfaces/result.h"
#include "nido/launcher/launch.h"
#include "nido/launcher/suggest.h"
#include "nido/launcher/terminal.h"
#include "security_verbs.h"
#include "verbs.h"

namespace {

using nido::LaunchRequest;
using nido::Override;
namespace cli = nido::cli;

int domain_of_environment() {
  for (const char* name : {"NIDO_DOMAIN", "ROS_DOMAIN_ID"}) {
    const char* text = std::getenv(name);
    if (text != nullptr && *text != '\0') return std::atoi(text);
  }
  return 0;
}

// `nido launch`: options become overrides of the app's defaults, in one place with their names.
void add_launch(CLI::App& root, LaunchRequest& request) {
  CLI::App* verb = root.add_subcommand("launch", "start an app's processes, tell its story, stop them all");
  verb->footer(
      "examples\n"
      "  nido launch speech_and_action --say \"grasp red ball\" --seed 7\n"
      "  nido launch speech_and_action --world random_table --rate 1 --verbose\n"
      "  nido launch speech_and_action --set wall_limit_s=60 --set vision.show=true --dump");
  verb->add_option("app", request.app, "name of an app in config/apps, or a file")->required();
  verb->add_option("--set", request.sets,
                   "set any key of the app file: KEY=VALUE (seed=3, vision.threshold=0.5)")
      ->expected(1)
      ->take_all()
      ->type_name("KEY=VALUE");
  const auto text = [&](const char* option, const char* path, const char* meaning, const char* type) {
    verb->add_option_function<std::string>(
            option,
            [&request, option = std::string(option), path = std::string(path)](const std::string& value) {
              request.options.push_back({path, YAML::Node(value), option + " " + value});
            },
            meaning)
        ->type_name(type)
        ->take_last();
  };
  text("--robot", "defaults.robot", "robot file: a name in config/robots, or a path", "FILE");
  text("--world", "defaults.world", "world: a name in config/worlds, or a path", "NAME|FILE");
  text("--seed", "defaults.seed", "seeds every random generator", "N");
  text("--hand", "defaults.hand", "the hand that acts, in apps that act with one", "right|left");
  text("--rate", "defaults.rate", "simulated seconds in a second, or max", "R|max");
  text("--domain", "defaults.domain", "DDS domain; ROS_DOMAIN_ID or 0 otherwise", "N");
  text("--for", "defaults.for_s", "end after this simulated time, s", "SECONDS");
  text("--voice", "defaults.audio.voice", "espeak-ng voice of --say", "V");
  const auto source = [&request](const std::string& kind, const std::string& origin) {
    request.options.push_back({"defaults.audio.source", YAML::Node(kind), origin});
  };
  auto* say = verb->add_option_function<std::string>(
      "--say",
      [&request, source](const std::string& value) {
        source("synthesis", "--say " + value);
        request.options.push_back({"defaults.audio.text", YAML::Node(value), "--say " + value});
      },
      "what the robot is told, by speech synthesis");
  say->type_name("TEXT")->take_last();
  auto* audio = verb->add_option_function<std::string>(
      "--audio",
      [&request, source](const std::string& value) {
        source("wav", "--audio " + value);
        request.options.push_back({"defaults.audio.file", YAML::Node(value), "--audio " + value});
      },
      "a sound file that the robot hears");
  audio->type_name("FILE")->take_last();
  auto* mic = verb->add_flag_callback(
      "--mic", [source] { source("microphone", "--mic"); }, "the robot hears this computer's microphone");
  say->excludes(audio)->excludes(mic);
  audio->excludes(mic);
  verb->add_flag_callback(
      "--lockstep",
      [&request] {
        request.options.push_back({"defaults.lockstep", YAML::Node(true), "--lockstep"});
      },
      "the simulator waits for every node at every tick: repeatable");
  verb->add_flag_callback(
      "--window",
      [&request] {
        request.options.push_back({"processes.robot.parameters.window", YAML::Node(true), "--window"});
      },
      "shows the simulated world on this computer's display (docs/window.md)");
  verb->add_option("--out", request.out,
                   "folder for what the run leaves behind; out/TIME-APP and out/latest otherwise")
      ->type_name("DIR");
  verb->add_option("--record", request.record, "write what all ports send into this file (docs/recording.md)")
      ->type_name("FILE.mcap");
  // a flag with a value, so that what follows it on the line is not taken for its port
  verb->add_flag(
      "--dashboard{8080}", request.dashboard,
      "a page in the browser to watch and drive the run; --dashboard=PORT for another port than 8080, 0: a "
      "free one");
  verb->add_flag("--verbose,-v", request.verbose, "show the processes' output");
  verb->add_flag("--json", request.json, "the outcome as JSON on stdout, the story on stderr");
  verb->add_flag("--dump", request.dump, "print the app with every default filled in, start nothing");
  verb->callback([&request] { throw CLI::RuntimeError(nido::run_launch(request)); });
}

class Verbs {
 public:
  explicit Verbs(CLI::App& root) : root_(root) {}

  // A verb that looks into a domain: with --json, --domain, --wait and an example.
  CLI::App* add(CLI::App* parent, const std::string& name, const std::string& meaning,
                const std::string& example) {
    CLI::App* verb = (parent == nullptr ? &root_ : parent)->add_subcommand(name, meaning);
    verb->footer("example\n  " + example);
    verb->add_flag("--json", common.json, "print JSON");
    verb->add_option("--domain", common.domain, "DDS domain; ROS_DOMAIN_ID or 0 otherwise")
        ->check(CLI::Range(0, 101))
        ->type_name("N");
    verb->add_option("--wait", common.wait_s, "seconds that a thing is waited for")
        ->check(CLI::Range(0.0, 3600.0))
        ->type_name("SECONDS");
    return verb;
  }
  CLI::App* group(const std::string& name, const std::string& meaning, const std::string& example) {
    CLI::App* verb = root_.add_subcommand(name, meaning);
    verb->require_subcommand(1)->footer("example\n  " + example);
    return verb;
  }
  cli::Common common;

 private:
  CLI::App& root_;
};

struct PortArguments {
  std::string port;
  std::string other;
  std::vector<std::string> words;
  int count = 0;
  double for_s = 0;
};

void add_ports(Verbs& verbs, PortArguments& args) {
  auto& common = verbs.common;
  CLI::App* port =
      verbs.group("port", "look at and drive any port", "nido port read /icubSim/head/state:o --count 1");
  const auto one = [&](const char* name, const char* meaning, const char* example) {
    CLI::App* verb = verbs.add(port, name, meaning, example);
    verb->add_option("port", args.port, "name of a port")->required();
    return verb;
  };
  verbs.add(port, "list", "every port", "nido port list")->callback([&common] {
    throw CLI::RuntimeError(cli::port_list(common));
  });
  one("info", "type, owner, connections and losses", "nido port info /vision/left:i")->callback([&] {
    throw CLI::RuntimeError(cli::port_info(common, args.port));
  });
  auto* read =
      one("read", "print what an output writes", "nido port read /vision/objects:o --count 1 --json");
  read->add_option("--count", args.count, "end after N messages; 0: go on until Ctrl-C")
      ->check(CLI::Range(0, 1000000000))
      ->type_name("N");
  const auto idl = [&common](CLI::App* verb) {
    verb->add_option("--idl", common.idl, "a file that defines the message type, if nido does not know it")
        ->expected(1)
        ->take_all()
        ->type_name("FILE");
  };
  idl(read);
  read->add_option("--for", args.for_s, "end after this time")
      ->check(CLI::Range(0.0, 1e9))
      ->type_name("SECONDS");
  read->callback([&] { throw CLI::RuntimeError(cli::port_read(common, args.port, args.count, args.for_s)); });
  auto* write = one("write", "send one message to an input",
                    "nido port write /icubSim/head/command:i mode=position joint=[0] value=[0.2]");
  idl(write);
  write->add_option("value", args.words, "one map in YAML or JSON, or FIELD=VALUE...")->required();
  write->callback([&] { throw CLI::RuntimeError(cli::port_write(common, args.port, args.words)); });
  auto* rpc = one("rpc", "ask a service and print its answer", "nido port rpc /icubSim/head/rpc:i get encs");
  rpc->add_option("text", args.words, "what to ask")->required();
  rpc->callback([&] { throw CLI::RuntimeError(cli::port_rpc(common, args.port, args.words)); });
  const auto two = [&](const char* name, const char* meaning, const char* example) {
    CLI::App* verb = verbs.add(port, name, meaning, example);
    verb->add_option("out", args.port, "output port")->required();
    verb->add_option("in", args.other, "input port")->required();
    return verb;
  };
  two("connect", "let an input take from an output, now or when that appears",
      "nido port connect /icubSim/cam/left/image:o /vision/left:i")
      ->callback([&] { throw CLI::RuntimeError(cli::port_connect(common, args.port, args.other)); });
  two("disconnect", "undo connect", "nido port disconnect /icubSim/cam/left/image:o /vision/left:i")
      ->callback([&] { throw CLI::RuntimeError(cli::port_disconnect(common, args.port, args.other)); });
  const auto measure = [&](const char* name, const char* meaning, cli::Measure what) {
    auto* verb =
        one(name, meaning, (std::string("nido port ") + name + " /icubSim/cam/left/image:o --for 5").c_str());
    verb->add_option("--for", args.for_s, "how long to measure; 3 otherwise")
        ->check(CLI::Range(0.0, 1e6))
        ->type_name("SECONDS");
    verb->callback([&, what] {
      throw CLI::RuntimeError(cli::port_measure(common, args.port, what, args.for_s > 0 ? args.for_s : 3.0));
    });
  };
  measure("hz", "messages a second", cli::Measure::kRate);
  measure("bw", "bytes a second", cli::Measure::kBandwidth);
  measure("delay", "wall time from writing to arrival", cli::Measure::kDelay);
  auto* ping = one("ping", "round trip to the process that owns a port", "nido port ping /vision/objects:o");
  ping->add_option("--count", args.count, "how often; 4 otherwise")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N");
  ping->callback(
      [&] { throw CLI::RuntimeError(cli::port_ping(common, args.port, args.count > 0 ? args.count : 4)); });
}

struct ParamArguments {
  std::string node;
  std::string key;
  std::string value;
  std::string file;
};

void add_params(Verbs& verbs, ParamArguments& args) {
  auto& common = verbs.common;
  CLI::App* group = verbs.group("param", "parameters of running processes", "nido param list vision");
  const auto one = [&](const char* name, const char* meaning, const char* example) {
    CLI::App* verb = verbs.add(group, name, meaning, example);
    verb->add_option("node", args.node, "name of a node")->required();
    return verb;
  };
  one("list", "values, units, ranges and what they are for", "nido param list vision")->callback([&] {
    throw CLI::RuntimeError(cli::param_list(common, args.node));
  });
  auto* get = one("get", "one value", "nido param get vision threshold");
  get->add_option("key", args.key, "of a parameter")->required();
  get->callback([&] { throw CLI::RuntimeError(cli::param_get(common, args.node, args.key)); });
  auto* set = one("set", "change a value while the node runs", "nido param set speech threshold 0.6");
  set->add_option("key", args.key, "of a parameter")->required();
  set->add_option("value", args.value, "in YAML")->required();
  set->callback([&] { throw CLI::RuntimeError(cli::param_set(common, args.node, args.key, args.value)); });
  auto* save = one("save", "write all values into a file", "nido param save vision vision.yaml");
  save->add_option("file", args.file, "YAML, as apps and nodes take it")->required();
  save->callback([&] { throw CLI::RuntimeError(cli::param_save(common, args.node, args.file)); });
}

void add_record(Verbs& verbs, cli::RecordRequest& request) {
  auto* verb = verbs.add(nullptr, "record", "write what ports send into an MCAP file",
                         "nido record -o run.mcap\n"
                         "  nido record -o eyes.mcap '/icubSim/cam/*' /vision/objects:o --for 10");
  verb->add_option("-o,--output", request.file, "the file; an old one becomes FILE.mcap~")
      ->required()
      ->type_name("FILE.mcap");
  verb->add_option("port", request.ports, "output ports, * and ? allowed; all otherwise");
  verb->add_option("--except", request.except, "ports that are left out")
      ->expected(1)
      ->take_all()
      ->type_name("PORT");
  verb->add_option("--for", request.for_s, "end after this time; Ctrl-C otherwise")
      ->check(CLI::Range(0.0, 1e9))
      ->type_name("SECONDS");
  verb->add_option("--memory", request.memory_mb, "what may wait to be written; what comes beyond is lost")
      ->check(CLI::Range(1.0, 1e6))
      ->type_name("MB");
  verb->add_option("--clock", request.clock, "time of the messages: auto is simulated if /clock runs")
      ->check(CLI::IsMember({"auto", "wall", "simulated"}));
  verb->add_option("--compression", request.compression)->check(CLI::IsMember({"zstd", "none"}));
  verb->callback([&] { throw CLI::RuntimeError(cli::record(verbs.common, request)); });
}

void add_replay(Verbs& verbs, cli::ReplayRequest& request) {
  auto* verb = verbs.add(nullptr, "replay", "publish what an MCAP file holds on the same ports",
                         "nido replay run.mcap --rate 2\n"
                         "  nido replay run.mcap '/icubSim/cam/*' --loop\n"
                         "  nido replay run.mcap --info");
  verb->add_option("file", request.file, "a recording")->required()->type_name("FILE.mcap");
  verb->add_option("port", request.ports, "ports, * and ? allowed; all otherwise");
  verb->add_option("--except", request.except, "ports that are left out")
      ->expected(1)
      ->take_all()
      ->type_name("PORT");
  verb->add_option("--rate", request.rate, "recorded seconds in a second, or max")->type_name("R|max");
  verb->add_flag("--loop", request.loop, "again and again");
  verb->add_flag("--info", request.info, "only show what the file holds");
  verb->add_option("--from", request.from_s, "begin there")
      ->check(CLI::NonNegativeNumber)
      ->type_name("SECONDS");
  verb->add_option("--to", request.to_s, "end there")->check(CLI::NonNegativeNumber)->type_name("SECONDS");
  verb->add_option("--readers", request.readers, "inputs that each port waits for (--wait) before it begins")
      ->check(CLI::Range(0, 1000))
      ->type_name("N");
  verb->add_option("--lockstep", request.lockstep, "a node that takes part in every recorded tick")
      ->expected(1)
      ->take_all()
      ->type_name("NODE");
  verb->add_option("--name", request.name, "of the node that publishes")->type_name("NAME");
  verb->callback([&] { throw CLI::RuntimeError(cli::replay(verbs.common, request)); });
}

void add_compare(CLI::App& root, cli::Common& common, cli::CompareRequest& request) {
  auto* verb = root.add_subcommand("compare",
                                   "say whether two recordings are the same, or where they begin to differ");
  verb->footer(
      "examples\n  nido compare monday.mcap tuesday.mcap\n"
      "  nido compare a.mcap b.mcap '/icubSim/cam/*' --to 20\n"
      "exit codes: 0 the same, 1 not the same");
  verb->add_flag("--json", common.json, "print JSON");
  verb->add_option("first", request.first, "a recording")->required()->type_name("FILE.mcap");
  verb->add_option("second", request.second, "another one")->required()->type_name("FILE.mcap");
  verb->add_option("port", request.ports, "ports, * and ? allowed; all but /log otherwise");
  verb->add_option("--except", request.except, "ports that are left out")
      ->expected(1)
      ->take_all()
      ->type_name("PORT");
  verb->add_option("--from", request.from_s, "nothing before this, s since the first one's first message")
      ->check(CLI::NonNegativeNumber)
      ->type_name("SECONDS");
  verb->add_option("--to", request.to_s, "no further than this; to the end of the shorter one otherwise")
      ->check(CLI::NonNegativeNumber)
      ->type_name("SECONDS");
  verb->callback([&] { throw CLI::RuntimeError(cli::compare(common, request)); });
}

// What cannot be parsed: told as everything else that fails.
int refuse(const std::string& sentence, const std::vector<std::string>& words) {
  const bool as_json = std::find(words.begin(), words.end(), "--json") != words.end();
  const int code = nido::print_error({nido::ErrorCode::kInvalidArgument, sentence}, as_json);
  fmt::print(stderr, "see nido --help, or --help after a verb\n");
  return code;
}

// The first word that is no verb where one has to be, in a sentence; empty if there is none.
std::string unknown_verb(CLI::App& root, const std::vector<std::string>& words) {
  CLI::App* at = &root;
  std::string path = "nido";
  for (const std::string& word : words) {
    const auto verbs = at->get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
    if (verbs.empty() || word.starts_with('-')) return "";
    const auto next = std::find_if(verbs.begin(), verbs.end(),
                                   [&](const CLI::App* verb) { return verb->check_name(word); });
    if (next == verbs.end()) {
      std::vector<std::string> names;
      for (const CLI::App* verb : verbs) names.push_back(verb->get_name());
      const std::string near = nido::nearest_word(word, names);
      return fmt::format("{} has no verb '{}'{}; there are: {}", path, word,
                         near.empty() ? "" : fmt::format(", did you mean '{}'?", near),
                         nido::join_words(names));
    }
    at = *next;
    path += " " + word;
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App root{"nido: starts, watches and drives the processes of a robot"};
  root.require_subcommand(1);
  root.footer(
      "example\n  nido launch speech_and_action --say \"drop blue cube into basket\"\n"
      "exit codes: 0 done; 1 the job failed; 2 wrong usage or config; 3 something needed is not there; 130 "
      "interrupted");
  root.set_version_flag("--version", std::string("nido ") + NIDO_VERSION);

  LaunchRequest launch;
  add_launch(root, launch);
  Verbs verbs(root);
  auto& common = verbs.common;
  common.domain = domain_of_environment();
  PortArguments port_args;
  add_ports(verbs, port_args);
  cli::add_security(root, common);

  std::string node_name;
  CLI::App* node = verbs.group("node", "look at processes", "nido node info vision");
  verbs.add(node, "list", "every process", "nido node list")->callback([&] {
    throw CLI::RuntimeError(cli::node_list(common));
  });
  auto* node_info =
      verbs.add(node, "info", "parameters, ports, connections, losses of a process", "nido node info vision");
  node_info->add_option("node", node_name, "name of a node")->required();
  node_info->callback([&] { throw CLI::RuntimeError(cli::node_info(common, node_name)); });
  std::vector<std::string> node_words;
  auto* node_call = verbs.add(node, "call", "tell a process something: the emergency stop of a robot",
                              "nido node call robot estop\n  nido node call robot estop clear");
  node_call->add_option("node", node_name, "name of a node")->required();
  node_call->add_option("text", node_words, "last name of one of its services, and what that is told")
      ->required();
  node_call->callback([&] { throw CLI::RuntimeError(cli::node_call(common, node_name, node_words)); });

  ParamArguments param_args;
  add_params(verbs, param_args);
  std::vector<std::string> clock_words;
  auto* clock = verbs.add(nullptr, "clock", "simulated time: look at it, pause, run, step, pace it",
                          "nido clock\n  nido clock pause\n  nido clock step 100\n  nido clock rate 0.5");
  clock->add_option("text", clock_words, "nothing, or pause, run, step [N], rate R|max");
  clock->callback([&] { throw CLI::RuntimeError(cli::clock(common, clock_words)); });

  std::vector<std::string> world_words;
  auto* world =
      verbs.add(nullptr, "world", "short for nido port rpc /icubSim/world ...", "nido world get box 1");
  world->add_option("text", world_words, "a command of the world port")->required();
  world->callback([&] { throw CLI::RuntimeError(cli::port_rpc(common, "/icubSim/world", world_words)); });

  verbs.add(nullptr, "doctor", "check this machine, and say the mend", "nido doctor")->callback([&] {
    throw CLI::RuntimeError(cli::doctor(common));
  });

  cli::RecordRequest record;
  add_record(verbs, record);
  cli::ReplayRequest replay;
  add_replay(verbs, replay);
  cli::CompareRequest compare;
  add_compare(root, common, compare);

  std::string dashboard_port = "8080";
  auto* dashboard =
      root.add_subcommand("dashboard", "a page in the browser to watch and drive what runs already");
  dashboard->footer("example\n  nido dashboard --port 8090");
  dashboard->add_option("--port", dashboard_port, "of 127.0.0.1; 0: a free one")->type_name("PORT");
  dashboard->add_option("--domain", common.domain, "DDS domain; ROS_DOMAIN_ID or 0 otherwise")
      ->check(CLI::Range(0, 101))
      ->type_name("N");
  dashboard->callback([&] { throw CLI::RuntimeError(cli::dashboard(common, dashboard_port)); });

  std::string shell;
  auto* completion = root.add_subcommand("completion", "print the completion script of a shell");
  completion->footer("example\n  source <(nido completion bash)");
  completion->add_option("shell", shell, "bash or zsh")->required()->check(CLI::IsMember({"bash", "zsh"}));
  completion->callback([&] { throw CLI::RuntimeError(cli::completion(shell)); });

  cli::ExperimentRequest request;
  CLI::App* experiment = root.add_subcommand("experiment", "the experiments and their reports");
  experiment->require_subcommand(1)->footer(
      "example\n  nido experiment run reach-learning --seed 3 --out out/reach");
  auto* list = experiment->add_subcommand("list", "every experiment");
  list->footer("example\n  nido experiment list");
  list->add_flag("--json", common.json, "print JSON");
  list->callback([&] { throw CLI::RuntimeError(cli::experiment_list(common)); });
  auto* run = experiment->add_subcommand("run", "run one: report.json, report.html and pictures in DIR");
  run->footer("example\n  nido experiment run reach-learning --seed 3 --out out/reach");
  run->add_option("name", request.name, "name of an experiment")->required();
  run->add_option("--seed", request.seed, "seeds every random generator")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  run->add_option("--trials", request.trials, "how often")->check(CLI::PositiveNumber)->type_name("N");
  run->add_option("--jobs", request.jobs, "trials at a time")->check(CLI::PositiveNumber)->type_name("J");
  run->add_option("--out", request.out, "folder for the report")->type_name("DIR");
  run->add_option("--set", request.sets, "set a key of the experiment")
      ->expected(1)
      ->take_all()
      ->type_name("KEY=VALUE");
  run->allow_extras()->callback([&] {
    request.others = run->remaining();
    throw CLI::RuntimeError(cli::experiment_run(request));
  });

  std::string bench_name;
  auto* bench =
      root.add_subcommand("bench", "run a benchmark with its baseline: rtt, rpc, image, cameras, ...");
  bench->footer("example\n  nido bench rtt --json");
  bench->add_option("name", bench_name, "name of a benchmark")->required();
  bench->allow_extras()->callback(
      [&] { throw CLI::RuntimeError(cli::bench(bench_name, bench->remaining())); });

  // words that are not finished yet cannot be parsed
  if (argc > 1 && std::string(argv[1]) == "complete") {
    return cli::complete(root, {argv + 2, argv + argc}, common);
  }
  try {
    root.parse(argc, argv);
  } catch (const CLI::RuntimeError& end) {
    return end.get_exit_code();
  } catch (const CLI::Success& asked) {
    return root.exit(asked);
  } catch (const CLI::RequiredError& wrong) {
    const std::string unknown = unknown_verb(root, {argv + 1, argv + argc});
    return refuse(unknown.empty() ? wrong.what() : unknown, {argv + 1, argv + argc});
  } catch (const CLI::ParseError& wrong) {
    return refuse(wrong.what(), {argv + 1, argv + argc});
  }
  return 0;
}
