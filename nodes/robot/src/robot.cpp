#include "src/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "nido/simulator/devices/simulated_robot.h"
#include "nido/simulator/window/window.h"
#include "nido/wrappers/servers.h"
#include "nido/wrappers/task_wrappers.h"
#include "nido/yarp/devices.h"
#include "src/body_server.h"
#include "src/depth_server.h"
#include "src/state_server.h"

namespace nido {
namespace {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};

}  // namespace

Robot::Robot(Node& node, std::int64_t start_ns) : node_(node), clock_(start_ns) {}

Robot::~Robot() = default;

Result<std::unique_ptr<Robot>> Robot::create(Node& node, const RobotFile& file, const RunSettings& run,
                                             std::int64_t start_ns) {
  std::unique_ptr<Robot> robot(new Robot(node, start_ns));
  robot->goes_on_ = run.goes_on;
  DeviceContext context{robot->clock_, file.path, run, file.simulation, nullptr, nullptr};
  context.board = [&robot](const std::string& name) { return robot->board(name); };
  if (Status made = robot->make_safety(file); !made) return made.error();
  for (const DeviceEntry& entry : file.devices) {
    if (Status added = robot->add_device(entry, file.safety, context); !added) return added.error();
  }
  robot->simulated_ = context.simulated;
  robot->yarp_network_ = context.yarp_network;
  if (robot->simulated_ && !file.simulated_time) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: devices of the family sim make their own time: say 'clock: simulated'",
                             file.path.string())};
  }
  if (robot->simulated_ && std::abs(file.period_s - sim::Simulation::kControlPeriod_s) > 1e-9) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: the simulator's control period is {} s, not {}", file.path.string(),
                             sim::Simulation::kControlPeriod_s, file.period_s)};
  }
  auto service =
      node.open_service("/" + file.robot + "/estop",
                        [safety = robot->safety_](const std::string& line) { return safety->reply(line); });
  if (!service) return service.error();
  robot->estop_service_ = std::move(*service);
  if (!file.safety.heartbeat_from.empty()) {
    auto heartbeat =
        Heartbeat::listen(node, robot->safety_, file.safety.heartbeat_from, file.safety.heartbeat_s);
    if (!heartbeat) return heartbeat.error();
    robot->heartbeat_ = std::move(*heartbeat);
  }
  for (const ServerEntry& entry : file.servers) {
    if (Status added = robot->add_server(entry); !added) return added.error();
  }
  if (!file.body.urdf.empty()) {
    std::vector<const IControlBoard*> boards;
    for (const Device& device : robot->devices_) {
      if (device.limited) boards.push_back(device.limited.get());
    }
    Result<RobotModel> model = RobotModel::load(file.path.parent_path() / file.body.urdf);
    if (!model) return model.error();
    auto frames = BodyFrames::create(std::move(*model), std::move(boards), robot->clock_);
    if (!frames) return frames.error();
    robot->frames_ = std::move(*frames);
    auto poses =
        serve_body(node, *robot->frames_, static_cast<std::int64_t>(std::llround(1e9 / file.body.rate_hz)));
    if (!poses) return poses.error();
    robot->servers_.push_back(std::move(*poses));
    auto asked = serve_frames(node, "/" + file.robot + "/frames", *robot->frames_);
    if (!asked) return asked.error();
    robot->servers_.push_back(std::move(*asked));
  }
  if (robot->simulated_) {
    auto state = serve_state_hash(node, "/" + file.robot + "/state_hash", *robot->simulated_);
    if (!state) return state.error();
    robot->servers_.push_back(std::move(*state));
  }
  return robot;
}

Status Robot::make_safety(const RobotFile& file) {
  SafetyOptions options;
  options.read_only = file.safety.read_only;
  options.action = file.safety.estop;
  options.heartbeat_s = file.safety.heartbeat_s;
  options.node = node_.options().name;
  options.report = [&node = node_](const std::string& sentence) { node.log_warning(sentence); };
  safety_ = std::make_shared<Safety>(std::move(options), clock_);
  if (file.safety.workspace.empty()) return {};
  if (file.body.urdf.empty()) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: safety.workspace needs to know the body: say 'body: {{urdf: icub.urdf}}'",
                             file.path.string())};
  }
  Result<RobotModel> model = RobotModel::load(file.path.parent_path() / file.body.urdf);
  if (!model) return model.error();
  Result<std::shared_ptr<Workspace>> workspace = Workspace::create(std::move(*model), file.safety.workspace);
  if (!workspace) {
    return Error{workspace.error().code,
                 fmt::format("{}: safety: {}", file.path.string(), workspace.error().message)};
  }
  workspace_ = std::move(*workspace);
  return {};
}

void Robot::tell_health() {
  const auto stopped = safety_->stopped();
  if (stopped == told_) return;
  told_ = stopped;
  if (stopped) {
    node_.set_failed(safety_->may_command().error().message);
  } else {
    node_.set_ready();
  }
}

IControlBoard* Robot::board(const std::string& name) const {
  for (const Device& device : devices_) {
    if (device.name == name) return device.limited.get();
  }
  return nullptr;
}

Status Robot::add_device(const DeviceEntry& entry, const SafetyEntry& safety, DeviceContext& context) {
  Result<MadeDevice> made = make_device(entry.kind, entry.parameters, context);
  if (!made)
    return Error{made.error().code, fmt::format("device '{}': {}", entry.name, made.error().message)};
  if (made->steppable != nullptr) steppables_.push_back(made->steppable);
  if (made->commander != nullptr) commanders_.push_back(made->commander);
  Device device{entry.name, std::move(made->device), nullptr};
  auto* board = std::get_if<std::unique_ptr<IControlBoard>>(&device.device);
  if (board != nullptr && !made->is_under_limits) {
    LimitOptions options;
    options.part = entry.name;
    options.safety = safety_;
    options.workspace = workspace_;
    if (safety.speed < 1 || safety.limits.contains(entry.name)) {
      Result<std::vector<JointLimits>> narrower = narrowed(**board, entry.name, safety);
      if (!narrower)
        return Error{narrower.error().code,
                     fmt::format("{}: {}", context.file.string(), narrower.error().message)};
      options.narrower = std::move(*narrower);
    }
    options.report = [&node = node_](const std::string& sentence) { node.log_debug(sentence); };
    options.warn = [&node = node_](const std::string& sentence) { node.log_warning(sentence); };
    Result<std::unique_ptr<LimitedControlBoard>> limited =
        LimitedControlBoard::create(**board, clock_, std::move(options));
    if (!limited) return limited.error();
    device.limited = std::move(*limited);
    for (const std::string& line : describe_limits(entry.name, *device.limited)) node_.log_debug(line);
  }
  if (safety.limits.contains(entry.name) && !device.limited) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: safety.limits: device '{}' is no control board with limits of its own",
                             context.file.string(), entry.name)};
  }
  devices_.push_back(std::move(device));
  return {};
}

Status Robot::add_server(const ServerEntry& entry) {
  const auto found = std::find_if(devices_.begin(), devices_.end(),
                                  [&](const Device& device) { return device.name == entry.device; });
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / entry.rate_hz));
  const std::string& port = entry.port;
  using Opened = Result<std::unique_ptr<IServer>>;
  Opened server = std::visit(
      Overloaded{
          [&](std::unique_ptr<IControlBoard>& board) -> Opened {
            return serve_control_board(node_, port, found->limited ? *found->limited : *board, period_ns);
          },
          [&](std::unique_ptr<ICamera>& camera) -> Opened {
            return serve_camera(node_, port, *camera,
                                {period_ns, static_cast<std::int64_t>(entry.latency_s * 1e9), entry.frame,
                                 entry.on_demand, !goes_on_});
          },
          [&](std::unique_ptr<IDepthCamera>& camera) -> Opened {
            return serve_depth(node_, port, *camera, period_ns, entry.frame);
          },
          [&](std::unique_ptr<ITouch>& touch) -> Opened {
            return serve_touch(node_, port, *touch, {period_ns, entry.frame, entry.on_demand});
          },
          [&](std::unique_ptr<IAudioGrabberSound>& audio) -> Opened {
            return serve_audio(node_, port, *audio, period_ns, entry.frame);
          },
          [&](std::unique_ptr<IAudioRender>& speaker) -> Opened {
            return serve_speaker(node_, port, *speaker);
          },
          [&](std::unique_ptr<ICartesianControl>& hand) -> Opened {
            return serve_cartesian(node_, port, *hand);
          },
          [&](std::unique_ptr<IGazeControl>& gaze) -> Opened { return serve_gaze(node_, port, *gaze); },
          [&](std::unique_ptr<IWorld>& world) -> Opened { return serve_world(node_, port, *world); },
          [&](std::unique_ptr<IForceTorque>& sensor) -> Opened {
            return serve_force_torque(node_, port, *sensor, period_ns, entry.frame);
          },
          [&](std::unique_ptr<IInertial>& sensor) -> Opened {
            return serve_inertial(node_, port, *sensor, period_ns, entry.frame);
          }},
      found->device);
  if (!server) return server.error();
  servers_.push_back(std::move(*server));
  return {};
}

Result<RobotSnapshot> Robot::snapshot() const {
  if (!simulated_) return Error{ErrorCode::kUnsupported, "only a simulated robot has snapshots"};
  RobotSnapshot made{clock_.now_ns(), {}, {}};
  {
    const std::lock_guard lock(simulated_->mutex());
    made.simulation = simulated_->simulation().snapshot();
  }
  for (const Device& device : devices_) {
    if (device.limited) made.boards.emplace(device.name, device.limited->memory());
  }
  return made;
}

Status Robot::go_on_from(const RobotSnapshot& snapshot, const std::string& source) {
  if (!simulated_) return Error{ErrorCode::kUnsupported, "only a simulated robot goes on from a snapshot"};
  if (Status restored = simulated_->restore(snapshot.simulation, source, snapshot.time_ns); !restored)
    return restored;
  for (const Device& device : devices_) {
    if (!device.limited) continue;
    const auto memory = snapshot.boards.find(device.name);
    if (memory == snapshot.boards.end()) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("{}: is a snapshot of another robot: it has no board '{}'", source, device.name)};
    }
    if (Status set = device.limited->set_memory(memory->second); !set) return set;
  }
  return {};
}

Status Robot::open_window() {
  if (!simulated_)
    return Error{ErrorCode::kInvalidArgument,
                 "a window shows a simulated world, and this robot has none: leave out --window"};
  sim::WindowOptions options;
  options.title = node_.options().name;
  options.report = [this](const std::string& sentence) { node_.log_info(sentence); };
  Result<std::unique_ptr<sim::Window>> window = sim::Window::open(simulated_, std::move(options));
  if (!window) return window.error();
  window_ = std::move(*window);
  return {};
}

void Robot::set_clock(std::function<std::string(const std::string&)> clock) {
  if (simulated_) simulated_->set_clock(std::move(clock));
}

std::int64_t Robot::wait_for_far_time(std::int64_t now_ns, std::int64_t period_ns,
                                      const std::function<void(const std::string&)>& log) {
  constexpr double kPatience_s = 0.5;
  constexpr std::int64_t kMostBehind_ns = 50'000'000;
  if (!is_following_) {
    yarp_network_->follow_time(now_ns);
    far_ns_ = now_ns;
  }
  is_following_ = true;
  const std::int64_t end_ns = now_ns + period_ns;
  for (;;) {
    const double patience_s = is_silent_ ? static_cast<double>(period_ns) * 1e-9 : kPatience_s;
    const std::int64_t before_ns = std::exchange(far_ns_, yarp_network_->wait_for_time(end_ns, patience_s));
    if (const bool silent = far_ns_ == before_ns && far_ns_ < end_ns; silent != is_silent_) {
      is_silent_ = silent;
      log(silent ? "nothing comes from the robot: time goes on by this computer's clock"
                 : "the robot is there: time is the robot's again");
    }
    if (far_ns_ >= end_ns || is_silent_) break;
  }
  return far_ns_ - end_ns > kMostBehind_ns ? now_ns + (far_ns_ - now_ns) / period_ns * period_ns : end_ns;
}

Status Robot::publish() {
  for (const std::unique_ptr<IServer>& server : servers_) {
    if (Status published = server->publish(clock_.now_ns()); !published) return published;
  }
  return {};
}

Status Robot::step_to(std::int64_t now_ns) {
  for (const std::unique_ptr<IServer>& server : servers_) {
    if (Status taken = server->take_commands(); !taken) return taken;
  }
  safety_->step_to(now_ns);
  tell_health();
  for (ISteppable* commander : commanders_) {
    if (Status commanded = commander->step_to(now_ns); !commanded) return commanded;
  }
  for (const Device& device : devices_) {
    if (!device.limited) continue;
    if (Status limited = device.limited->step_to(now_ns); !limited) {
      return Error{limited.error().code, fmt::format("{}: {}", device.name, limited.error().message)};
    }
  }
  if (simulated_) {
    if (Status stepped = simulated_->step_to(now_ns); !stepped) return stepped;
  }
  for (ISteppable* steppable : steppables_) {
    if (Status stepped = steppable->step_to(now_ns); !stepped) return stepped;
  }
  clock_.set_ns(now_ns);
  return publish();
}

}  // namespace nido
