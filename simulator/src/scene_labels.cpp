#include "nido/simulator/scene_labels.h"

#include <algorithm>

namespace nido::sim {

std::vector<std::string> scene_labels(const SceneSnapshot& scene) {
  std::vector<std::string> labels;
  for (const VisualInstance& instance : scene.instances) {
    // shapes of one thing stand in a row
    if (labels.empty() || labels.back() != instance.name) {
      if (std::find(labels.begin(), labels.end(), instance.name) == labels.end())
        labels.push_back(instance.name);
    }
  }
  return labels;
}

std::vector<std::uint16_t> instance_labels(const SceneSnapshot& scene) {
  const std::vector<std::string> labels = scene_labels(scene);
  std::vector<std::uint16_t> of;
  for (const VisualInstance& instance : scene.instances) {
    const auto found = std::find(labels.begin(), labels.end(), instance.name);
    of.push_back(static_cast<std::uint16_t>(found - labels.begin() + 1));
  }
  return of;
}

}  // namespace nido::sim
