#include "nido/simulator/window/window.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <future>
#include <optional>
#include <utility>

#include "drawing.h"
#include "nido/simulator/devices/simulated_sensors.h"
#include "nido/simulator/render/renderer.h"
#include "nido/simulator/window/view_controller.h"

namespace nido::sim {
namespace {

using Wall = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kShortest{50};
// A pull that is not renewed ends after this simulated time: above rate 2 things are pulled in jerks.
constexpr double kPull_s = 0.1;

// The world port's frame: x left, y up, z forward.
Eigen::Vector3d to_port(const Eigen::Vector3d& v_World) { return {-v_World.y(), v_World.z(), -v_World.x()}; }

}  // namespace

// What the window's thread does.
class Window::Work {
 public:
  Work(std::shared_ptr<SimulatedRobot> robot, WindowOptions options, Renderer renderer,
       std::unique_ptr<IScreen> screen)
      : robot_(std::move(robot)),
        world_(robot_),
        options_(std::move(options)),
        renderer_(std::move(renderer)),
        screen_(std::move(screen)),
        controller_(screen_->width(), screen_->height()) {}

  // False: the person has closed the window.
  bool show_picture() {
    controller_.resize(screen_->width(), screen_->height());
    look();
    for (const InputEvent& event : screen_->poll())
      controller_.handle(event, [this](double x_px, double y_px) { return pick(x_px, y_px); });
    if (screen_->closed()) return false;
    for (const ViewController::Action action : controller_.take_actions()) {
      if (action == ViewController::Action::kClose) return false;
      act(action);
    }
    Overlay overlay;
    const Camera camera = controller_.camera();
    Drawing drawing(camera, overlay);
    pull(drawing);
    if (controller_.shows_contacts()) {
      drawing.contacts(contacts_);
      for (const Eigen::Vector3d& p_World_m : taxels_) drawing.taxel(p_World_m);
    }
    if (controller_.shows_joints()) drawing.joints(parts_, angles_rad_);
    if (controller_.shows_help()) drawing.help();
    drawing.status(fmt::format("{:.2f} s{}   h: help", time_s_, is_paused_ ? "   paused" : ""));
    if (const Status drawn = draw(camera); !drawn) {
      report("the window ends: " + drawn.error().message);
      return false;
    }
    screen_->show(picture_, overlay);
    return true;
  }

  // Nothing is pulled any more.
  void let_go() {
    if (pulled_.empty()) return;
    world_.command("world force \"" + pulled_ + "\" 0 0 0");
    report("window: lets go of " + pulled_);
    pulled_.clear();
  }

 private:
  void report(const std::string& sentence) const {
    if (options_.report) options_.report(sentence);
  }

  // Takes from the simulation what is to be seen; it waits no longer than this takes.
  void look() {
    const std::lock_guard lock(robot_->mutex());
    const Simulation& simulation = robot_->simulation();
    simulation.scene(scene_);
    time_s_ = static_cast<double>(robot_->now_ns()) * 1e-9;
    objects_ = simulation.objects();
    contacts_.clear();
    taxels_.clear();
    if (controller_.shows_contacts()) {
      contacts_ = simulation.contacts();
      for (std::size_t patch = 0; patch < simulation.skin().size(); ++patch) {
        if (simulation.skin_touch(patch).empty()) continue;
        const SkinPatch& skin = simulation.skin()[patch];
        const Result<Eigen::Isometry3d> X_WorldLink = simulation.X_WorldLink(skin.link);
        auto taxel = skin.taxels.begin();
        for (const TaxelForce& felt : simulation.skin_touch(patch)) {
          while (taxel != skin.taxels.end() && taxel->value != felt.value) ++taxel;
          if (taxel == skin.taxels.end()) break;
          if (X_WorldLink) taxels_.push_back(*X_WorldLink * taxel->p_Link_m);
        }
      }
    }
    angles_rad_.clear();
    if (controller_.shows_joints()) {
      if (parts_.empty()) parts_ = simulation.parts();
      for (std::size_t part = 0; part < parts_.size(); ++part) {
        std::vector<double>& angles = angles_rad_.emplace_back();
        for (const JointState& joint : simulation.joints(static_cast<int>(part)))
          angles.push_back(joint.position_rad);
      }
    }
  }

  Status draw(const Camera& camera) {
    if (const Status set = set_scene(); !set) return set;
    return renderer_.render(camera, picture_);
  }

  Status set_scene() {
    if (const Status set = renderer_.setScene(scene_); !set) return set;
    if (light_ && *light_ == scene_.light) return {};
    light_ = scene_.light;
    return renderer_.setLighting(scene_.light);
  }

  [[nodiscard]] const ObjectState* object(const std::string& name) const {
    for (const ObjectState& state : objects_) {
      if (state.name == name) return &state;
    }
    return nullptr;
  }

  // The thing under a pixel, if it can be moved.
  std::optional<ViewController::Pick> pick(double x_px, double y_px) {
    Camera camera = controller_.camera();
    if (!(x_px >= 0 && y_px >= 0 && x_px < camera.width && y_px < camera.height)) return std::nullopt;
    // a picture of that pixel alone
    camera.cx_px -= std::floor(x_px);
    camera.cy_px -= std::floor(y_px);
    camera.width = camera.height = 1;
    DepthImage depth;
    if (!set_scene() || !renderer_.renderDepth(camera, depth)) return std::nullopt;
    const std::uint32_t instance = depth.instance.front();
    if (instance == 0 || instance > scene_.instances.size()) return std::nullopt;
    const ObjectState* found = object(scene_.instances[instance - 1].name);
    if (found == nullptr || found->is_static) return std::nullopt;
    const double z_m = depth.z_m.front();
    const Eigen::Vector3d p_Camera_m((0.5 - camera.cx_px) / camera.fx_px * z_m,
                                     (0.5 - camera.cy_px) / camera.fy_px * z_m, z_m);
    return ViewController::Pick{found->name, camera.X_WorldCamera * p_Camera_m, found->X_WorldObject};
  }

  // Renews the pull, by the world port's own words.
  void pull(Drawing& drawing) {
    const std::optional<ViewController::Grab>& grab = controller_.grab();
    if (!grab || grab->object != pulled_) let_go();
    if (!grab) return;
    const ObjectState* state = object(grab->object);
    if (state == nullptr) {
      pulled_.clear();
      return controller_.let_go();
    }
    if (pulled_.empty()) report("window: pulls " + grab->object);
    pulled_ = grab->object;
    const Eigen::Vector3d p_World_m = state->X_WorldObject * grab->p_Object_m;
    const Eigen::Vector3d p_WorldMouse_m = controller_.p_WorldMouse_m();
    const Eigen::Vector3d force_N =
        spring_force_N(state->mass_kg, p_World_m, state->v_World_m_s, p_WorldMouse_m);
    const Eigen::Vector3d force_Port_N = to_port(force_N);
    world_.command(fmt::format("world force \"{}\" {:.6f} {:.6f} {:.6f} {}", pulled_, force_Port_N.x(),
                               force_Port_N.y(), force_Port_N.z(), kPull_s));
    drawing.pull(p_World_m, p_WorldMouse_m, force_N);
  }

  void act(ViewController::Action action) {
    const auto paused = [this] {
      return world_.command("world time").find("state=paused") != std::string::npos;
    };
    if (action == ViewController::Action::kStep) {
      world_.command("world step");
    } else {
      world_.command(paused() ? "world go" : "world pause");
    }
    is_paused_ = paused();
  }

  const std::shared_ptr<SimulatedRobot> robot_;
  SimulatedWorld world_;
  const WindowOptions options_;
  Renderer renderer_;
  const std::unique_ptr<IScreen> screen_;
  ViewController controller_;
  SceneSnapshot scene_;
  std::optional<Lighting> light_;
  Image picture_;
  double time_s_ = 0;
  bool is_paused_ = false;
  std::vector<ObjectState> objects_;
  std::vector<ContactPair> contacts_;
  std::vector<Eigen::Vector3d> taxels_;
  std::vector<PartInfo> parts_;
  std::vector<std::vector<double>> angles_rad_;
  std::string pulled_;  // what the world port was asked to push last; empty: nothing
};

Result<std::unique_ptr<Window>> Window::open(std::shared_ptr<SimulatedRobot> robot, WindowOptions options,
                                             const MakeScreen& make_screen) {
  std::unique_ptr<Window> window(new Window);
  std::promise<Status> opened;
  std::future<Status> is_open = opened.get_future();
  window->thread_ = std::thread([&window = *window, robot = std::move(robot), options = std::move(options),
                                 make_screen, opened = std::move(opened)]() mutable {
    Result<std::unique_ptr<IScreen>> screen = make_screen(options);
    if (!screen) return opened.set_value(screen.error());
    Result<Renderer> renderer = Renderer::create(options.rendering);
    if (!renderer) return opened.set_value(renderer.error());
    Work work(std::move(robot), std::move(options), std::move(*renderer), std::move(*screen));
    opened.set_value({});
    std::unique_lock lock(window.mutex_);
    while (!window.ending_) {
      lock.unlock();
      const Wall::time_point began = Wall::now();
      const bool goes_on = work.show_picture();
      if (goes_on) window.shown_.fetch_add(1);
      lock.lock();
      if (!goes_on) break;
      // half of the time is the simulation's, also on a slow computer
      const Wall::duration took = Wall::now() - began;
      window.ended_.wait_until(lock, std::max(began + kShortest, began + 2 * took),
                               [&window] { return window.ending_; });
    }
    lock.unlock();
    work.let_go();
    window.is_open_ = false;
  });
  if (const Status status = is_open.get(); !status) return status.error();
  return window;
}

Window::~Window() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ended_.notify_all();
  if (thread_.joinable()) thread_.join();
}

}  // namespace nido::sim
