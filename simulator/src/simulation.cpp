#include "nido/simulator/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "ode_library.h"
#include "robot_base.h"
#include "simulation_impl.h"

namespace nido::sim {

SavedState::SavedState() : data_(std::make_unique<Data>()) {}
SavedState::~SavedState() = default;
SavedState::SavedState(const SavedState& other) : data_(std::make_unique<Data>(*other.data_)) {}
SavedState::SavedState(SavedState&& other) noexcept = default;
SavedState& SavedState::operator=(const SavedState& other) {
  if (this != &other) data_ = std::make_unique<Data>(*other.data_);
  return *this;
}
SavedState& SavedState::operator=(SavedState&& other) noexcept = default;

bool HoldQuery::held() const {
  const auto any = [](const std::array<bool, kPadCount>& pads) {
    return std::any_of(pads.begin(), pads.end(), [](bool on) { return on; });
  };
  return (any(left) || any(right)) && !world;
}

int Simulation::Impl::find_object(std::string_view name) const {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i]->description().name == name) return static_cast<int>(i);
  }
  return -1;
}

void Simulation::Impl::build_objects() {
  // what the start has was tried when it was read
  (void)replace_objects(start.objects, start.joints);
}

Status Simulation::Impl::replace_objects(const std::vector<ObjectDescription>& wanted,
                                         const std::vector<ObjectJointDescription>& wanted_joints) {
  std::vector<std::unique_ptr<ObjectBody>> made;
  for (const ObjectDescription& description : wanted)
    made.push_back(std::make_unique<ObjectBody>(world.id(), description));
  std::vector<ObjectJoint> made_joints;
  for (const ObjectJointDescription& description : wanted_joints) {
    Result<ObjectJoint> joint = make_joint(description, made);
    if (!joint) return joint.error();
    made_joints.push_back(*joint);
  }
  contacts->forget();
  objects = std::move(made);
  joints = std::move(made_joints);
  ++revision;
  object_set = ++last_object_set;
  return {};
}

void Simulation::Impl::erase_object(std::size_t index) {
  objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(index));
  forget_object(joints, static_cast<int>(index));
}

bool Simulation::Impl::is_inside(std::size_t object, std::size_t basket) const {
  const ObjectBody& thing = *objects[object];
  const ObjectBody& box = *objects[basket];
  const Eigen::AlignedBox3d inner = bounds(box.description());
  const Eigen::AlignedBox3d outer = bounds(thing.description());
  // middle of the thing in the basket's frame
  const Eigen::Vector3d p = box.X_WorldObject().inverse() * (thing.X_WorldObject() * outer.center());
  const double height = outer.sizes().maxCoeff();
  return p.x() > inner.min().x() && p.x() < inner.max().x() && p.y() > inner.min().y() &&
         p.y() < inner.max().y() && p.z() > inner.min().z() && p.z() < inner.max().z() + height / 2;
}

void Simulation::Impl::wake_all() {
  for (auto& object : objects) object->wake();
}

void Simulation::Impl::rest_still_limbs() {
  for (std::size_t limb = 0; limb < robot->tree().limb_count(); ++limb) {
    const auto [first, end] = robot->tree().limb(limb);
    bool still = true;
    for (std::size_t link = first; link < end && still; ++link) still = drives->still(link, *robot);
    if (still) {
      robot->rest(limb);
    } else {
      robot->wake(first);
    }
  }
}

Status Simulation::Impl::check_finite() const {
  const auto sane = [](dBodyID body) {
    const dReal* p = dBodyGetPosition(body);
    const dReal* v = dBodyGetLinearVel(body);
    const dReal* w = dBodyGetAngularVel(body);
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += std::abs(p[i]) + 1e-3 * std::abs(v[i]) + 1e-3 * std::abs(w[i]);
    return std::isfinite(sum) && sum < 1e4;
  };
  for (std::size_t i = 1; i < robot->link_count(); ++i) {
    if (!sane(robot->bodies()[i])) {
      return Error{ErrorCode::kFailed,
                   "the physics lost the robot's link " + robot->description().links[i].name + " at " +
                       std::to_string(static_cast<double>(period) * kControlPeriod_s) + " s"};
    }
  }
  for (const auto& object : objects) {
    if (object->body() != nullptr && !sane(object->body())) {
      return Error{ErrorCode::kFailed, "the physics lost the object " + object->description().name + " at " +
                                           std::to_string(static_cast<double>(period) * kControlPeriod_s) +
                                           " s"};
    }
  }
  return {};
}

Eigen::Vector3d Simulation::Impl::velocity_of(const RobotBody::Frame& frame) const {
  if (frame.link <= 0) return Eigen::Vector3d::Zero();
  dBodyID body = robot->bodies()[static_cast<std::size_t>(frame.link)];
  const Eigen::Vector3d lever = pose(frame).translation() - to_eigen(dBodyGetPosition(body));
  return to_eigen(dBodyGetLinearVel(body)) + to_eigen(dBodyGetAngularVel(body)).cross(lever);
}

Simulation::Simulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Simulation::~Simulation() {
  // bodies go before their world
  prepare_ode();
  impl_->objects.clear();
  impl_->contacts.reset();
  impl_->drives.reset();
  impl_->robot.reset();
}

Result<std::unique_ptr<Simulation>> Simulation::create(const SimulationOptions& options) {
  prepare_ode();
  const double steps = kControlPeriod_s / options.physics_step_s;
  if (!(options.physics_step_s > 0) || std::abs(steps - std::round(steps)) > 1e-6 || std::round(steps) < 1) {
    return Error{ErrorCode::kInvalidArgument, "the physics step must divide the control period of 10 ms"};
  }
  if (options.solver_iterations < 20 || options.solver_iterations > 1000) {
    return Error{ErrorCode::kInvalidArgument,
                 "solver_iterations must be 20 to 1000; with fewer what touches is not told apart well"};
  }
  auto description = read_robot(options.urdf_path);
  if (!description) return description.error();
  auto model = RobotModel::load(options.urdf_path);
  if (!model) return model.error();
  auto skin = read_skin(*model, options.urdf_path);
  if (!skin) return skin.error();
  auto world = read_world_with_base(options, *description);
  if (!world) return world.error();
  if (options.base == Base::kFree) {
    if (!(description->links[0].mass.mass_kg > 0)) {
      return Error{ErrorCode::kInvalidArgument, options.urdf_path.string() +
                                                    ": a robot whose base is free needs a root with a mass: "
                                                    "give the root link an <inertial>"};
    }
    free_base(*description);
  }

  try {
    auto impl = std::make_unique<Impl>();
    impl->options = options;
    impl->block = read_control_block(*model);
    impl->start = std::move(*world);
    if (impl->start.light) impl->options.light = *impl->start.light;
    impl->light = impl->options.light;
    impl->robot = std::make_unique<RobotBody>(impl->world.id(), std::move(*description));
    auto drives = Drives::create(*impl->robot, impl->block);
    if (!drives)
      return Error{drives.error().code, options.urdf_path.string() + ": " + drives.error().message};
    impl->drives = std::make_unique<Drives>(std::move(*drives));
    for (const auto& [part, angles] : impl->start.posture_rad) {
      int index = -1;
      for (std::size_t p = 0; p < impl->drives->parts().size(); ++p) {
        if (impl->drives->parts()[p].name == part) index = static_cast<int>(p);
      }
      if (Status fits = impl->drives->set_home(index, angles); !fits) {
        return Error{fits.error().code,
                     options.world_path.string() + ": posture_deg: " + fits.error().message};
      }
    }
    impl->contacts = std::make_unique<Contacts>(*impl->robot, impl->block, std::move(*skin));
    const auto& links = impl->robot->description().links;
    for (const LinkDescription& link : links) {
      for (const NamedFrame& frame : link.frames) impl->link_names.push_back(frame.name);
    }
    for (std::size_t eye = 0; eye < 2; ++eye)
      impl->cameras[eye] = impl->robot->find_frame(impl->block.camera_links[eye]);
    impl->limb_forces = std::make_unique<LimbForces>(*impl->robot, impl->block);
    impl->inertial = impl->robot->find_frame(impl->block.inertial_link);
    impl->drives->go_home(*impl->robot);
    if (impl->robot->is_free() && impl->contacts->robot_shape_count() > 0) {
      // on its feet, in whatever posture
      impl->robot->set_base_height(kFloorHeight_m - impl->contacts->lowest_m());
      impl->drives->go_home(*impl->robot);
    }
    if (options.self_collision) impl->contacts->begin_self_collision();
    if (Status built = impl->replace_objects(impl->start.objects, impl->start.joints); !built)
      return Error{built.error().code, options.world_path.string() + ": joints: " + built.error().message};
    auto simulation = std::unique_ptr<Simulation>(new Simulation(std::move(impl)));
    simulation->impl_->drives->measure(*simulation->impl_->robot);
    simulation->impl_->limb_forces->restart(*simulation->impl_->robot);
    return simulation;
  } catch (const OdeError& e) {
    return Error{ErrorCode::kFailed, e.what()};
  }
}

double Simulation::time_s() const { return static_cast<double>(impl_->period) * kControlPeriod_s; }

std::int64_t Simulation::time_ns() const { return impl_->period * 10'000'000; }

std::uint64_t Simulation::moment() const { return impl_->moment; }

Status Simulation::step(double duration_s) {
  if (!std::isfinite(duration_s) || duration_s < 0 || duration_s > 1e5) {
    return Error{ErrorCode::kInvalidArgument,
                 "a simulation steps forward by a finite time of at most 100000 s"};
  }
  Impl& s = *impl_;
  if (!s.failure.empty()) return Error{ErrorCode::kFailed, s.failure};
  prepare_ode();
  const auto periods = std::max<std::int64_t>(1, std::llround(duration_s / kControlPeriod_s));
  const int steps = static_cast<int>(std::lround(kControlPeriod_s / s.options.physics_step_s));
  try {
    for (std::int64_t p = 0; p < periods; ++p) {
      s.drives->begin_period(kControlPeriod_s, *s.robot);
      s.rest_still_limbs();
      s.contacts->begin_period();
      for (int i = 0; i < steps; ++i) {
        s.drives->drive((i + 1.0) / steps, *s.robot);
        s.contacts->find(s.objects, s.joints, s.options.physics_step_s);
        make_ties(s.joints, s.objects, s.ties);
        for (auto& object : s.objects) object->apply_push(s.options.physics_step_s);
        s.free_bodies.clear();
        for (const auto& object : s.objects) s.free_bodies.push_back(object->body());
        s.solver.step(*s.robot, s.free_bodies, s.contacts->found(), s.ties, s.options.physics_step_s,
                      s.options.solver_iterations);
        s.contacts->read_forces();
        read_ties(s.ties, s.joints);
        s.drives->accumulate(*s.robot);
      }
      s.contacts->end_period();
      ++s.period;
      ++s.moment;
      if (Status sane = s.check_finite(); !sane) {
        s.failure = sane.error().message;
        return sane;
      }
      s.drives->measure(*s.robot);
      s.limb_forces->measure(*s.robot, *s.contacts, kControlPeriod_s);
      s.head_velocity[1] = s.head_velocity[0];
      s.head_velocity[0] = s.velocity_of(s.inertial);
    }
  } catch (const OdeError& e) {
    s.failure = e.what();
    return Error{ErrorCode::kFailed, s.failure};
  }
  return {};
}

void Simulation::reset() {
  prepare_ode();
  impl_->reset();
}

void Simulation::Impl::reset() {
  Impl& s = *this;
  s.failure.clear();
  s.period = 0;
  s.moment = 0;
  s.head_velocity.fill(Eigen::Vector3d::Zero());
  s.contacts->restart();
  s.camera_fault.fill(CameraFault::kNone);
  s.films.clear();
  s.light = s.options.light;
  s.drives->go_home(*s.robot);
  s.drives->measure(*s.robot);
  s.limb_forces->restart(*s.robot);
  s.build_objects();
}

SavedState Simulation::save() const {
  SavedState saved;
  *saved.data_ = {impl_.get(), impl_->object_set, impl_->state()};
  return saved;
}

Status Simulation::restore(const SavedState& saved) {
  if (!saved.data_ || saved.data_->owner != impl_.get()) {
    return Error{ErrorCode::kInvalidArgument, "a saved state belongs to the simulation that saved it"};
  }
  if (saved.data_->object_set != impl_->object_set) {
    return Error{ErrorCode::kInvalidArgument, "objects were made or deleted since the state was saved"};
  }
  prepare_ode();
  impl_->set_state(saved.data_->state);
  return {};
}

Film& Simulation::film(std::size_t camera) {
  if (impl_->films.size() <= camera) impl_->films.resize(camera + 1);
  return impl_->films[camera];
}

std::uint64_t Simulation::complete_hash() const { return hash_of(impl_->snapshot()); }

std::string Simulation::snapshot() const { return snapshot_text(impl_->snapshot(), impl_->state_shape()); }

Status Simulation::restore_snapshot(const std::string& text, const std::string& source) {
  Result<WorldSnapshot> read = read_snapshot(text, impl_->state_shape(), source);
  if (!read) return read.error();
  prepare_ode();
  read->object_set = ++impl_->last_object_set;
  impl_->restore(*read);
  return {};
}

SimulationState Simulation::Impl::state() const {
  SimulationState state;
  state.period = period;
  state.moment = moment;
  state.robot = robot->save();
  for (const auto& object : objects) state.objects.push_back(object->motion());
  state.drives = drives->save();
  state.contacts = contacts->save();
  state.head_velocity = head_velocity;
  state.limb_forces = limb_forces->save();
  state.camera_fault = camera_fault;
  state.films = films;
  state.light = light;
  state.joints = joints;
  return state;
}

void Simulation::Impl::set_state(const SimulationState& state) {
  robot->restore(state.robot);
  for (std::size_t i = 0; i < objects.size(); ++i) objects[i]->set_motion(state.objects[i]);
  drives->restore(state.drives);
  contacts->restore(state.contacts);
  period = state.period;
  moment = state.moment;
  head_velocity = state.head_velocity;
  limb_forces->restore(state.limb_forces);
  camera_fault = state.camera_fault;
  films = state.films;
  light = state.light;
  joints = state.joints;
  failure.clear();
}

StateShape Simulation::Impl::state_shape() const {
  StateShape shape;
  const auto& links = robot->description().links;
  for (std::size_t i = 1; i < links.size(); ++i) shape.hinges.push_back(links[i].joint_name);
  for (const PartInfo& part : drives->parts()) shape.joints += part.joints.size();
  for (const SkinPatch& patch : contacts->skin().patches()) shape.skin_values.push_back(patch.values);
  shape.sensors = block.force_torque.size();
  for (std::size_t i = 0; i < contacts->robot_shape_count(); ++i)
    shape.shape_links.push_back(contacts->link_of_shape(i));
  return shape;
}

WorldSnapshot Simulation::Impl::snapshot() const {
  WorldSnapshot made{object_set, {}, state()};
  for (const auto& object : objects) made.objects.push_back(object->description());
  return made;
}

void Simulation::Impl::restore(const WorldSnapshot& snapshot) {
  // the objects as they were, also what has been renamed, recoloured or deleted since
  std::vector<std::unique_ptr<ObjectBody>> made;
  for (const ObjectDescription& description : snapshot.objects) {
    made.push_back(std::make_unique<ObjectBody>(world.id(), description));
  }
  contacts->forget();
  objects = std::move(made);
  object_set = snapshot.object_set;
  ++revision;
  set_state(snapshot.state);
}

const std::vector<PartInfo>& Simulation::parts() const { return impl_->drives->parts(); }

int Simulation::part_index(std::string_view name) const {
  const auto& all = parts();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::span<const JointState> Simulation::joints(int part) const { return impl_->drives->joints(part); }

Status Simulation::command(int part, JointMode mode, std::span<const int> joints,
                           std::span<const double> values) {
  return impl_->drives->command(part, mode, joints, values);
}

Status Simulation::command_all(int part, JointMode mode, std::span<const double> values) {
  std::vector<int> all(values.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  if (part >= 0 && part < static_cast<int>(parts().size()) &&
      values.size() != parts()[static_cast<std::size_t>(part)].joints.size()) {
    const PartInfo& info = parts()[static_cast<std::size_t>(part)];
    return Error{ErrorCode::kInvalidArgument, info.name + " has " + std::to_string(info.joints.size()) +
                                                  " joints, not " + std::to_string(values.size())};
  }
  return impl_->drives->command(part, mode, all, values);
}

Status Simulation::set_reference_speed(int part, int joint, double speed_rad_s) {
  return impl_->drives->set_reference_speed(part, joint, speed_rad_s);
}

Status Simulation::set_servo_gain(int part, int joint, double gain_1_s) {
  return impl_->drives->set_servo_gain(part, joint, gain_1_s);
}

Status Simulation::stop(int part, int joint) { return impl_->drives->stop(part, joint); }

Status Simulation::place_joints(int part, std::span<const double> position_rad) {
  return impl_->drives->place(part, position_rad, *impl_->robot);
}

const HandTouch& Simulation::touch(Hand hand) const { return impl_->contacts->touch(hand); }

const std::vector<SkinPatch>& Simulation::skin() const { return impl_->contacts->skin().patches(); }

const std::vector<TaxelForce>& Simulation::skin_touch(std::size_t patch) const {
  return impl_->contacts->skin().touch(patch);
}

bool Simulation::has_hand(Hand hand) const {
  return !impl_->block.hands[hand == Hand::kLeft ? 0 : 1].frame.empty();
}

bool Simulation::has_eye(Eye eye) const { return impl_->cameras[eye == Eye::kLeft ? 0 : 1].link >= 0; }

Eigen::Isometry3d Simulation::X_WorldCamera(Eye eye) const {
  if (!has_eye(eye)) return impl_->robot->X_WorldLink(0);
  return impl_->pose(impl_->cameras[eye == Eye::kLeft ? 0 : 1]);
}

CameraFault Simulation::camera_fault(Eye eye) const { return impl_->camera_fault[eye == Eye::kLeft ? 0 : 1]; }

Simulation::Inertial Simulation::inertial() const {
  const Impl& s = *impl_;
  Inertial out;
  if (s.inertial.link < 0) return out;
  const Eigen::Isometry3d X = s.pose(s.inertial);
  const Eigen::Matrix3d R_SensorWorld = X.linear().transpose();
  out.q_WorldSensor = Eigen::Quaterniond(X.linear());
  const Eigen::Vector3d acceleration = (s.head_velocity[0] - s.head_velocity[1]) / kControlPeriod_s;
  out.acceleration_m_s2 = R_SensorWorld * (acceleration + Eigen::Vector3d(0, 0, 9.81));
  if (s.inertial.link > 0) {
    out.angular_velocity_rad_s =
        R_SensorWorld *
        to_eigen(dBodyGetAngularVel(s.robot->bodies()[static_cast<std::size_t>(s.inertial.link)]));
  }
  return out;
}

Result<Simulation::Wrench> Simulation::force_torque(std::string_view limb) const {
  const Impl& s = *impl_;
  for (std::size_t i = 0; i < s.block.force_torque.size(); ++i) {
    if (s.block.force_torque[i].first == limb) return s.limb_forces->wrench(i);
  }
  return Error{ErrorCode::kNotFound, "no limb \"" + std::string(limb) + "\" has a force/torque sensor"};
}

const std::vector<std::string>& Simulation::link_names() const { return impl_->link_names; }

Result<Eigen::Isometry3d> Simulation::X_WorldLink(std::string_view link) const {
  const RobotBody::Frame frame = impl_->robot->find_frame(link);
  if (frame.link < 0)
    return Error{ErrorCode::kNotFound, "the robot has no link \"" + std::string(link) + "\""};
  return impl_->pose(frame);
}

std::vector<ObjectState> Simulation::objects() const {
  std::vector<ObjectState> states;
  for (const auto& object : impl_->objects) states.push_back(object->state());
  return states;
}

Result<ObjectState> Simulation::object(std::string_view name) const {
  const int index = impl_->find_object(name);
  if (index < 0) return Error{ErrorCode::kNotFound, "the world has no object \"" + std::string(name) + "\""};
  return impl_->objects[static_cast<std::size_t>(index)]->state();
}

std::vector<ContactPair> Simulation::contacts() const { return impl_->contacts->pairs(impl_->objects); }

Result<HoldQuery> Simulation::hold(std::string_view object) const {
  const int index = impl_->find_object(object);
  if (index < 0)
    return Error{ErrorCode::kNotFound, "the world has no object \"" + std::string(object) + "\""};
  return impl_->contacts->hold(static_cast<std::size_t>(index), impl_->objects);
}

Result<bool> Simulation::is_inside(std::string_view object, std::string_view basket) const {
  for (const std::string_view name : {object, basket}) {
    if (impl_->find_object(name) < 0) {
      return Error{ErrorCode::kNotFound, "the world has no object \"" + std::string(name) + "\""};
    }
  }
  return impl_->is_inside(static_cast<std::size_t>(impl_->find_object(object)),
                          static_cast<std::size_t>(impl_->find_object(basket)));
}

void Simulation::scene(SceneSnapshot& out) const { impl_->scene(out); }

void Simulation::Impl::scene(SceneSnapshot& out) const {
  const Impl& s = *this;
  const bool same = out.revision == s.revision && !out.instances.empty();
  std::size_t next = 0;
  const auto put = [&](const std::string& name, const VisualShape& shape, const Eigen::Isometry3d& X) {
    if (!same) {
      out.instances.push_back({name, shape, X});
    } else {
      out.instances[next].X_WorldShape = X;
    }
    ++next;
  };
  if (!same) out.instances.clear();
  out.revision = s.revision;
  out.light = s.light;
  for (std::size_t i = 0; i < s.robot->link_count(); ++i) {
    const Eigen::Isometry3d X_WorldLink = s.robot->X_WorldLink(i);
    for (const LinkShape& visual : s.robot->description().links[i].visuals) {
      put(visual.urdf_link, visual.placed.shape, X_WorldLink * visual.placed.X_OwnerShape);
    }
  }
  for (const auto& object : s.objects) {
    const Eigen::Isometry3d X_WorldObject = object->X_WorldObject();
    for (const PlacedShape& shape : object->description().shapes) {
      put(object->description().name, shape.shape, X_WorldObject * shape.X_OwnerShape);
    }
  }
}

std::uint64_t Simulation::state_hash() const {
  const Impl& s = *impl_;
  std::uint64_t hash = 1469598103934665603ULL;
  const auto add = [&hash](const dReal* values, int count) {
    for (int i = 0; i < count; ++i) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &values[i], sizeof bits);
      hash = (hash ^ bits) * 1099511628211ULL;
      hash ^= hash >> 29U;
    }
  };
  const auto add_body = [&add](dBodyID body) {
    add(dBodyGetPosition(body), 3);
    add(dBodyGetQuaternion(body), 4);
    add(dBodyGetLinearVel(body), 3);
    add(dBodyGetAngularVel(body), 3);
  };
  for (std::size_t i = 1; i < s.robot->link_count(); ++i) add_body(s.robot->bodies()[i]);
  for (const auto& object : s.objects) {
    if (object->body() != nullptr) add_body(object->body());
  }
  for (const AxisState& axis : s.drives->axes()) {
    const std::array<dReal, 6> drive = {axis.measured.target,        axis.measured.reference_speed_rad_s,
                                        axis.measured.torque_Nm,     axis.reference_rad,
                                        axis.previous_reference_rad, static_cast<dReal>(axis.measured.mode)};
    add(drive.data(), static_cast<int>(drive.size()));
  }
  for (const Hand hand : {Hand::kLeft, Hand::kRight})
    add(s.contacts->touch(hand).force_N.data(), static_cast<int>(kPadCount));
  for (const std::vector<TaxelForce>& patch : s.contacts->skin().save().touch) {
    for (const TaxelForce& taxel : patch) add(&taxel.force_N, 1);
  }
  return hash;
}

std::string Simulation::world(const std::string& line, std::string* clock_request) {
  prepare_ode();
  if (clock_request != nullptr) clock_request->clear();
  impl_->clock_request = clock_request;
  std::string reply = run_world_command(*impl_, line);
  impl_->clock_request = nullptr;
  return reply;
}

}  // namespace nido::sim
