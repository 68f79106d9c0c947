#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "nido/simulator/devices/simulated_robot.h"
#include "nido/simulator/window/screen.h"

namespace nido::sim {

struct WindowOptions {
  int width = 960;  // pixels, at the start
  int height = 640;
  std::string title = "nido";
  RenderOptions rendering{};
  // Told, in a sentence, what the person does to the world: it belongs into the log.
  std::function<void(const std::string& sentence)> report{};
};

// Opens a screen on this computer's display. Its library is loaded here, so that a robot without a window
// does without it. kNotFound, with a sentence, when there is no display or no library.
[[nodiscard]] Result<std::unique_ptr<IScreen>> open_screen(const WindowOptions& options);

// The simulated world in a window, on a thread of its own, at most twenty pictures a second of wall time. It
// only looks: what the person does goes through the commands of the world port (force, pause, go, step), so a
// run in which nobody pulls at anything is the same with and without a window. Closing the window, or losing
// the display, ends the window and nothing else. Thread-safe.
class Window {
 public:
  using MakeScreen = std::function<Result<std::unique_ptr<IScreen>>(const WindowOptions&)>;
  // Fails as the screen does. The screen is made and used on the window's own thread.
  static Result<std::unique_ptr<Window>> open(std::shared_ptr<SimulatedRobot> robot, WindowOptions options,
                                              const MakeScreen& make_screen = &open_screen);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Pictures that were shown so far.
  [[nodiscard]] std::uint64_t shown() const { return shown_.load(); }
  // False when the person has closed it.
  [[nodiscard]] bool is_open() const { return is_open_.load(); }

 private:
  class Work;
  Window() = default;

  std::mutex mutex_;
  std::condition_variable ended_;
  bool ending_ = false;
  std::atomic<std::uint64_t> shown_{0};
  std::atomic<bool> is_open_{true};
  std::thread thread_;
};

}  // namespace nido::sim
