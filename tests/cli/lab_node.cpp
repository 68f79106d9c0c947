// A node with a message of its own (lab.idl): says each packet that it is sent again, else counts.

#include "lab_messages.h"
#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"

int main(int argc, char** argv) {
  using Packet = lab_msgs::msg::dds_::Packet_;
  return nido::node_main(argc, argv, "lab", [](nido::Node& node) -> nido::Status {
    auto in = node.open_input<Packet>("/lab/packet:i", nido::Profile::kEvent);
    if (!in) return in.error();
    auto out = node.open_output<Packet>("/lab/packet:o", nido::Profile::kEvent);
    if (!out) return out.error();
    const auto gain = node.live_parameter<double>("gain", 1.0, {"of every axis", "V", 0, 10, {}});
    if (!gain) return gain.error();
    node.set_ready();
    std::uint32_t number = 0;
    return node.run([&](nido::Time) -> nido::Status {
      if (auto packet = (*in)->take()) return (*out)->write(*packet);
      Packet packet;
      packet.number(++number);
      packet.samples().resize(1);
      packet.samples()[0].label("left");
      packet.samples()[0].axes({(*gain)->get(), 0, 0});
      packet.samples()[0].raw({1, -2});
      return (*out)->write(packet);
    });
  });
}
