// A window on an X11 display, through GLFW. Pictures are drawn by the cameras' renderer and only copied here:
// GLFW's own OpenGL would not get on with the off-screen one in the same process.
#include <memory>
#include <utility>

#include "nido/simulator/window/screen.h"
#include "paint.h"

// clang-format off: X11 makes macros of common words, so it comes last
#define GLFW_INCLUDE_NONE
#define GLFW_EXPOSE_NATIVE_X11
#include <GLFW/glfw3.h>
#include <GLFW/glfw3native.h>
#include <X11/Xutil.h>
// clang-format on

namespace nido::sim {
namespace {

// X11 calls both when the connection is lost; its own ones end the whole process.
int connection_lost(Display*) { return 0; }
void display_lost(Display*, void* lost) { *static_cast<bool*>(lost) = true; }

struct FreeImage {
  void operator()(XImage* image) const {
    image->data = nullptr;  // the pixels are the screen's
    XDestroyImage(image);
  }
};

// bits of a pixel that a colour's mask leaves below it
int shift_of(unsigned long mask) {
  int shift = 0;
  while (mask != 0 && (mask & 1U) == 0) {
    mask >>= 1U;
    ++shift;
  }
  return shift;
}

class GlfwScreen final : public IScreen {
 public:
  ~GlfwScreen() override {
    if (lost_) return;  // nothing can be told to a display that is gone
    if (gc_ != nullptr) XFreeGC(display_, gc_);
    if (window_ != nullptr) glfwDestroyWindow(window_);
    glfwTerminate();
  }

  bool open(int width, int height, const char* title, std::string& trouble) {
    const auto glfw_says = [&trouble] {
      const char* reason = nullptr;
      glfwGetError(&reason);
      trouble = reason == nullptr ? "GLFW does not say why" : reason;
      return false;
    };
    glfwInitHint(GLFW_JOYSTICK_HAT_BUTTONS, GLFW_FALSE);
    if (glfwInit() != GLFW_TRUE) return glfw_says();
    display_ = glfwGetX11Display();
    XSetIOErrorHandler(&connection_lost);
    XSetIOErrorExitHandler(display_, &display_lost, &lost_);
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    window_ = glfwCreateWindow(width, height, title, nullptr, nullptr);
    if (window_ == nullptr) return glfw_says();
    XWindowAttributes attributes;
    if (XGetWindowAttributes(display_, glfwGetX11Window(window_), &attributes) == 0 ||
        attributes.visual->c_class != TrueColor || attributes.depth < 24) {
      trouble = "the display has no true colours";
      return false;
    }
    visual_ = attributes.visual;
    depth_ = attributes.depth;
    gc_ = XCreateGC(display_, glfwGetX11Window(window_), 0, nullptr);
    glfwSetWindowUserPointer(window_, this);
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int button, int action, int) {
      InputEvent event =
          at_mouse(window, action == GLFW_PRESS ? InputEvent::Kind::kPress : InputEvent::Kind::kRelease);
      event.button = button == GLFW_MOUSE_BUTTON_LEFT    ? InputEvent::Button::kLeft
                     : button == GLFW_MOUSE_BUTTON_RIGHT ? InputEvent::Button::kRight
                                                         : InputEvent::Button::kMiddle;
      events_of(window).push_back(event);
    });
    glfwSetCursorPosCallback(window_, [](GLFWwindow* window, double, double) {
      events_of(window).push_back(at_mouse(window, InputEvent::Kind::kMove));
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* window, double, double notches) {
      InputEvent event = at_mouse(window, InputEvent::Kind::kScroll);
      event.scroll = notches;
      events_of(window).push_back(event);
    });
    glfwSetCharCallback(window_, [](GLFWwindow* window, unsigned code) {
      if (code >= 128) return;
      InputEvent event;
      event.kind = InputEvent::Kind::kKey;
      event.key = static_cast<char>(code >= 'A' && code <= 'Z' ? code - 'A' + 'a' : code);
      events_of(window).push_back(event);
    });
    return true;
  }

  int width() const override { return size().first; }
  int height() const override { return size().second; }
  bool closed() const override { return lost_ || glfwWindowShouldClose(window_) == GLFW_TRUE; }

  std::vector<InputEvent> poll() override {
    if (!lost_) glfwPollEvents();
    std::vector<InputEvent> taken;
    taken.swap(events_);
    return taken;
  }

  void show(Image& picture, const Overlay& overlay) override {
    if (lost_) return;
    paint(overlay, picture);
    const auto width = static_cast<unsigned>(picture.width);
    const auto height = static_cast<unsigned>(picture.height);
    const int red = shift_of(visual_->red_mask);
    const int green = shift_of(visual_->green_mask);
    const int blue = shift_of(visual_->blue_mask);
    pixels_.resize(static_cast<std::size_t>(width) * height);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const std::uint8_t* rgb = &picture.rgb[3 * i];
      pixels_[i] = static_cast<std::uint32_t>(rgb[0]) << red | static_cast<std::uint32_t>(rgb[1]) << green |
                   static_cast<std::uint32_t>(rgb[2]) << blue;
    }
    const std::unique_ptr<XImage, FreeImage> image(
        XCreateImage(display_, visual_, static_cast<unsigned>(depth_), ZPixmap, 0,
                     reinterpret_cast<char*>(pixels_.data()), width, height, 32, 0));
    if (!image) return;
    XPutImage(display_, glfwGetX11Window(window_), gc_, image.get(), 0, 0, 0, 0, width, height);
    XFlush(display_);
  }

 private:
  static std::vector<InputEvent>& events_of(GLFWwindow* window) {
    return static_cast<GlfwScreen*>(glfwGetWindowUserPointer(window))->events_;
  }
  static InputEvent at_mouse(GLFWwindow* window, InputEvent::Kind kind) {
    InputEvent event;
    event.kind = kind;
    glfwGetCursorPos(window, &event.x_px, &event.y_px);
    return event;
  }
  [[nodiscard]] std::pair<int, int> size() const {
    int width = 1;
    int height = 1;
    if (!lost_) glfwGetFramebufferSize(window_, &width, &height);
    if (lost_ || width < 1 || height < 1) return {1, 1};
    return {width, height};
  }

  GLFWwindow* window_ = nullptr;
  Display* display_ = nullptr;
  Visual* visual_ = nullptr;
  int depth_ = 24;
  GC gc_ = nullptr;
  bool lost_ = false;
  std::vector<InputEvent> events_;
  std::vector<std::uint32_t> pixels_;
};

}  // namespace
}  // namespace nido::sim

nido::sim::IScreen* nido_open_screen(int width, int height, const char* title, std::string* trouble) {
  auto screen = std::make_unique<nido::sim::GlfwScreen>();
  return screen->open(width, height, title, *trouble) ? screen.release() : nullptr;
}
