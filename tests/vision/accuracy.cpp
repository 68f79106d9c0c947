// Measures vision over random tables: vision_accuracy [TABLES] [FIRST_SEED] [BRIGHTNESS] [NOISE_LEVELS]
// [TABLE_UP_M]
#include <cstdio>
#include <cstdlib>

#include "scenes.h"

int main(int argc, char** argv) {
  const int tables = argc > 1 ? std::atoi(argv[1]) : 20;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 1);
  nido::test::Hardship hardship;
  if (argc > 3) hardship.brightness = std::atof(argv[3]);
  if (argc > 4) hardship.noise_levels = std::atof(argv[4]);
  if (argc > 5) hardship.table_up_m = std::atof(argv[5]);
  auto templates = nido::vision::TemplateSet::load(std::string(NIDO_CONFIG_DIR) + "/objects/templates.yaml");
  if (!templates) {
    std::fprintf(stderr, "%s\n", templates.error().message.c_str());
    return 3;
  }
  const auto a = nido::test::measure_accuracy(tables, seed, *templates, true, hardship);
  using nido::test::quantile;
  std::printf("things in view %d, found %d, false %d\n", a.expected, a.found, a.false_names);
  std::printf("position error: median %.1f mm, 95 %% %.1f mm, worst %.1f mm\n",
              1000 * quantile(a.position_error_m, 0.5), 1000 * quantile(a.position_error_m, 0.95),
              1000 * quantile(a.position_error_m, 1));
  for (const auto& [name, errors] : a.position_error_by_name_m) {
    std::printf("  %-11s median %.1f mm, worst %.1f mm, n %zu\n", name.c_str(), 1000 * quantile(errors, 0.5),
                1000 * quantile(errors, 1), errors.size());
  }
  std::printf("yaw error: median %.1f deg, 95 %% %.1f deg\n", 57.2958 * quantile(a.yaw_error_rad, 0.5),
              57.2958 * quantile(a.yaw_error_rad, 0.95));
  std::printf("cost of a pair of pictures: median %.2f ms, 95 %% %.2f ms\n", quantile(a.step_ms, 0.5),
              quantile(a.step_ms, 0.95));
  return 0;
}
