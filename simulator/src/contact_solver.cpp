#include "contact_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "ode_library.h"

namespace nido::sim {
namespace {

constexpr double kGravity_m_s2 = 9.81;

// Hinges stop just beyond the limits that the drives keep.
constexpr double kStopMargin_rad = 0.0025;
constexpr double kStopErp = 0.4;
constexpr double kStopGive = 1e-3;
constexpr double kNearStop_rad = 0.05;

constexpr double kLayer_m = 0.0002;          // contacts may stay that deep, so that they do not come and go
constexpr double kFastestPushOut_m_s = 1.0;  // things inside each other come apart with this speed
constexpr double kFrictionGive = 1e-4;
// Things that hang together: how much of a gap is closed in a step, how soft, how fast at most.
constexpr double kTieErp = 0.2;
constexpr double kTieGive = 1e-6;
constexpr double kFastestTurnBack_rad_s = 10;

// Motors that come to their torque, or off it, ask for another solution; a few are enough.
constexpr int kMostPasses = 4;
// Speeds that change by less than this in an iteration are found.
constexpr double kFound_m_s = 1e-6;

Eigen::Vector3d any_tangent(const Eigen::Vector3d& n) {
  const Eigen::Vector3d axis = std::abs(n.z()) > 0.7 ? Eigen::Vector3d(Eigen::Vector3d::UnitX())
                                                     : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  return axis.cross(n).normalized();
}

}  // namespace

void ContactSolver::step(RobotBody& robot, const std::vector<dBodyID>& objects,
                         std::vector<Contact>& contacts, std::vector<Tie>& ties, double step_s,
                         int iterations) {
  RobotTree& tree = robot.tree();
  awake_limbs_.clear();
  for (std::size_t limb = 0; limb < tree.limb_count(); ++limb) {
    if (robot.awake(limb)) awake_limbs_.push_back(limb);
  }
  groups_.clear();
  rows_.clear();
  paths_.clear();
  directions_.clear();
  gather_objects(objects, step_s);
  for (const std::size_t limb : awake_limbs_) tree.begin(limb, step_s);
  add_stops(robot, step_s);
  for (Contact& contact : contacts) add_contact(tree, contact, step_s);
  for (Tie& tie : ties) add_tie(tree, tie, step_s);
  for (int pass = 1; pass <= kMostPasses; ++pass) {
    for (const std::size_t limb : awake_limbs_) tree.solve(limb);
    couple(tree);
    iterate(tree, iterations);
    bool settled = true;
    for (const std::size_t limb : awake_limbs_) settled = tree.settle(limb, pass == kMostPasses) && settled;
    if (settled) break;
  }
  read_forces(step_s);
  for (const std::size_t limb : awake_limbs_) {
    tree.advance(limb, step_s);
    robot.show(limb);
  }
  move_objects(objects, step_s);
}

void ContactSolver::gather_objects(const std::vector<dBodyID>& objects, double step_s) {
  free_.assign(objects.size(), {});
  for (std::size_t i = 0; i < objects.size(); ++i) {
    dBodyID body = objects[i];
    if (body == nullptr || dBodyIsEnabled(body) == 0) continue;
    Free& free = free_[i];
    dMass mass;
    dBodyGetMass(body, &mass);
    Eigen::Matrix3d inertia_Body;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) inertia_Body(r, c) = mass.I[4 * r + c];
    }
    const Eigen::Matrix3d R = body_pose(body).linear();
    const Eigen::Matrix3d inertia = R * inertia_Body * R.transpose();
    free.moves = true;
    free.root_mass = std::sqrt(mass.mass);
    const Eigen::Matrix3d L = inertia.llt().matrixL();
    free.inverse_root_inertia = L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
    free.p = to_eigen(dBodyGetPosition(body));
    const Eigen::Vector3d v =
        to_eigen(dBodyGetLinearVel(body)) +
        step_s * (to_eigen(dBodyGetForce(body)) / mass.mass + Eigen::Vector3d(0, 0, -kGravity_m_s2));
    Eigen::Vector3d w = to_eigen(dBodyGetAngularVel(body));
    free.v_before = to_eigen(dBodyGetLinearVel(body));
    free.w_before = w;
    // one implicit Newton step of Euler's equation: explicit ones feed a spin with energy
    const Eigen::Vector3d spin = inertia * w;
    const auto cross = [](const Eigen::Vector3d& u) {
      Eigen::Matrix3d m;
      m << 0, -u.z(), u.y(), u.z(), 0, -u.x(), -u.y(), u.x(), 0;
      return m;
    };
    w += (inertia + step_s * (cross(w) * inertia - cross(spin))).inverse() *
         (step_s * (to_eigen(dBodyGetTorque(body)) - w.cross(spin)));
    Eigen::Map<Eigen::Vector3d>(&free.u[0]) = free.root_mass * v;
    Eigen::Map<Eigen::Vector3d>(&free.u[3]) = L.transpose() * w;
    dBodySetForce(body, 0, 0, 0);
    dBodySetTorque(body, 0, 0, 0);
  }
}

void ContactSolver::add_stops(const RobotBody& robot, double step_s) {
  const RobotTree& tree = robot.tree();
  for (const std::size_t limb : awake_limbs_) {
    const auto [first, end] = tree.limb(limb);
    for (std::size_t i = first; i < end; ++i) {
      const LinkDescription& link = robot.description().links[i];
      const double below = tree.angle_rad(i) - (link.min_rad - kStopMargin_rad);
      const double above = (link.max_rad + kStopMargin_rad) - tree.angle_rad(i);
      const double gap = std::min(below, above);
      if (gap > kNearStop_rad) continue;
      const double sign = below < above ? 1 : -1;
      // out of reach within this step
      if (gap > 0 && gap + sign * tree.speed_rad_s(i) * step_s > kNearStop_rad / 2) continue;
      Group group;
      group.path = paths_.size();
      const auto path = tree.path(i);
      paths_.insert(paths_.end(), path.begin(), path.end());
      group.length = group.tail = path.size();
      set_width(group);
      group.directions = directions_.size();
      directions_.resize(group.directions + group.width, 0.0);
      directions_[group.directions + group.length - 1] = sign;
      group.row = rows_.size();
      group.rows = 1;
      Row row{};
      row.target = gap > 0 ? -gap / step_s : -gap * kStopErp / step_s;
      row.give = kStopGive;
      row.share = kPushes;
      rows_.push_back(row);
      groups_.push_back(group);
    }
  }
}

ContactSolver::Row& ContactSolver::add_row(const RobotTree& tree, Group& group,
                                           const Eigen::Vector3d& direction, bool turning) {
  const Eigen::Vector3d& p = group.p_World_m;
  // the robot's hinges
  const std::size_t first = directions_.size();
  directions_.resize(first + group.width, 0.0);
  const auto along = [&](std::size_t k, double sign) {
    const auto link = static_cast<std::size_t>(paths_[group.path + k]);
    directions_[first + k] +=
        sign * (turning ? tree.turn_along(link, direction) : tree.move_along(link, p, direction));
  };
  if (group.length > 0) {
    const bool both = group.link_a && group.link_b;
    const double sign = group.link_a ? 1 : -1;
    // hinges that both links share move both alike: nothing between them
    for (std::size_t k = both ? group.shared : 0; k < group.tail; ++k) along(k, sign);
    for (std::size_t k = group.tail; k < group.length; ++k) along(k, -1);
  }
  // free objects
  std::size_t at = first + padded(group.length);
  const auto side = [&](int object, double sign) {
    if (object < 0) return;
    const Free& free = free_[static_cast<std::size_t>(object)];
    Eigen::Map<Eigen::Vector3d> linear(&directions_[at]);
    Eigen::Map<Eigen::Vector3d> angular(&directions_[at + 3]);
    if (!turning) linear = sign / free.root_mass * direction;
    angular = free.inverse_root_inertia * (turning ? Eigen::Vector3d(sign * direction)
                                                   : Eigen::Vector3d(sign * (p - free.p).cross(direction)));
    at += 6;
  };
  side(group.object_a, 1);
  side(group.object_b, -1);
  Row row{};
  rows_.push_back(row);
  ++group.rows;
  return rows_.back();
}

void ContactSolver::add_contact(const RobotTree& tree, Contact& contact, double step_s) {
  contact.normal_force_N = 0;
  const auto moving = [this](int object) {
    return object >= 0 && free_[static_cast<std::size_t>(object)].moves ? object : -1;
  };
  Group group;
  group.contact = &contact;
  group.p_World_m = contact.p_World_m;
  group.link_a = contact.a.link > 0;
  group.link_b = contact.b.link > 0;
  group.object_a = moving(contact.a.object);
  group.object_b = moving(contact.b.object);
  group.path = paths_.size();
  const auto append = [&](int link, std::size_t from) {
    const auto path = tree.path(static_cast<std::size_t>(link));
    paths_.insert(paths_.end(), path.begin() + static_cast<std::ptrdiff_t>(from), path.end());
  };
  if (contact.a.link > 0) append(contact.a.link, 0);
  group.tail = paths_.size() - group.path;
  if (contact.b.link > 0) {
    if (contact.a.link > 0) {
      const auto path_a = tree.path(static_cast<std::size_t>(contact.a.link));
      const auto path_b = tree.path(static_cast<std::size_t>(contact.b.link));
      while (group.shared < path_a.size() && group.shared < path_b.size() &&
             path_a[group.shared] == path_b[group.shared])
        ++group.shared;
    }
    append(contact.b.link, group.shared);
    if (contact.a.link <= 0) group.tail = paths_.size() - group.path;
  }
  group.length = paths_.size() - group.path;
  if (group.length == 0 && group.object_a < 0 && group.object_b < 0) {
    contact.force_World_N.setZero();
    contact.torque_World_Nm.setZero();
    return;
  }
  set_width(group);
  group.directions = directions_.size();
  group.row = rows_.size();

  const Eigen::Vector3d& n = contact.normal_World;
  Row& normal = add_row(tree, group, n, false);
  normal.share = kPushes;
  normal.impulse = std::max(contact.force_World_N.dot(n), 0.0) * step_s;
  normal.give = contact.cfm / step_s;
  normal.target =
      std::min(contact.erp * std::max(contact.depth_m - kLayer_m, 0.0) / step_s, kFastestPushOut_m_s);
  if (contact.restitution > 0) {
    const auto speed = [&](const Side& side) -> Eigen::Vector3d {
      if (side.link > 0) {
        const auto link = static_cast<std::size_t>(side.link);
        return tree.v_WorldCom_m_s(link) +
               tree.w_World_rad_s(link).cross(contact.p_World_m - tree.p_WorldCom_m(link));
      }
      if (side.object < 0 || !free_[static_cast<std::size_t>(side.object)].moves)
        return Eigen::Vector3d::Zero();
      const Free& free = free_[static_cast<std::size_t>(side.object)];
      return free.v_before + free.w_before.cross(contact.p_World_m - free.p);
    };
    const double closing = -n.dot(speed(contact.a) - speed(contact.b));
    if (closing > contact.slowest_bounce_m_s)
      normal.target = std::max(normal.target, contact.restitution * closing);
  }
  const auto rub = [&](const Eigen::Vector3d& direction, bool turning, double share, double target) {
    Row& row = add_row(tree, group, direction, turning);
    row.share = share;
    row.give = kFrictionGive;
    row.target = target;
    row.impulse = direction.dot(turning ? contact.torque_World_Nm : contact.force_World_N) * step_s;
  };
  if (contact.friction > 0) {
    const bool pulled = contact.tangent_World.squaredNorm() > 0.5;
    const Eigen::Vector3d t1 = pulled ? contact.tangent_World : any_tangent(n);
    const Eigen::Vector3d t2 = n.cross(t1);
    rub(t1, false, contact.friction, contact.tangent_speed_m_s);
    rub(t2, false, contact.friction, 0);
    if (contact.rolling_m > 0) {
      rub(t1, true, contact.rolling_m, 0);
      rub(t2, true, contact.rolling_m, 0);
    }
    if (contact.twist_m > 0) rub(n, true, contact.twist_m, 0);
  }
  begin_with_impulses(group);
  groups_.push_back(group);
}

void ContactSolver::set_width(Group& group) {
  group.width = padded(group.length) + (group.object_a >= 0 ? 6U : 0U) + (group.object_b >= 0 ? 6U : 0U);
}

void ContactSolver::begin_with_impulses(const Group& group) {
  for_objects(group, [&](double* u, std::size_t at) {
    for (std::size_t r = 0; r < group.rows; ++r) {
      const double* z = &directions_[group.directions + r * group.width + at];
      for (std::size_t k = 0; k < 6; ++k) u[k] += z[k] * rows_[group.row + r].impulse;
    }
  });
}

void ContactSolver::add_tie(const RobotTree& tree, Tie& tie, double step_s) {
  const auto moving = [this](int object) {
    return object >= 0 && free_[static_cast<std::size_t>(object)].moves ? object : -1;
  };
  Group group;
  group.tie = &tie;
  group.p_World_m = tie.p_World_m;
  group.object_a = moving(tie.object_a);
  group.object_b = moving(tie.object_b);
  if (group.object_a < 0 && group.object_b < 0) return;
  group.path = paths_.size();
  set_width(group);
  group.directions = directions_.size();
  group.row = rows_.size();
  const auto hold = [&](const Eigen::Vector3d& direction, bool turning, double gap) {
    const double fastest = turning ? kFastestTurnBack_rad_s : kFastestPushOut_m_s;
    Row& row = add_row(tree, group, direction, turning);
    row.share = kHolds;
    row.give = kTieGive;
    row.target = std::clamp(kTieErp * gap / step_s, -fastest, fastest);
    row.impulse = tie.impulse[group.rows - 1];
  };
  for (int k = 0; k < 3; ++k) hold(Eigen::Vector3d::Unit(k), false, tie.gap_m[k]);
  for (std::size_t k = 0; k < tie.turns; ++k) hold(tie.turn_axis_World[k], true, tie.turn_gap_rad[k]);
  begin_with_impulses(group);
  groups_.push_back(group);
}

void ContactSolver::couple(RobotTree& tree) {
  coupled_ = directions_;
  std::vector<double>& y = tree.y();
  std::size_t widest = 0;
  for (const Group& group : groups_) {
    widest = std::max(widest, group.width);
    const std::span<const int> path(&paths_[group.path], group.length);
    double* const first = &coupled_[group.directions];
    for (std::size_t r = 0; r < group.rows && group.length > 0; ++r) {
      double* z = first + r * group.width;
      if (group.tail == group.length) {
        tree.half_solve(path, z);
      } else {
        tree.half_solve(path, group.tail, group.shared, z);
      }
      // what the step before or an earlier pass found still acts
      const double impulse = rows_[group.row + r].impulse;
      for (std::size_t k = 0; k < group.length; ++k) y[static_cast<std::size_t>(path[k])] += z[k] * impulse;
    }
    with_rows(group.rows, [&]<std::size_t kRows>() {
      for (std::size_t r = 0; r < kRows; ++r) {
        Row& row = rows_[group.row + r];
        multiply<kRows>(first, group.width, first + r * group.width, row.others);
        row.weight = row.others[r] + row.give;
        row.inverse = row.weight > 0 ? 1 / row.weight : 0;
      }
    });
  }
  near_.resize(widest);
}

double ContactSolver::relax(RobotTree& tree, const Group& group) {
  double* const y = tree.y().data();
  double* const near = near_.data();
  const int* path = paths_.data() + group.path;
  // two at once, as the kernels read them: what is written one by one cannot be read as two without waiting
  for (std::size_t k = 0; k < group.length; k += 2) {
    const Lanes two = {y[path[k]], k + 1 < group.length ? y[path[k + 1]] : 0};
    std::memcpy(near + k, &two, sizeof two);
  }
  for_objects(group, [near](const double* u, std::size_t at) {
    for (std::size_t k = 0; k < 6; k += 2) std::memcpy(near + at + k, u + k, sizeof(Lanes));
  });
  double largest = 0;
  Row* const rows = &rows_[group.row];
  const double* const z = coupled_.data() + group.directions;
  with_rows(group.rows, [&]<std::size_t kRows>() {
    std::array<double, kRows> speed;
    std::array<double, kRows> change;
    multiply<kRows>(z, group.width, near, speed.data());
    for (std::size_t r = 0; r < kRows; ++r) {
      Row& row = rows[r];
      const double most =
          row.share < 0 ? std::numeric_limits<double>::infinity() : row.share * rows[0].impulse;
      const double least = row.share == kPushes ? 0 : -most;
      const double wanted = row.impulse + (row.target - speed[r] - row.give * row.impulse) * row.inverse;
      const double next = std::clamp(wanted, least, most);
      change[r] = next - row.impulse;
      row.impulse = next;
      for (std::size_t q = r + 1; q < kRows; ++q) speed[q] += row.others[q] * change[r];
      largest = std::max(largest, std::abs(change[r] * row.weight));
    }
    if (largest > 0) add_rows<kRows>(z, group.width, change.data(), near);
  });
  if (largest == 0) return 0;
  for (std::size_t k = 0; k < group.length; ++k) y[path[k]] = near[k];
  for_objects(group, [near](double* u, std::size_t at) {
    for (std::size_t k = 0; k < 6; k += 2) std::memcpy(u + k, near + at + k, sizeof(Lanes));
  });
  return largest;
}

void ContactSolver::iterate(RobotTree& tree, int iterations) {
  for (int i = 0; i < iterations; ++i) {
    double largest = 0;
    if (i % 2 == 0) {
      for (std::size_t g = 0; g < groups_.size(); ++g) largest = std::max(largest, relax(tree, groups_[g]));
    } else {
      for (std::size_t g = groups_.size(); g-- > 0;) largest = std::max(largest, relax(tree, groups_[g]));
    }
    if (largest < kFound_m_s) break;
  }
}

void ContactSolver::read_forces(double step_s) {
  for (const Group& group : groups_) {
    if (group.tie != nullptr) {
      for (std::size_t r = 0; r < group.rows; ++r) group.tie->impulse[r] = rows_[group.row + r].impulse;
    }
    if (group.contact == nullptr) continue;
    Contact& contact = *group.contact;
    const Eigen::Vector3d& n = contact.normal_World;
    const bool pulled = contact.tangent_World.squaredNorm() > 0.5;
    const Eigen::Vector3d t1 = pulled ? contact.tangent_World : any_tangent(n);
    const Eigen::Vector3d t2 = n.cross(t1);
    const auto force = [&](std::size_t r) { return rows_[group.row + r].impulse / step_s; };
    contact.normal_force_N = force(0);
    contact.force_World_N = force(0) * n;
    contact.torque_World_Nm.setZero();
    if (contact.friction <= 0) continue;
    contact.force_World_N += force(1) * t1 + force(2) * t2;
    std::size_t next = 3;
    if (contact.rolling_m > 0) {
      contact.torque_World_Nm += force(3) * t1 + force(4) * t2;
      next = 5;
    }
    if (contact.twist_m > 0) contact.torque_World_Nm += force(next) * n;
  }
}

void ContactSolver::move_objects(const std::vector<dBodyID>& objects, double step_s) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Free& free = free_[i];
    if (!free.moves) continue;
    dBodyID body = objects[i];
    const Eigen::Vector3d v = Eigen::Map<const Eigen::Vector3d>(&free.u[0]) / free.root_mass;
    const Eigen::Vector3d w =
        free.inverse_root_inertia.transpose() * Eigen::Map<const Eigen::Vector3d>(&free.u[3]);
    dBodySetLinearVel(body, v.x(), v.y(), v.z());
    dBodySetAngularVel(body, w.x(), w.y(), w.z());
    const Eigen::Vector3d p = free.p + step_s * v;
    const double turn = w.norm() * step_s;
    Eigen::Quaterniond q = body_orientation(body);
    if (turn > 0) q = Eigen::Quaterniond(Eigen::AngleAxisd(turn, w.normalized())) * q;
    dQuaternion orientation;
    to_ode(q, orientation);
    dBodySetQuaternion(body, orientation);
    dBodySetPosition(body, p.x(), p.y(), p.z());
  }
}

}  // namespace nido::sim
