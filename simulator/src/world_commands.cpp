#include "simulation_impl.h"

namespace nido::sim {

std::string run_world_command(Simulation::Impl& /*simulation*/, const std::string& /*line*/) {
  return "[fail] \"not yet\"";
}

}  // namespace nido::sim
