#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/camera.h"

namespace nido::sim {

// What the person before the screen does. Pixels from the picture's top left corner, as in Camera.
struct InputEvent {
  enum class Kind { kPress, kRelease, kMove, kScroll, kKey };
  enum class Button { kLeft, kMiddle, kRight };
  Kind kind = Kind::kMove;
  Button button = Button::kLeft;  // of kPress and kRelease
  double x_px = 0;                // where the mouse is, but for kKey
  double y_px = 0;
  double scroll = 0;  // notches, away from the person above 0
  char key = 0;       // of kKey: a small letter, a space or a dot
};

// Lines, rings and words over a picture.
struct Overlay {
  using Colour = std::array<std::uint8_t, 3>;  // red, green, blue
  struct Line {
    double x0_px, y0_px, x1_px, y1_px;
    Colour colour;
    bool arrow = false;  // with a head at the second point
  };
  struct Ring {
    double x_px, y_px, radius_px;
    Colour colour;
    bool full = false;
  };
  struct Text {
    double x_px, y_px;  // left end of the base line
    std::string words;  // ASCII
    Colour colour;
  };
  // A dark pane under words.
  struct Pane {
    double x_px, y_px, width_px, height_px;
  };
  std::vector<Pane> panes{};
  std::vector<Line> lines{};
  std::vector<Ring> rings{};
  std::vector<Text> texts{};
};

// Where pictures are shown and events come from. Used by one thread.
class IScreen {
 public:
  virtual ~IScreen() = default;
  // Size of the picture that fits; at least 1.
  [[nodiscard]] virtual int width() const = 0;
  [[nodiscard]] virtual int height() const = 0;
  // What happened since the last call, in its order.
  virtual std::vector<InputEvent> poll() = 0;
  // The person closed it, or the display is gone; it stays so.
  [[nodiscard]] virtual bool closed() const = 0;
  // Paints the overlay onto the picture and shows it.
  virtual void show(Image& picture, const Overlay& overlay) = 0;
};

}  // namespace nido::sim

// The one function of the library nido_screen.so, which is loaded when a window is asked for: a screen, to be
// deleted by the caller; null, and why in `trouble`, without a display.
extern "C" nido::sim::IScreen* nido_open_screen(int width, int height, const char* title,
                                                std::string* trouble);
