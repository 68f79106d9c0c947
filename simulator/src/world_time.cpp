// The world port's verbs about simulated time. Time is the clock's owner's: a verb says what to ask it.
#include <array>
#include <cmath>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr double kFastest = 1000;
constexpr double kLongestStep_s = 60;  // the port answers nobody else meanwhile

std::string ask(Impl& sim, Arguments& arguments, const std::string& request) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (sim.clock_request == nullptr)
    return fail_reply("could not set time", "there is no clock here: whoever made the simulation steps it");
  *sim.clock_request = request;
  return "[ok]";
}

std::string time(Impl& sim, Arguments& arguments) { return ask(sim, arguments, "get"); }

std::string pause(Impl& sim, Arguments& arguments) { return ask(sim, arguments, "pause"); }

std::string go_on(Impl& sim, Arguments& arguments) { return ask(sim, arguments, "run"); }

std::string step(Impl& sim, Arguments& arguments) {
  constexpr double kPeriod_s = Simulation::kControlPeriod_s;
  double time_s = kPeriod_s;
  if (!arguments.done())
    time_s = arguments.number("could not step", "the time (s; longer: nido clock step TICKS)", kPeriod_s,
                              kLongestStep_s);
  return ask(sim, arguments, "step " + std::to_string(std::llround(time_s / kPeriod_s)));
}

std::string rate(Impl& sim, Arguments& arguments) {
  if (arguments.peek() != "max")
    return ask(sim, arguments,
               "rate " + number_text(arguments.number("could not set rate", "the rate", 0.01, kFastest)));
  arguments.skip();
  return ask(sim, arguments, "rate max");
}

constexpr std::array<WorldVerb, 5> kVerbs = {{
    {"time", time, "", "how the clock stands, as nido clock says it: time_s=12.34 state=running rate=max",
     "world time"},
    {"pause", pause, "", "time stands still; the port still answers", "world pause"},
    {"go", go_on, "", "time goes on", "world go"},
    {"step", step, "[SECONDS]",
     "lets 0.01 s or so many seconds pass, at most 60, then pauses and answers; the port's other "
     "clients wait meanwhile, and nido clock pause ends it",
     "world step 0.5"},
    {"rate", rate, "RATE|max", "simulated seconds a second", "world rate 2"},
}};

}  // namespace

WorldVerbs time_verbs() { return {"Time", kVerbs}; }

}  // namespace nido::sim
