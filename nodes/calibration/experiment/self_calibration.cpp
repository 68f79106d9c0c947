// nido-experiment-self-calibration: bodies that are not built as drawn find out how they are by looking at
// their moving hand; how well they know afterwards where their hand is, by the number of poses that they
// looked at.
#include "nido/calibration/self_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "nido/experiment/kept.h"
#include "nido/launcher/paths.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"
#include "wrong_body.h"

namespace nido::calibration {
namespace {

namespace fs = std::filesystem;

struct Request : ExperimentRequest {
  int poses = 200;
  int test_poses = 60;
  int domain = kFreeDomain;
  std::string hand = "right";
};

constexpr int kCounts[] = {0, 5, 10, 20, 35, 50, 75, 100, 150, 200};

// How far off a body's knowledge is after so many poses; means over the held-out poses.
struct Point {
  int poses = 0;
  double hand_m = 0.0;  // predicted from the encoders, from where the hand really is
  double seen_m = 0.0;  // where both eyes see it, from where it really is
  double rms_px = 0.0;
};

// Mean errors of a believed body, at held-out poses. The real body says where the hand is: the simulator
// moves that one.
Result<Point> judge(const RobotModel& believed, const RobotModel& real, const std::string& side,
                    const ViewsFile& file, std::size_t first) {
  const auto hand = believed.hand(side);
  if (!hand) return hand.error();
  int knuckle = -1;
  for (const HandMark& mark : hand->marks) {
    if (mark.name == "knuckle") knuckle = mark.link;
  }
  const std::array<int, 2> eyes = {*believed.camera_link("left"), *believed.camera_link("right")};
  Point point;
  int seen = 0;
  for (std::size_t v = first; v < file.views.size(); ++v) {
    const PoseView& view = file.views[v];
    const Eigen::Vector3d truth = real.X_RootLink(knuckle, view.axes_rad).translation();
    point.hand_m += (believed.X_RootLink(knuckle, view.axes_rad).translation() - truth).norm();
    std::array<Ray, 2> rays;
    for (std::size_t e = 0; e < 2; ++e) {
      rays[e] = ray_of_pixel(file.cameras[e], believed.X_RootLink(eyes[e], view.axes_rad),
                             view.mark_px[e][0].value_or(Eigen::Vector2d::Zero()));
    }
    if (const auto met = triangulate(rays[0], rays[1])) {
      point.seen_m += (met->p_m - truth).norm();
      ++seen;
    }
  }
  point.hand_m /= static_cast<double>(file.views.size() - first);
  point.seen_m /= std::max(1, seen);
  return point;
}

fs::path folder_of(const Request& request, int trial) {
  return fs::absolute(fs::path(request.out) /
                      fmt::format("body-{}", request.seed + static_cast<std::uint64_t>(trial)));
}

Result<std::vector<Point>> trial_of(const Request& request, int trial, const Lane& lane,
                                    const fs::path& robots) {
  const std::uint64_t seed = request.seed + static_cast<std::uint64_t>(trial);
  const fs::path folder = folder_of(request, trial);
  const BodyCorrections body = draw_wrong_body(seed, request.hand);
  if (Status written = write_robot(robots, body, folder); !written) return written.error();
  const fs::path views = folder / "views.txt";
  const Status ran = run_app_once(
      {"self_calibration",
       in_lockstep(seed, {"--robot", (folder / "icub_sim_babbling.yaml").string(), "--hand", request.hand,
                          "--set", fmt::format("calibration.poses={}", request.poses + request.test_poses),
                          "--set", "calibration.views_file=" + views.string()}),
       folder.string()},
      lane);
  if (!ran) return ran.error();
  auto file = load_views(views);
  if (!file) return file.error();
  if (static_cast<int>(file->views.size()) != request.poses + request.test_poses)
    return Error{ErrorCode::kFailed, fmt::format("{}: {} poses", views.string(), file->views.size())};
  const auto drawn = RobotModel::load(robots / "icub.urdf");
  if (!drawn) return drawn.error();
  const auto real = RobotModel::load(folder / "icub.urdf");
  if (!real) return real.error();
  std::vector<Point> points;
  for (const int count : kCounts) {
    if (count > request.poses) break;
    Calibration found;
    if (count > 0) {
      const std::vector<PoseView> learned(file->views.begin(), file->views.begin() + count);
      auto calibrated =
          calibrate(*drawn, request.hand, file->cameras, learned, default_unknowns(request.hand));
      if (!calibrated) return calibrated.error();
      found = std::move(*calibrated);
      const Status kept = found.corrections.save(
          folder / fmt::format("calibration_{}.yaml", count),
          fmt::format("found by {} poses; nido experiment run self-calibration --seed {}", count, seed));
      if (!kept) return kept.error();
    }
    const auto believed = load_corrected_model(robots / "icub.urdf", found.corrections);
    if (!believed) return believed.error();
    auto point = judge(*believed, *real, request.hand, *file, static_cast<std::size_t>(request.poses));
    if (!point) return point.error();
    point->poses = count;
    point->rms_px = found.rms_px;
    points.push_back(*point);
  }
  return points;
}

Report make_report(const Request& request, const std::map<int, std::vector<Point>>& done) {
  Report report;
  report.name = "self-calibration";
  report.title = "Knowing one's own body by looking at the moving hand";
  report.summary =
      "Each body is built otherwise than its URDF says: zeros of the encoders of neck, eyes and arm, the "
      "eyes' place "
      "and turn in their sockets, the lengths of upper arm and forearm. It shows its hand to its eyes and "
      "finds out "
      "how it is built. Then, in poses that it did not learn from, it says from its encoders where its hand "
      "is; "
      "the figure is how far off that is, and how far off the eyes see the hand, by the number of poses "
      "learned from.";
  report.command = fmt::format("nido experiment run self-calibration --seed {} --trials {}{}", request.seed,
                               request.trials, request.hand == "right" ? "" : " --hand " + request.hand);
  report.seed = request.seed;
  report.trials = static_cast<long>(done.size());
  report.robot = "icub_sim_babbling, its body drawn by the seed";
  report.world = "empty";
  Plot plot{"error-by-poses", "Mean error in held-out poses by poses learned from (95 % interval dashed)",
            "poses", "mean error (mm)"};
  Plot closer{"error-by-poses-close", "The same from 10 poses on", "poses", "mean error (mm)"};
  plot.series = {
      {"hand predicted", {}}, {"lower", {}, true, true}, {"upper", {}, true, true}, {"hand seen", {}}};
  closer.series = plot.series;
  for (std::size_t c = 0; c < std::size(kCounts) && kCounts[c] <= request.poses; ++c) {
    std::vector<double> hand_m;
    std::vector<double> seen_m;
    for (const auto& [trial, points] : done) {
      hand_m.push_back(points[c].hand_m);
      seen_m.push_back(points[c].seen_m);
    }
    if (hand_m.empty()) break;
    const std::string key = kCounts[c] == 0 ? "as_drawn" : fmt::format("after_{}", kCounts[c]);
    report.add("hand_error_m." + key, mean_metric(hand_m, "m"));
    report.add("seen_error_m." + key, mean_metric(seen_m, "m"));
    const auto interval = mean_interval(hand_m);
    for (Plot* p : {&plot, &closer}) {
      if (p == &closer && kCounts[c] < 10) continue;
      const double x = kCounts[c];
      p->series[0].points.push_back({x, 1000.0 * mean(hand_m)});
      p->series[1].points.push_back({x, 1000.0 * interval[0]});
      p->series[2].points.push_back({x, 1000.0 * interval[1]});
      p->series[3].points.push_back({x, 1000.0 * mean(seen_m)});
    }
  }
  for (const auto& [trial, points] : done) {
    Row row = {{"seed", static_cast<double>(request.seed) + trial}};
    for (const Point& point : points)
      row.emplace_back(fmt::format("hand_error_mm_{}", point.poses), 1000.0 * point.hand_m);
    row.emplace_back("rms_px", points.back().rms_px);
    report.trials_detail.push_back(row);
  }
  report.plots = {plot, closer};
  return report;
}

Status run(const Request& request) {
  const auto places = find_places();
  if (!places) return places.error();
  const fs::path robots = places->config / "robots";
  const Pieces pieces{.what = "bodies",
                      .out = request.out,
                      .count = request.trials,
                      .jobs = request.jobs,
                      .domain = request.domain,
                      .total = request.trials};
  return run_pieces<std::vector<Point>>(
      pieces, [&](int trial, const Lane& lane) { return trial_of(request, trial, lane, robots); },
      [&](const std::map<int, std::vector<Point>>& done) { return make_report(request, done); });
}

}  // namespace
}  // namespace nido::calibration

int main(int argc, char** argv) {
  nido::calibration::Request request;
  request.trials = 3;
  request.jobs = 2;
  request.out = "out/self-calibration";
  CLI::App app("How well a body that is not built as drawn gets to know itself.",
               "nido-experiment-self-calibration");
  app.footer("example\n  nido experiment run self-calibration --seed 1 --trials 3 --out out/calibration");
  nido::add_experiment_options(app, request);
  app.add_option("--poses", request.poses, "poses to learn from")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  app.add_option("--test-poses", request.test_poses, "poses to judge by")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  nido::add_hand_option(app, request.hand);
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  return nido::end_experiment(nido::calibration::run(request));
}
