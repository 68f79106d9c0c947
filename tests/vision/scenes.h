#pragma once

#include <map>
#include <string>
#include <vector>

#include "stage.h"

namespace nido::test {

// What vision got wrong and right over random tables.
struct Accuracy {
  std::vector<double> position_error_m;
  std::vector<double> yaw_error_rad;  // cubes and basket
  std::map<std::string, std::vector<double>> position_error_by_name_m;
  int expected = 0;             // things in view
  int found = 0;                // and named rightly, within 4 cm
  int false_names = 0;          // percepts with no such thing within 4 cm
  std::vector<double> step_ms;  // cost of a step with pictures
};

struct RandomTable {
  std::string yaml;
  std::vector<std::string> names;
};
// A basket and `count` different things where the right hand reaches or beside, none touching another.
RandomTable random_table(std::uint64_t seed, int count);

// How hard it is to see.
struct Hardship {
  double brightness = 1.0;    // of the room's light
  double noise_levels = 0.0;  // of the cameras
  double table_up_m = 0.0;    // the table is so much higher
};
// Looks at random tables with the arms out of the way.
Accuracy measure_accuracy(int tables, std::uint64_t first_seed, const vision::TemplateSet& templates,
                          bool verbose, const Hardship& hardship = {});

double quantile(std::vector<double> values, double share);

}  // namespace nido::test
