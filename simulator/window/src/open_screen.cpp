#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "nido/simulator/window/window.h"

namespace nido::sim {
namespace {

constexpr const char* kLibrary = "nido_screen.so";

// beside the program, or where an installation keeps it
std::filesystem::path find_library() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& path : {folder / kLibrary, folder / NIDO_SCREEN_FOLDER / kLibrary}) {
    if (std::filesystem::is_regular_file(path, error)) return path;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<IScreen>> open_screen(const WindowOptions& options) {
  const char* display = std::getenv("DISPLAY");
  if (display == nullptr || *display == '\0') {
    return Error{ErrorCode::kNotFound,
                 "there is no display for a window (DISPLAY is not set): leave out --window, or 'window: "
                 "true'; cameras need none"};
  }
  const std::filesystem::path path = find_library();
  if (path.empty())
    return Error{ErrorCode::kNotFound, std::string("the window's library ") + kLibrary +
                                           " is not beside the program: build nido whole, or install it"};
  // stays loaded: what it made is used to the end
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return Error{ErrorCode::kNotFound, std::string("no window: ") + dlerror()};
  auto* open = reinterpret_cast<decltype(&nido_open_screen)>(dlsym(library, "nido_open_screen"));
  if (open == nullptr) return Error{ErrorCode::kNotFound, std::string("no window: ") + dlerror()};
  std::string trouble;
  std::unique_ptr<IScreen> screen(open(options.width, options.height, options.title.c_str(), &trouble));
  if (!screen)
    return Error{ErrorCode::kNotFound,
                 std::string("there is no window on the display ") + display + ": " + trouble};
  return screen;
}

}  // namespace nido::sim
