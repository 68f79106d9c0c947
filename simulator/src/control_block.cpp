#include "control_block.h"

namespace nido::sim {

ControlBlock read_control_block(const RobotModel& model) {
  ControlBlock block;
  for (const Part& part : model.parts()) {
    PartBlock own{part.name, {}};
    for (const Axis& axis : part.axes) {
      AxisBlock joint;
      joint.info = {axis.name,           axis.lower_rad, axis.upper_rad,
                    axis.velocity_rad_s, axis.effort_Nm, axis.reference_speed_rad_s};
      joint.home_rad = axis.home_rad;
      for (const nido::HingeShare& share : axis.hinges) {
        joint.hinges.push_back(
            {model.hinges()[static_cast<std::size_t>(share.hinge)].name, share.multiplier, share.offset_rad});
      }
      own.axes.push_back(std::move(joint));
    }
    block.parts.push_back(std::move(own));
  }
  const auto link_name = [&](int index) {
    return index < 0 ? std::string() : model.links()[static_cast<std::size_t>(index)].name;
  };
  static constexpr std::array<const char*, 2> kSides = {"left", "right"};
  for (std::size_t s = 0; s < kSides.size(); ++s) {
    if (const auto hand = model.hand(kSides[s])) {
      block.hands[s].frame = link_name(hand->frame);
      for (std::size_t p = 0; p < block.hands[s].pads.size() && p < hand->pads.size(); ++p) {
        block.hands[s].pads[p] = link_name(hand->pads[p].body_link);
      }
    }
    if (const auto camera = model.camera_link(kSides[s])) block.camera_links[s] = link_name(*camera);
  }
  block.inertial_link = link_name(model.inertial_link());
  for (const ForceTorqueInfo& sensor : model.force_torque_sensors()) {
    block.force_torque.emplace_back(sensor.limb, model.hinges()[static_cast<std::size_t>(sensor.hinge)].name);
  }
  return block;
}

}  // namespace nido::sim
