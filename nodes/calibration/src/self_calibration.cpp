#include "nido/calibration/self_calibration.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "nido/learning/weights_file.h"

namespace nido::calibration {
namespace {

constexpr double kRadPerDeg = static_cast<double>(EIGEN_PI) / 180.0;
constexpr double kPixelNoise_px = 0.3;  // of a mark's centre
constexpr double kLeastScale_px = 0.5;  // errors below this are never called wild
constexpr double kWild = 5.0;           // times the usual error
constexpr int kIterations = 60;
constexpr double kNotInFront_px = 300.0;  // error of a mark that would be behind the eye
constexpr Eigen::Index kPerView = 8;      // two eyes, two marks, u and v

// The links from the root to eyes and marks, each evaluated once a pose.
class Chain {
 public:
  Chain(const RobotModel& model, const std::vector<int>& tips, const std::vector<Unknown>& unknowns) {
    place_.assign(model.links().size(), -1);
    for (const int tip : tips) add(model, tip);
    for (const int tip : tips) tips_.push_back(place_[static_cast<std::size_t>(tip)]);
    for (const Unknown& unknown : unknowns) {
      int at = -1;
      for (std::size_t i = 0; i < steps_.size(); ++i) {
        if (steps_[i].name == unknown.link) at = static_cast<int>(i);
      }
      unknown_step_.push_back(at);
    }
  }
  // The link of an unknown is on the way to eyes or marks.
  [[nodiscard]] bool knows(std::size_t unknown) const { return unknown_step_[unknown] >= 0; }

  // Poses of the tips with the unknowns at `x`.
  void tips(const Eigen::VectorXd& hinges_rad, const std::vector<Unknown>& unknowns, const Eigen::VectorXd& x,
            std::vector<Eigen::Isometry3d>& out) {
    corrections_.assign(steps_.size(), LinkCorrection{});
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      LinkCorrection& correction = corrections_[static_cast<std::size_t>(unknown_step_[i])];
      const int c = unknowns[i].component;
      (c < 3 ? correction.p_m(c) : correction.turn_rad(c - 3)) += x(static_cast<Eigen::Index>(i));
    }
    poses_.resize(steps_.size());
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const Step& step = steps_[i];
      Eigen::Isometry3d X = step.parent < 0
                                ? step.X_ParentChild0
                                : poses_[static_cast<std::size_t>(step.parent)] * step.X_ParentChild0;
      if (corrected(i)) X = X * corrections_[i].X_DrawnReal();
      if (step.hinge >= 0) X = X * Eigen::AngleAxisd(hinges_rad(step.hinge), Eigen::Vector3d::UnitZ());
      poses_[i] = X;
    }
    out.resize(tips_.size());
    for (std::size_t t = 0; t < tips_.size(); ++t) out[t] = poses_[static_cast<std::size_t>(tips_[t])];
  }

 private:
  struct Step {
    std::string name;
    int parent = -1;  // step; -1: the root
    int hinge = -1;
    Eigen::Isometry3d X_ParentChild0;
  };
  int add(const RobotModel& model, int link) {
    int& place = place_[static_cast<std::size_t>(link)];
    if (place >= 0) return place;
    const BodyLink& body = model.links()[static_cast<std::size_t>(link)];
    const int parent = body.parent >= 0 ? add(model, body.parent) : -1;
    steps_.push_back({body.name, parent, body.hinge, body.X_ParentChild0});
    place = static_cast<int>(steps_.size()) - 1;
    return place;
  }
  [[nodiscard]] bool corrected(std::size_t step) const {
    return !corrections_[step].p_m.isZero(0) || !corrections_[step].turn_rad.isZero(0);
  }

  std::vector<Step> steps_;
  std::vector<int> place_;  // of each link of the model in steps_
  std::vector<int> tips_;
  std::vector<int> unknown_step_;
  std::vector<LinkCorrection> corrections_;
  std::vector<Eigen::Isometry3d> poses_;
};

// What is seen minus what is predicted, in pixels, for all views; 0 where nothing was seen.
class Residuals {
 public:
  Residuals(Chain chain, const std::array<PinholeCamera, 2>& cameras, const std::vector<PoseView>& views,
            const std::vector<Unknown>& unknowns, const RobotModel& model)
      : chain_(std::move(chain)), cameras_(cameras), views_(views), unknowns_(unknowns) {
    for (const PoseView& view : views) hinges_.push_back(model.hinge_angles(view.axes_rad));
  }
  [[nodiscard]] Eigen::Index size() const { return kPerView * static_cast<Eigen::Index>(views_.size()); }

  void evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& out) {
    out.setZero(size());
    for (std::size_t v = 0; v < views_.size(); ++v) {
      chain_.tips(hinges_[v], unknowns_, x, tips_);  // left eye, right eye, knuckle, wrist
      for (std::size_t e = 0; e < 2; ++e) {
        const Eigen::Isometry3d X_CameraRoot = tips_[e].inverse();
        for (std::size_t m = 0; m < 2; ++m) {
          const auto& seen = views_[v].mark_px[e][m];
          if (!seen) continue;
          const auto px = cameras_[e].project(X_CameraRoot * tips_[2 + m].translation());
          out.segment<2>(kPerView * static_cast<Eigen::Index>(v) + static_cast<Eigen::Index>(4 * e + 2 * m)) =
              px ? Eigen::Vector2d(*px - *seen) : Eigen::Vector2d::Constant(kNotInFront_px);
        }
      }
    }
  }

 private:
  Chain chain_;
  std::array<PinholeCamera, 2> cameras_;
  const std::vector<PoseView>& views_;
  const std::vector<Unknown>& unknowns_;
  std::vector<Eigen::VectorXd> hinges_;
  std::vector<Eigen::Isometry3d> tips_;
};

// The usual length of an error: its median, over marks that were seen.
double usual_px(const Eigen::VectorXd& residuals) {
  std::vector<double> lengths;
  for (Eigen::Index i = 0; i < residuals.size(); i += 2) {
    const double length = residuals.segment<2>(i).norm();
    if (length > 0) lengths.push_back(length);
  }
  if (lengths.empty()) return kLeastScale_px;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return std::max(kLeastScale_px, *middle);
}

// Cauchy's weight and cost of an error of this length.
double weight_of(double length_px, double scale_px) {
  const double share = length_px / (2.0 * scale_px);
  return 1.0 / (1.0 + share * share);
}
double cost_of(const Eigen::VectorXd& residuals, double scale_px) {
  const double width = 2.0 * scale_px;
  double sum = 0;
  for (Eigen::Index i = 0; i < residuals.size(); i += 2)
    sum += width * width * std::log1p(residuals.segment<2>(i).squaredNorm() / (width * width));
  return sum / (kPixelNoise_px * kPixelNoise_px);
}

}  // namespace

std::string wrist_mark(const std::string& side) { return side.substr(0, 1) + "_hand_mark_wrist"; }

std::vector<Unknown> default_unknowns(const std::string& side) {
  const std::string s = side.substr(0, 1) + "_";
  std::vector<Unknown> unknowns;
  for (const std::string& link :
       {std::string("neck_1"), std::string("neck_2"), std::string("head"), std::string("eyes"),
        std::string("left_eye_ball"), std::string("right_eye_ball"), s + "shoulder_1", s + "shoulder_2",
        s + "upper_arm", s + "elbow_1", s + "forearm", s + "wrist_1", s + "palm"}) {
    unknowns.push_back({link, 5, 5.0 * kRadPerDeg});
  }
  for (const char* const eye : {"l_eye", "r_eye"}) {
    for (int c = 0; c < 3; ++c) unknowns.push_back({eye, c, 0.005});
    for (int c = 3; c < 6; ++c) unknowns.push_back({eye, c, 3.0 * kRadPerDeg});
  }
  for (const std::string& link : {s + "elbow_1", s + "wrist_1"}) {
    for (int c = 0; c < 3; ++c) unknowns.push_back({link, c, 0.01});
  }
  // the hand's cover hides a part of it from most sides
  for (int c = 0; c < 3; ++c) unknowns.push_back({wrist_mark(side), c, 0.004});
  return unknowns;
}

Result<Calibration> calibrate(const RobotModel& drawn, const std::string& side,
                              const std::array<PinholeCamera, 2>& cameras, const std::vector<PoseView>& views,
                              const std::vector<Unknown>& unknowns) {
  const auto hand = drawn.hand(side);
  if (!hand) return hand.error();
  if (hand->marks.size() != 2)
    return Error{ErrorCode::kInvalidArgument, "the " + side + " hand has no two marks"};
  if (views.size() < 3) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the hand was seen in {} poses; at least 3 are needed", views.size())};
  }
  for (const PoseView& view : views) {
    if (view.axes_rad.size() != drawn.axis_count() || !view.axes_rad.allFinite())
      return Error{ErrorCode::kInvalidArgument, "the encoders of a pose are not those of this robot"};
  }
  std::vector<int> tips;
  for (const char* const eye : {"left", "right"}) {
    const auto link = drawn.camera_link(eye);
    if (!link) return link.error();
    tips.push_back(*link);
  }
  for (const char* const name : {"knuckle", "wrist"}) {
    for (const HandMark& mark : hand->marks) {
      if (mark.name == name) tips.push_back(mark.link);
    }
  }
  Chain chain(drawn, tips, unknowns);
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    if (!chain.knows(i) || !(unknowns[i].expected > 0))
      return Error{ErrorCode::kInvalidArgument,
                   "link '" + unknowns[i].link + "' moves neither eyes nor hand"};
  }

  const auto n = static_cast<Eigen::Index>(unknowns.size());
  Eigen::VectorXd prior(n);  // 1 / variance
  Eigen::VectorXd step(n);   // of the numeric derivative
  for (Eigen::Index i = 0; i < n; ++i) {
    const double expected = unknowns[static_cast<std::size_t>(i)].expected;
    prior(i) = 1.0 / (expected * expected);
    step(i) = 1e-4 * expected;
  }
  Residuals residuals(std::move(chain), cameras, views, unknowns, drawn);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd r;
  Eigen::VectorXd moved;
  Eigen::MatrixXd J(residuals.size(), n);
  residuals.evaluate(x, r);
  Calibration result;
  double damping = 1e-3;
  for (; result.iterations < kIterations; ++result.iterations) {
    const double scale_px = usual_px(r);
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::VectorXd there = x;
      there(i) += step(i);
      residuals.evaluate(there, moved);
      J.col(i) = (moved - r) / step(i);
    }
    Eigen::VectorXd weight(r.size());
    for (Eigen::Index i = 0; i < r.size(); i += 2)
      weight.segment<2>(i).setConstant(weight_of(r.segment<2>(i).norm(), scale_px) /
                                       (kPixelNoise_px * kPixelNoise_px));
    const Eigen::MatrixXd JtW = J.transpose() * weight.asDiagonal();
    Eigen::MatrixXd H = JtW * J;
    H.diagonal() += prior;
    const Eigen::VectorXd gradient = JtW * r + prior.cwiseProduct(x);
    const double cost = cost_of(r, scale_px) + x.cwiseProduct(prior).dot(x);
    bool better = false;
    Eigen::VectorXd change;
    while (!better && damping < 1e8) {
      Eigen::MatrixXd damped = H;
      damped.diagonal() += damping * H.diagonal();
      change = damped.ldlt().solve(-gradient);
      const Eigen::VectorXd there = x + change;
      residuals.evaluate(there, moved);
      better = cost_of(moved, scale_px) + there.cwiseProduct(prior).dot(there) < cost;
      if (better) {
        x = there;
        r = moved;
        damping = std::max(1e-9, damping / 5.0);
      } else {
        damping *= 4.0;
      }
    }
    if (!better || change.cwiseProduct(prior.cwiseSqrt()).norm() < 1e-6) break;
  }

  const double scale_px = usual_px(r);
  double sum = 0;
  int marks = 0;
  for (Eigen::Index i = 0; i < r.size(); i += 2) {
    const double length = r.segment<2>(i).norm();
    if (length == 0) continue;
    if (length > kWild * scale_px) {
      ++result.wild;
      continue;
    }
    sum += length * length;
    ++marks;
  }
  result.rms_px = marks > 0 ? std::sqrt(sum / marks) : 0.0;
  result.poses = static_cast<int>(views.size());
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    LinkCorrection& correction = result.corrections.links[unknowns[i].link];
    const int c = unknowns[i].component;
    (c < 3 ? correction.p_m(c) : correction.turn_rad(c - 3)) = x(static_cast<Eigen::Index>(i));
  }
  return result;
}

Status save_views(const std::filesystem::path& path, const ViewsFile& file, const std::string& command) {
  if (file.views.empty()) return Error{ErrorCode::kFailed, "the hand was not seen in any pose"};
  learning::WeightsFile out;
  out.command = command;
  const Eigen::Index axes = file.views.front().axes_rad.size();
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(file.views.size()), axes + kPerView);
  for (std::size_t v = 0; v < file.views.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    rows.row(row).head(axes) = file.views[v].axes_rad.transpose();
    for (std::size_t e = 0; e < 2; ++e) {
      for (std::size_t m = 0; m < 2; ++m) {
        // pictures begin at 0: below is no place in one
        rows.row(row).segment<2>(axes + static_cast<Eigen::Index>(4 * e + 2 * m)) =
            file.views[v].mark_px[e][m].value_or(Eigen::Vector2d(-1, -1)).transpose();
      }
    }
  }
  out.matrices["views"] = rows;
  Eigen::MatrixXd cameras(2, 6);
  for (Eigen::Index e = 0; e < 2; ++e) {
    const PinholeCamera& camera = file.cameras[static_cast<std::size_t>(e)];
    cameras.row(e) << camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, camera.width_px,
        camera.height_px;
  }
  out.matrices["cameras"] = cameras;
  return out.save(path.string());
}

Result<ViewsFile> load_views(const std::filesystem::path& path) {
  const auto in = learning::WeightsFile::load(path.string());
  if (!in) return in.error();
  const auto rows = in->matrix("views", -1, -1);
  if (!rows) return Error{rows.error().code, path.string() + ": " + rows.error().message};
  const auto cameras = in->matrix("cameras", 2, 6);
  if (!cameras) return Error{cameras.error().code, path.string() + ": " + cameras.error().message};
  if (rows->cols() <= kPerView)
    return Error{ErrorCode::kInvalidArgument, path.string() + ": matrix 'views' is too narrow"};
  ViewsFile file;
  for (std::size_t e = 0; e < 2; ++e) {
    const auto c = cameras->row(static_cast<Eigen::Index>(e));
    file.cameras[e] = {c(0), c(1), c(2), c(3), static_cast<int>(c(4)), static_cast<int>(c(5))};
  }
  const Eigen::Index axes = rows->cols() - kPerView;
  for (Eigen::Index v = 0; v < rows->rows(); ++v) {
    PoseView view;
    view.axes_rad = rows->row(v).head(axes).transpose();
    for (std::size_t e = 0; e < 2; ++e) {
      for (std::size_t m = 0; m < 2; ++m) {
        const Eigen::Vector2d px =
            rows->row(v).segment<2>(axes + static_cast<Eigen::Index>(4 * e + 2 * m)).transpose();
        if (px.minCoeff() >= 0) view.mark_px[e][m] = px;
      }
    }
    file.views.push_back(std::move(view));
  }
  return file;
}

}  // namespace nido::calibration
