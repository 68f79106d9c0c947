#include "lab.h"

#include <fstream>
#include <sstream>

namespace nido::test {
namespace {

std::string world_text() {
  std::ifstream file(std::string(NIDO_CONFIG_DIR) + "/worlds/attention.yaml");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

double off_px(const PinholeCamera& camera, const Eigen::Isometry3d& X_RootCamera,
              const Eigen::Vector3d& p_Root_m) {
  const auto px = camera.project(X_RootCamera.inverse() * p_Root_m);
  return px ? (*px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm() : 200.0;
}

}  // namespace

AttentionLab::AttentionLab(const attention::AttentionSettings& settings)
    : stage_(world_text()), core_(need(attention::AttentionCore::create(stage_.model(), settings))) {}

void AttentionLab::put(const attention::Placed& placed) {
  const std::string& name = attention::things()[static_cast<std::size_t>(placed.thing)].name;
  const Eigen::Vector3d& p = placed.X_RootThing.translation();
  const Eigen::Vector3d x = placed.X_RootThing.linear().col(0);
  std::ostringstream rot;
  rot << "world rot \"" << name << "\" -90 0 " << 90 + std::atan2(x.y(), x.x()) * 180 / M_PI;
  std::ostringstream set;
  set << "world set \"" << name << "\" " << -p.y() << ' ' << p.z() + 0.5976 << ' ' << -p.x() - 0.026;
  for (const auto& line : {rot.str(), set.str()}) {
    const std::string answer = stage_.simulation().world(line);
    if (answer.rfind("[fail]", 0) == 0) std::cerr << line << ": " << answer << '\n';
  }
}

void AttentionLab::park() {
  for (std::size_t i = 0; i < attention::things().size(); ++i) {
    attention::Placed away{static_cast<int>(i), Eigen::Isometry3d::Identity()};
    away.X_RootThing.translation() << 1.5, -0.5 + 0.1 * static_cast<double>(i), -0.5;
    put(away);
  }
}

std::vector<Judged> AttentionLab::play(const attention::Scene& scene, double duration_s, const Seen& seen) {
  park();
  for (const auto& other : scene.others) put(other);
  sim::Simulation& simulation = stage_.simulation();
  const double begin_s = simulation.time_s();
  const int head = simulation.part_index("head");
  std::vector<Judged> rows;
  bool told = false;
  while (simulation.time_s() - begin_s < duration_s - 1e-9) {
    attention::Placed target{scene.target.thing, attention::target_at(scene, simulation.time_s() - begin_s)};
    put(target);
    if (!simulation.step().ok()) break;
    const double time_s = simulation.time_s() - begin_s;
    vision::VisionInputs from = stage_.inputs(tick_++ % 3 == 0);
    attention::AttentionInputs in;
    in.head = from.head;
    in.torso = from.torso;
    const std::optional<Image> left = from.left;
    in.left = std::move(from.left);
    in.right = std::move(from.right);
    if (!told) in.p_RootFixate_m = scene.p_RootHint_m;
    told = true;
    const auto out = core_->step(Time{simulation.time_ns()}, std::move(in));
    for (const auto& warning : out.warnings) std::cerr << warning << '\n';
    if (out.command_rad) {
      if (!simulation.command_all(head, sim::JointMode::kDirect, *out.command_rad).ok()) break;
    }
    if (!out.pictures_stamp || !left) continue;
    const PinholeCamera camera;
    const Eigen::Isometry3d X_RootLeft = simulation.X_WorldCamera(sim::Eye::kLeft);
    const Eigen::Isometry3d X_RootRight = simulation.X_WorldCamera(sim::Eye::kRight);
    std::vector<attention::Placed> all = {target};
    all.insert(all.end(), scene.others.begin(), scene.others.end());
    const auto truth = attention::silhouette(camera, X_RootLeft, all);
    Judged row;
    row.time_s = time_s;
    row.work_s = out.work_s;
    const Eigen::Vector3d& p = target.X_RootThing.translation();
    row.fixation_px = (off_px(camera, X_RootLeft, p) + off_px(camera, X_RootRight, p)) / 2;
    if (out.surface) {
      const auto flat = [](const cv::Mat& m) { return std::vector<std::uint8_t>(m.datastart, m.dataend); };
      row.overlap = attention::intersection_over_union(flat(out.surface->mask), truth);
      row.overlap_threshold = attention::intersection_over_union(flat(out.surface->threshold), truth);
    }
    if (seen) seen(row, *left, out.surface ? &*out.surface : nullptr, truth);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace nido::test
