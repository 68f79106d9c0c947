// nido-bench-physics: how fast the robot and its world are simulated, beside other engines with the same
// scene. Prints the rows of `nido bench physics` (docs/simulator.md).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>

#include "physics_scene.h"

using namespace nido;
using namespace nido::bench;

namespace {

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// One contender's times for pieces of the same motion.
struct Measured {
  std::unique_ptr<Contender> contender;
  std::vector<double> wall_factor;
  std::vector<double> processor_factor;
  double contacts = 0;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

int fail(const Error& error) {
  std::cerr << error.message << '\n';
  return error.code == ErrorCode::kNotFound ? 3 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string urdf = "config/robots/icub.urdf";
  int pieces = 20;
  bool json = false;
  std::string only;
  CLI::App app{
      "Measures the physics: 53 joints in motion, a ball in each hand, a table with eight things. "
      "Example: nido-bench-physics --json"};
  app.add_option("--urdf", urdf);
  app.add_option("-n,--pieces", pieces, "pieces of 0.2 simulated seconds")->check(CLI::Range(1, 100000));
  app.add_option("--only", only, "only the contender of this name");
  app.add_flag("--json", json);
  CLI11_PARSE(app, argc, argv);

  auto scene = PhysicsScene::create(urdf);
  if (!scene) return fail(scene.error());
  std::vector<Measured> all;
  const auto add = [&all, &only](Result<std::unique_ptr<Contender>> made) -> Status {
    if (!made) return made.error();
    if (only.empty() || (*made)->name() == only) all.push_back({std::move(*made), {}, {}, 0});
    return {};
  };
  for (const NidoVariant& variant : {NidoVariant{}, NidoVariant{"nido, without self-collision", false},
                                     NidoVariant{"nido, skin pressed", true, true, true},
                                     NidoVariant{"nido, pressed there, without skin", true, false, true}}) {
    if (Status ok = add(make_nido(*scene, variant)); !ok) return fail(ok.error());
  }
  if (Status ok = add(make_bare_ode(*scene)); !ok) return fail(ok.error());
#ifdef NIDO_WITH_MUJOCO
  if (Status ok = add(make_mujoco(*scene)); !ok) return fail(ok.error());
#endif

  constexpr int kPeriods = 20;
  constexpr int kWarmUp = 4;
  using Clock = std::chrono::steady_clock;
  for (int piece = -kWarmUp; piece < pieces; ++piece) {
    for (Measured& m : all) {  // interleaved: the machine's moods hit all alike
      const double processor_start_s = processor_s();
      const auto start = Clock::now();
      for (int p = 0; p < kPeriods; ++p) {
        const double time_s = ((piece + kWarmUp) * kPeriods + p + 1) * PhysicsScene::kControlPeriod_s;
        if (Status ok = m.contender->advance(scene->axes_rad(time_s)); !ok) return fail(ok.error());
      }
      if (piece < 0) continue;
      const double simulated_s = kPeriods * PhysicsScene::kControlPeriod_s;
      m.wall_factor.push_back(simulated_s / std::chrono::duration<double>(Clock::now() - start).count());
      m.processor_factor.push_back(simulated_s / (processor_s() - processor_start_s));
      m.contacts += static_cast<double>(m.contender->contacts()) / pieces;
    }
  }

  nlohmann::json rows = nlohmann::json::array();
  for (const Measured& m : all) {
    const auto row = [&](const char* metric, double value, const char* unit) {
      rows.push_back({{"who", m.contender->name()},
                      {"metric", metric},
                      {"value", value},
                      {"unit", unit},
                      {"n", pieces}});
    };
    row("realtime_factor_p50", median(m.wall_factor), "1");
    row("realtime_factor_max", *std::max_element(m.wall_factor.begin(), m.wall_factor.end()), "1");
    row("realtime_factor_processor_p50", median(m.processor_factor), "1");
    row("contacts_mean", m.contacts, "1");
  }
  if (json) {
    std::cout << nlohmann::json{{"bench", "physics"}, {"rows", rows}}.dump() << '\n';
    return 0;
  }
  for (const auto& row : rows) {
    std::cout << row["who"].get<std::string>() << "  " << row["metric"].get<std::string>() << "  "
              << row["value"].get<double>() << " " << row["unit"].get<std::string>() << '\n';
  }
  return 0;
}
