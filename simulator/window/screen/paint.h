#pragma once

#include "nido/simulator/window/screen.h"

namespace nido::sim {

// Paints lines, rings and words onto a picture; what lies outside is cut off.
void paint(const Overlay& overlay, Image& picture);

}  // namespace nido::sim
