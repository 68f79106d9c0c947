#pragma once

#include <future>

#include "nido/interfaces/camera.h"
#include "nido/simulator/faults.h"

namespace nido::sim {

// What a broken camera remembers. It is part of a simulation's state, so that a snapshot brings back the
// picture that a stuck eye shows; the pixels are those of the camera that owns the film.
struct Film {
  CameraFault fault = CameraFault::kNone;
  int taken = 0;  // pictures since the fault began
  int width = 0;  // of the picture that is shown; 0: none
  int height = 0;
  std::shared_future<Image> shown{};  // may still be on its way from the drawing thread
};

// The picture that a film shows, once it is drawn; null when there is none, or it could not be drawn.
[[nodiscard]] inline const Image* picture_on(const Film& film) {
  if (film.width == 0 || !film.shown.valid()) return nullptr;
  try {
    return &film.shown.get();
  } catch (const std::future_error&) {
    return nullptr;  // who was to draw it is gone
  }
}

}  // namespace nido::sim
