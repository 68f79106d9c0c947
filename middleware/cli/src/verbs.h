#pragma once

#include <map>
#include <string>
#include <vector>

#include "session.h"

// The verbs of `nido`. Each prints its answer and returns the exit code of docs/cli.md.
namespace nido::cli {

int port_list(const Common& common);
int port_info(const Common& common, const std::string& port);
// count 0: until Ctrl-C. `for_s` 0: no limit.
int port_read(const Common& common, const std::string& port, int count, double for_s);
int port_write(const Common& common, const std::string& port, const std::vector<std::string>& words);
int port_rpc(const Common& common, const std::string& port, const std::vector<std::string>& words);
int port_connect(const Common& common, const std::string& output, const std::string& input);
int port_disconnect(const Common& common, const std::string& output, const std::string& input);
enum class Measure { kRate, kBandwidth, kDelay };
int port_measure(const Common& common, const std::string& port, Measure measure, double for_s);
int port_ping(const Common& common, const std::string& port, int count);

int node_list(const Common& common);
int node_info(const Common& common, const std::string& node);
// Asks the service of the node whose name ends in the first word, or the node itself.
int node_call(const Common& common, const std::string& node, const std::vector<std::string>& words);

// Parameters of a running node.
int param_list(const Common& common, const std::string& node);
int param_get(const Common& common, const std::string& node, const std::string& key);
int param_set(const Common& common, const std::string& node, const std::string& key,
              const std::string& value);
int param_save(const Common& common, const std::string& node, const std::string& file);

// What the owner of simulated time is told: nothing (it tells its state), pause, run, step [N], rate R|max.
int clock(const Common& common, const std::vector<std::string>& words);

int doctor(const Common& common);

// Recording and replay (docs/recording.md).
struct RecordRequest {
  std::string file;
  std::vector<std::string> ports;
  std::vector<std::string> except;
  double for_s = 0;  // 0: until Ctrl-C
  double memory_mb = 256;
  std::string clock = "auto";        // or "wall", "simulated"
  std::string compression = "zstd";  // or "none"
};
int record(const Common& common, const RecordRequest& request);
struct ReplayRequest {
  std::string file;
  std::vector<std::string> ports;
  std::vector<std::string> except;
  std::string rate = "1";  // or "max"
  bool loop = false;
  bool info = false;  // only show what the file holds
  double from_s = 0;
  double to_s = -1;  // < 0: to the end
  int readers = 0;
  std::string name = "replay";        // of the node
  std::vector<std::string> lockstep;  // nodes that take part in every tick
};
int replay(const Common& common, const ReplayRequest& request);

// Are two recordings the same, and if not, where do they begin to differ?
struct CompareRequest {
  std::string first;
  std::string second;
  std::vector<std::string> ports;
  std::vector<std::string> except;
  double from_s = 0;
  double to_s = -1;  // < 0: to the end of the shorter one
};
int compare(const Common& common, const CompareRequest& request);

struct ExperimentRequest {
  std::string name;
  std::string seed;    // empty: the experiment's own
  std::string trials;  // empty: the experiment's own
  std::string jobs;
  std::string out;
  std::vector<std::string> sets;
  std::vector<std::string> others;  // options of this experiment alone
};
int experiment_list(const Common& common);
int experiment_run(const ExperimentRequest& request);

// A page for what runs already: becomes nido-dashboard.
int dashboard(const Common& common, const std::string& port);
// Runs nido-bench-NAME beside nido.
int bench(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace nido::cli
