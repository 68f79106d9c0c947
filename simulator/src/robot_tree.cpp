#include "robot_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nido::sim {
namespace {

// A motor with its gear adds inertia about the hinge that a list of link masses does not show. Without it,
// finger segments of a few grams would be moved by the least force.
constexpr double kRotorInertia_kgm2 = 2e-5;
constexpr double kLeastMass_kg = 0.02;
// A third of half a degree: some joints are the sum of three hinges.
constexpr double kGearPlay_rad = 0.0029;

Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& turn_rad) {
  const double angle = turn_rad.norm();
  if (angle < 1e-12) return Eigen::Quaterniond(1, turn_rad.x() / 2, turn_rad.y() / 2, turn_rad.z() / 2);
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn_rad / angle));
}

// The shortest one.
Eigen::Vector3d to_rotation_vector(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * sign * q.vec();
  return 2 * sign * std::atan2(sine, sign * q.w()) / sine * q.vec();
}

}  // namespace

RobotTree::RobotTree(const RobotDescription& description) {
  const std::size_t count = description.links.size();
  links_.resize(count);
  least_rad_.assign(count, 0);
  most_rad_.assign(count, 0);
  for (std::size_t i = 1; i < count; ++i) {
    const LinkDescription& from = description.links[i];
    Link& link = links_[i];
    link.freedom = from.freedom;
    link.parent = from.parent;
    if (from.parent == 0) limbs_.emplace_back(i, i);
    link.limb = limbs_.size() - 1;
    limbs_.back().second = i + 1;
    link.path = links_[static_cast<std::size_t>(from.parent)].path;
    link.depth = link.path.size();
    link.path.push_back(static_cast<int>(i));
    stride_ = std::max(stride_, link.path.size());
    link.q_ParentLink = Eigen::Quaterniond(from.X_ParentLink.linear());
    link.p_ParentLink = from.X_ParentLink.translation();
    link.axis_Link = from.axis_Link;
    least_rad_[i] = from.min_rad - kGearPlay_rad;
    most_rad_[i] = from.max_rad + kGearPlay_rad;
    link.com_Link = from.mass.center_m;
    if (link.freedom != Freedom::kHinge) {  // no rotor, and only the last of them has a mass
      link.mass = from.mass.mass_kg;
      link.inertia_Com = from.mass.inertia_kgm2;
      continue;
    }
    link.mass = std::max(from.mass.mass_kg, kLeastMass_kg);
    link.inertia_Com = from.mass.inertia_kgm2 * (link.mass / from.mass.mass_kg) +
                       kRotorInertia_kgm2 * Eigen::Matrix3d::Identity();
  }
  if (count > kBaseDegrees && links_[kBaseDegrees].freedom == Freedom::kBaseTurn) {
    // what small links are heavier here than they are, the root is lighter: the robot falls as its weight
    // says
    double extra_kg = 0;
    for (std::size_t i = kBaseDegrees + 1; i < count; ++i)
      extra_kg += links_[i].mass - description.links[i].mass.mass_kg;
    Link& root = links_[kBaseDegrees];
    const double left = std::max(1 - extra_kg / root.mass, 0.1);
    root.mass *= left;
    root.inertia_Com *= left;
  }
  angle_rad_.assign(count, 0);
  speed_rad_s_.assign(count, 0);
  torque_Nm_.assign(count, 0);
  top_speed_rad_s_.assign(count, std::numeric_limits<double>::infinity());
  motor_.assign(count, {});
  base_force_.assign(count, 0);
  at_torque_.assign(count, 0);
  beyond_.assign(count, {});
  mass_matrix_.assign(count * stride_, 0);
  factor_.assign(count * stride_, 0);
  push_.assign(count, 0);
  y_.assign(count, 0);
  for (std::size_t limb = 0; limb < limbs_.size(); ++limb) update(limb);
}

void RobotTree::set(std::size_t link, double angle_rad, double speed_rad_s) {
  angle_rad_[link] = angle_rad;
  speed_rad_s_[link] = speed_rad_s;
}

void RobotTree::update(std::size_t limb) {
  for (std::size_t i = limbs_[limb].first; i < limbs_[limb].second; ++i) {
    Link& link = links_[i];
    const Link& parent = links_[static_cast<std::size_t>(link.parent)];
    if (link.freedom != Freedom::kHinge) {
      update_base(i);
      continue;
    }
    const double half = angle_rad_[i] / 2;
    const double sine = std::sin(half);
    const Eigen::Quaterniond turned(std::cos(half), sine * link.axis_Link.x(), sine * link.axis_Link.y(),
                                    sine * link.axis_Link.z());
    link.q = parent.q * link.q_ParentLink * turned;
    link.q.normalize();
    link.R = link.q.toRotationMatrix();
    link.p = parent.p + parent.R * link.p_ParentLink;
    link.a = link.R * link.axis_Link;
    link.s = link.p.cross(link.a);
    link.c = link.p + link.R * link.com_Link;
    link.w = parent.w + speed_rad_s_[i] * link.a;
    link.v0 = parent.v0 + speed_rad_s_[i] * link.s;
  }
}

void RobotTree::update_base(std::size_t i) {
  Link& link = links_[i];
  const Link& parent = links_[static_cast<std::size_t>(link.parent)];
  if (link.freedom == Freedom::kBaseSlide) {
    link.p = parent.p + angle_rad_[i] * link.axis_Link;
    link.s = link.axis_Link;
    link.a.setZero();
  } else {
    link.p = parent.p;
    link.a = link.axis_Link;
    link.s = link.p.cross(link.a);
    if (i == kBaseDegrees)
      link.q = from_rotation_vector(Eigen::Map<const Eigen::Vector3d>(&angle_rad_[kFirstBaseTurn]));
  }
  link.R = link.q.toRotationMatrix();
  link.c = link.p + link.R * link.com_Link;
  link.w = parent.w + speed_rad_s_[i] * link.a;
  link.v0 = parent.v0 + speed_rad_s_[i] * link.s;
}

void RobotTree::turn_base(double step_s) {
  const Eigen::Map<const Eigen::Vector3d> w(&speed_rad_s_[kFirstBaseTurn]);
  Eigen::Map<Eigen::Vector3d> turn_rad(&angle_rad_[kFirstBaseTurn]);
  const Eigen::Quaterniond q =
      (from_rotation_vector(step_s * w) * from_rotation_vector(turn_rad)).normalized();
  turn_rad = to_rotation_vector(q);
}

double RobotTree::stiffness(std::size_t link) const {
  return motor_[link].most_torque_Nm / motor_[link].give_way_rad_s;
}

void RobotTree::begin(std::size_t limb, double step_s) {
  step_s_ = step_s;
  const auto [first, end] = limbs_[limb];
  for (std::size_t i = first; i < end; ++i) {
    const Link& link = links_[i];
    Beyond& own = beyond_[i];
    own.mass = link.mass;
    own.moment = link.mass * link.c;
    const Eigen::Vector3d& c = link.c;
    own.inertia = link.R * link.inertia_Com * link.R.transpose() +
                  link.mass * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
    own.turn_momentum = own.inertia * link.w + own.moment.cross(link.v0);
    own.momentum = own.mass * link.v0 + link.w.cross(own.moment);
    // acceleration at no joint acceleration: what turning carries the hinges round
    const bool hangs = link.parent != 0;
    const auto above = static_cast<std::size_t>(link.parent);
    const Eigen::Vector3d turning = speed_rad_s_[i] * link.a;
    const Eigen::Vector3d moving = speed_rad_s_[i] * link.s;
    own.turn_acceleration = link.w.cross(turning);
    own.acceleration = link.v0.cross(turning) + link.w.cross(moving);
    if (link.freedom != Freedom::kHinge) {
      // a base's axes are the world's: they do not turn, they only move along with it
      const Eigen::Map<const Eigen::Vector3d> v_World(&speed_rad_s_[1]);
      own.turn_acceleration.setZero();
      own.acceleration = v_World.cross(turning);
    }
    if (hangs) {
      own.turn_acceleration += beyond_[above].turn_acceleration;
      own.acceleration += beyond_[above].acceleration;
    }
    own.turn_force = own.inertia * own.turn_acceleration + own.moment.cross(own.acceleration) +
                     link.w.cross(own.turn_momentum) + link.v0.cross(own.momentum);
    own.force =
        own.mass * own.acceleration + own.turn_acceleration.cross(own.moment) + link.w.cross(own.momentum);
  }
  for (std::size_t i = end; i-- > first;) {
    const Link& link = links_[i];
    const Beyond& own = beyond_[i];
    push_[i] = link.a.dot(own.turn_momentum) + link.s.dot(own.momentum) -
               step_s * (link.a.dot(own.turn_force) + link.s.dot(own.force));
    if (link.freedom != Freedom::kHinge) push_[i] += step_s * base_force_[i];
    // force that turns everything beyond with unit acceleration
    const Eigen::Vector3d turn = own.inertia * link.a + own.moment.cross(link.s);
    const Eigen::Vector3d force = own.mass * link.s + link.a.cross(own.moment);
    double* row = &mass_matrix_[i * stride_];
    for (std::size_t d = 0; d <= link.depth; ++d) {
      const Link& above = links_[static_cast<std::size_t>(link.path[d])];
      row[d] = above.a.dot(turn) + above.s.dot(force);
    }
    if (link.parent == 0) continue;
    Beyond& parent = beyond_[static_cast<std::size_t>(link.parent)];
    parent.mass += own.mass;
    parent.moment += own.moment;
    parent.inertia += own.inertia;
    parent.turn_momentum += own.turn_momentum;
    parent.momentum += own.momentum;
    parent.turn_force += own.turn_force;
    parent.force += own.force;
  }
}

void RobotTree::solve(std::size_t limb) {
  const auto [first, end] = limbs_[limb];
  std::copy(mass_matrix_.begin() + static_cast<std::ptrdiff_t>(first * stride_),
            mass_matrix_.begin() + static_cast<std::ptrdiff_t>(end * stride_),
            factor_.begin() + static_cast<std::ptrdiff_t>(first * stride_));
  for (std::size_t i = first; i < end; ++i) {
    y_[i] = push_[i];
    if (at_torque_[i] == 0) {
      const double held = step_s_ * stiffness(i);
      factor_[i * stride_ + links_[i].depth] += held;
      y_[i] += held * motor_[i].speed_rad_s;
    } else {
      y_[i] += step_s_ * at_torque_[i] * motor_[i].most_torque_Nm;
    }
  }
  for (std::size_t k = end; k-- > first;) {
    const Link& link = links_[k];
    double* row = &factor_[k * stride_];
    const double inverse = 1 / row[link.depth];
    for (std::size_t d = link.depth; d-- > 0;) {
      const double share = row[d] * inverse;
      double* above = &factor_[static_cast<std::size_t>(link.path[d]) * stride_];
      for (std::size_t e = 0; e <= d; ++e) above[e] -= share * row[e];
      y_[static_cast<std::size_t>(link.path[d])] -= share * y_[k];
      row[d] = share;
    }
    row[link.depth] = std::sqrt(inverse);
    y_[k] *= row[link.depth];
  }
}

void RobotTree::half_solve(std::span<const int> path, double* row) const {
  for (std::size_t k = path.size(); k-- > 0;) {
    const double* factor = &factor_[static_cast<std::size_t>(path[k]) * stride_];
    const double value = row[k];
    for (std::size_t d = 0; d < k; ++d) row[d] -= factor[d] * value;
    row[k] = value * factor[k];
  }
}

void RobotTree::half_solve(std::span<const int> path, std::size_t tail, std::size_t shared,
                           double* row) const {
  for (std::size_t k = path.size(); k-- > tail;) {
    const std::size_t depth = shared + k - tail;
    const double* factor = &factor_[static_cast<std::size_t>(path[k]) * stride_];
    const double value = row[k];
    for (std::size_t d = 0; d < shared; ++d) row[d] -= factor[d] * value;
    for (std::size_t d = shared; d < depth; ++d) row[tail + d - shared] -= factor[d] * value;
    row[k] = value * factor[depth];
  }
  half_solve(path.first(tail), row);
}

bool RobotTree::settle(std::size_t limb, bool last) {
  const auto [first, end] = limbs_[limb];
  bool fits = true;
  for (std::size_t i = first; i < end; ++i) {
    const Link& link = links_[i];
    const double* factor = &factor_[i * stride_];
    double speed = y_[i] * factor[link.depth];
    for (std::size_t d = 0; d < link.depth; ++d)
      speed -= factor[d] * speed_rad_s_[static_cast<std::size_t>(link.path[d])];
    speed_rad_s_[i] = speed;
    const double most = motor_[i].most_torque_Nm;
    const double wanted = stiffness(i) * (motor_[i].speed_rad_s - speed);
    if (at_torque_[i] == 0) {
      torque_Nm_[i] = std::clamp(wanted, -most, most);
      if (std::abs(wanted) <= most * (1 + 1e-9)) continue;
      if (!last) at_torque_[i] = wanted > 0 ? 1 : -1;
      fits = false;
    } else {
      torque_Nm_[i] = at_torque_[i] * most;
      if (wanted * at_torque_[i] >= most * (1 - 1e-9)) continue;
      if (!last) at_torque_[i] = 0;
      fits = false;
    }
  }
  return fits;
}

void RobotTree::advance(std::size_t limb, double step_s) {
  for (std::size_t i = limbs_[limb].first; i < limbs_[limb].second; ++i) {
    if (links_[i].freedom == Freedom::kBaseTurn) {
      if (i == kFirstBaseTurn) turn_base(step_s);
      continue;
    }
    speed_rad_s_[i] = std::clamp(speed_rad_s_[i], -top_speed_rad_s_[i], top_speed_rad_s_[i]);
    angle_rad_[i] += step_s * speed_rad_s_[i];
    // the stops of the solver give way a little, those of the gear do not
    if (angle_rad_[i] < least_rad_[i] || angle_rad_[i] > most_rad_[i]) {
      angle_rad_[i] = std::clamp(angle_rad_[i], least_rad_[i], most_rad_[i]);
      speed_rad_s_[i] = 0;
    }
  }
  update(limb);
}

void RobotTree::rest(std::size_t limb) {
  for (std::size_t i = limbs_[limb].first; i < limbs_[limb].second; ++i) {
    speed_rad_s_[i] = 0;
    torque_Nm_[i] = 0;
    at_torque_[i] = 0;
  }
  update(limb);
}

void RobotTree::restore(const State& state) {
  angle_rad_ = state.angle_rad;
  speed_rad_s_ = state.speed_rad_s;
  at_torque_ = state.at_torque;
  std::fill(torque_Nm_.begin(), torque_Nm_.end(), 0.0);
  for (std::size_t limb = 0; limb < limbs_.size(); ++limb) update(limb);
}

}  // namespace nido::sim
