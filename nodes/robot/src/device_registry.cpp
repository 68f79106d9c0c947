#include "src/device_registry.h"

#include <fmt/format.h>

#include <iterator>

namespace nido {

const std::vector<DeviceKind>& device_kinds() {
  static const std::vector<DeviceKind> kinds = [] {
    std::vector<DeviceKind> all;
    for (auto family :
         {simulated_family(), fake_family(), audio_family(), yarp_family(), task_family(), joined_family()}) {
      std::move(family.begin(), family.end(), std::back_inserter(all));
    }
    return all;
  }();
  return kinds;
}

Result<MadeDevice> make_device(const std::string& kind, const YAML::Node& parameters,
                               DeviceContext& context) {
  for (const DeviceKind& known : device_kinds()) {
    if (known.name != kind) continue;
    const Result<YAML::Node> checked = check_document(parameters, known.parameters, context.file.string());
    if (!checked) return checked.error();
    return known.make(*checked, context);
  }
  return Error{ErrorCode::kInvalidArgument, fmt::format("there is no kind of device '{}'", kind)};
}

}  // namespace nido
