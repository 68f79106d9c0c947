// nido-experiment-reach-learning: motor babbling through ports and eyes, then the paper's network (Table II,
// Fig. 6-8) and the model of where the eyes see the hand. --weights DIR writes the files that nido-reach
// uses.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>

#include "nido/experiment/launched_app.h"
#include "nido/launcher/paths.h"
#include "nido/reach/babbling.h"
#include "nido/reach/posture_network.h"
#include "nido/reach/seen_hand.h"
#include "nido/reach/settings.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"

namespace nido::reach {
namespace {

struct Request : ExperimentRequest {
  int samples = 5000;       // of the arm alone, for the paper's network
  int body_samples = 2000;  // of arm, wrist and torso, for the model of the seen hand
  std::string from;         // folder with samples of an earlier run
  std::string weights;      // folder for the weights
  std::string urdf;
  std::string side = "right";
  long iterations = 50000;
  double rate = 0.05;
  int domain = 50;
};

constexpr double kPaperRmse = 0.156;
constexpr int kShown = 150;  // positions and test samples in the paper's figures 6 and 8
constexpr const char* kArmFile = "babbling_arm.txt";
constexpr const char* kBodyFile = "babbling_body.txt";
const char* const kJointNames[] = {"shoulder pitch", "shoulder roll", "shoulder yaw", "elbow",
                                   "wrist pronosupination"};

struct Samples {
  std::vector<BabblingSample> arm;
  std::vector<BabblingSample> body;
};

std::string command_line(const Request& request) {
  return fmt::format(
      "nido experiment run reach-learning --seed {} --set samples={} --set body-samples={} --set "
      "iterations={} "
      "--set rate={} --set weights=config/weights",
      request.seed, request.samples, request.body_samples, request.iterations, request.rate);
}

// Lets robot, vision and reach babble until the file is there.
Status babble(const Request& request, const std::string& file, int samples, bool whole_body) {
  const std::filesystem::path out = request.out;
  const std::string run = whole_body ? "babbling_body" : "babbling_arm";
  fmt::print("babbling {}: {} sightings of the hand\n",
             whole_body ? "with arm, wrist and torso" : "with the arm", samples);
  std::fflush(stdout);
  const std::filesystem::path absolute = std::filesystem::absolute(out);
  return run_app(
      "reach_babbling",
      {"--seed", std::to_string(request.seed + (whole_body ? 1000 : 0)), "--rate", "max", "--lockstep",
       "--domain", std::to_string(request.domain), "--out", (absolute / run).string(), "--set",
       fmt::format("reach.samples={}", samples), "--set", fmt::format("reach.whole_body={}", whole_body),
       "--set", fmt::format("reach.side={}", request.side), "--set",
       fmt::format("reach.samples_file={}", (absolute / file).string())},
      (out / (run + ".log")).string());
}

Result<Samples> gather(const Request& request) {
  const std::filesystem::path folder = request.from.empty() ? request.out : request.from;
  if (request.from.empty()) {
    if (Status done = babble(request, kArmFile, request.samples, false); !done) return done.error();
    if (Status done = babble(request, kBodyFile, request.body_samples, true); !done) return done.error();
  }
  auto arm = load_samples(folder / kArmFile);
  if (!arm) return arm.error();
  auto body = load_samples(folder / kBodyFile);
  if (!body) return body.error();
  return Samples{std::move(*arm), std::move(*body)};
}

std::vector<Plot> cloud_plots(const std::vector<BabblingSample>& samples) {
  Plot top{"babbling-cloud-top", "Where the hand was seen while babbling, from above", "to the right (m)",
           "forward (m)"};
  Plot front{"babbling-cloud-front", "The same from behind the robot", "to the right (m)", "up (m)"};
  Series all_top{"all", {}, false};
  Series all_front{"all", {}, false};
  Series first_top{fmt::format("first {}", kShown), {}, false};
  Series first_front = first_top;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d& p = samples[i].p_Root_m;
    (i < kShown ? first_top : all_top).points.push_back({p.y(), -p.x()});
    (i < kShown ? first_front : all_front).points.push_back({p.y(), p.z()});
  }
  top.series = {all_top, first_top};
  front.series = {all_front, first_front};
  top.equal_scales = front.equal_scales = true;
  return {top, front};
}

std::vector<Plot> network_plots(const PostureNetwork::TrainingReport& training) {
  Plot curve{"learning-curve", "Error of the paper's network during training", "iteration (one pattern each)",
             "RMSE"};
  Series train{"learned samples"};
  Series test{"test samples"};
  Series paper{"paper's end", {}, true, true};
  for (const auto& point : training.curve) {
    const auto iteration = static_cast<double>(point.iteration);
    train.points.push_back({iteration, point.train_rmse});
    test.points.push_back({iteration, point.test_rmse});
    paper.points.push_back({iteration, kPaperRmse});
  }
  curve.series = {train, test, paper};
  std::vector<Plot> plots = {curve};
  for (int joint = 0; joint < PostureNetwork::kOutputs; ++joint) {
    Plot trace{fmt::format("joint-{}", joint), fmt::format("Test samples: {}", kJointNames[joint]),
               "test sample", "angle, 0..1 of its range"};
    trace.y_range = {0.0, 1.0};
    Series wanted{"babbled"};
    Series given{"network"};
    for (Eigen::Index i = 0; i < std::min<Eigen::Index>(kShown, training.test_targets.cols()); ++i) {
      wanted.points.push_back({static_cast<double>(i), training.test_targets(joint, i)});
      given.points.push_back({static_cast<double>(i), training.test_outputs(joint, i)});
    }
    trace.series = {wanted, given};
    plots.push_back(trace);
  }
  return plots;
}

Status write_weights(const Request& request, const PostureNetwork& network, const SeenHandModel& hand) {
  const std::filesystem::path folder = request.weights;
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  learning::WeightsFile posture_file;
  posture_file.command = command_line(request);
  network.write_to(posture_file);
  learning::WeightsFile hand_file;
  hand_file.command = posture_file.command;
  hand.write_to(hand_file);
  for (const auto& [file, name] :
       {std::pair(&posture_file, "reach_posture.txt"), std::pair(&hand_file, "reach_hand.txt")}) {
    if (const Status saved = file->save((folder / name).string()); !saved) return saved;
    fmt::print("{}\n", (folder / name).string());
  }
  return {};
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  std::error_code failure;
  std::filesystem::create_directories(request.out, failure);
  if (failure) return Error{ErrorCode::kFailed, request.out + ": " + failure.message()};
  auto body = load_body(request.urdf, request.side);
  if (!body) return body.error();
  auto samples = gather(request);
  if (!samples) return samples.error();

  Report report;
  report.name = "reach-learning";
  report.title = "Learning to reach from motor babbling";
  report.summary =
      "The robot moves its arm at random and sees, through both eyes, where the mark on its hand is. The "
      "paper's network "
      "(3 inputs, 10 hidden, 5 outputs) learns by on-line back-propagation which angles belong to which "
      "place, one sample an "
      "iteration, from half of the samples; the other half tests it. A second model learns where the eyes "
      "see the hand for a "
      "posture, with the body's known geometry as prior: that one makes the hand arrive.";
  report.command = command_line(request);
  report.seed = request.seed;
  report.robot = "icub_sim";
  report.world = "empty";

  std::vector<double> rmse_test;
  std::vector<double> rmse_train;
  std::vector<std::vector<double>> rmse_joint(PostureNetwork::kOutputs);
  std::optional<PostureNetwork> network;
  const InterruptFlag interrupt;
  {
    ProgressBar progress("training", request.trials);
    for (int trial = 0; trial < request.trials && !interrupt.raised(); ++trial) {
      PostureNetwork::TrainingReport training;
      const learning::OnlineOptions options{request.iterations, request.rate,
                                            request.seed + static_cast<std::uint64_t>(trial)};
      auto trained = PostureNetwork::train(body->chain, samples->arm, options, &training);
      if (!trained) return trained.error();
      rmse_test.push_back(training.rmse_test);
      rmse_train.push_back(training.rmse_train);
      Row row = {{"seed", static_cast<double>(options.seed)},
                 {"rmse_train", training.rmse_train},
                 {"rmse_test", training.rmse_test}};
      for (int joint = 0; joint < PostureNetwork::kOutputs; ++joint) {
        rmse_joint[static_cast<std::size_t>(joint)].push_back(training.rmse_joint(joint));
        row.emplace_back(fmt::format("rmse_joint[{}]", joint), training.rmse_joint(joint));
      }
      report.trials_detail.push_back(row);
      if (trial == 0) {
        network = std::move(*trained);
        report.plots = network_plots(training);
      }
      progress.update(trial + 1);
    }
  }
  if (!network) return Error{ErrorCode::kInterrupted, "interrupted before anything was learned"};
  SeenHandModel::TrainingReport seen;
  SeenHandModel::TrainingOptions seen_options;
  seen_options.seed = request.seed;
  const auto hand = SeenHandModel::train(body->chain, samples->body, seen_options, &seen);
  if (!hand) return hand.error();

  report.trials = static_cast<long>(rmse_test.size());
  report.add("rmse_test", median_metric(rmse_test, "", kPaperRmse));
  report.add("rmse_train", median_metric(rmse_train, ""));
  for (int joint = 0; joint < PostureNetwork::kOutputs; ++joint) {
    report.add(fmt::format("rmse_joint[{}]", joint),
               median_metric(rmse_joint[static_cast<std::size_t>(joint)], ""));
  }
  const auto count = static_cast<double>(samples->arm.size());
  report.add("samples", {count, "", static_cast<long>(count)});
  report.add("seen_hand_rms_m.geometry_alone", {seen.prior_rms_m, "m", static_cast<long>(seen.used / 2)});
  report.add("seen_hand_rms_m.learned", {seen.learned_rms_m, "m", static_cast<long>(seen.used / 2)});
  report.add("wrong_sightings",
             {static_cast<double>(seen.outliers), "", static_cast<long>(seen.used + seen.outliers)});
  for (Plot& plot : cloud_plots(samples->arm)) report.plots.push_back(std::move(plot));
  if (!request.weights.empty()) {
    if (const Status written = write_weights(request, *network, *hand); !written) return written;
  }
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (const Status saved = report.save(request.out); !saved) return saved;
  for (const auto& [name, metric] : report.metrics) {
    fmt::print("{:<32} {:.4f} {}{}\n", name, metric.value, metric.unit,
               metric.paper ? fmt::format("  [paper {}]", *metric.paper) : "");
  }
  fmt::print("{}/report.html\n", request.out);
  return {};
}

}  // namespace
}  // namespace nido::reach

int main(int argc, char** argv) {
  nido::reach::Request request;
  request.trials = 10;
  request.out = "out/reach-learning";
  CLI::App app("Motor babbling through the eyes, and what is learned from it.",
               "nido-experiment-reach-learning");
  app.footer("example\n  nido experiment run reach-learning --seed 1 --set samples=5000 --out out/reach");
  nido::add_experiment_options(app, request);
  app.add_option("--samples", request.samples, "sightings with the arm alone, for the paper's network")
      ->check(CLI::Range(100, 1000000))
      ->capture_default_str();
  app.add_option("--body-samples", request.body_samples, "sightings with arm, wrist and torso")
      ->check(CLI::Range(200, 1000000))
      ->capture_default_str();
  app.add_option("--from", request.from, "folder of an earlier run whose samples are used again");
  app.add_option("--weights", request.weights, "folder to write reach_posture.txt and reach_hand.txt to");
  app.add_option("--side", request.side, "right or left")
      ->check(CLI::IsMember({"right", "left"}))
      ->capture_default_str();
  app.add_option("--iterations", request.iterations, "patterns presented in training")
      ->check(CLI::Range(1L, 1000000000L))
      ->capture_default_str();
  app.add_option("--rate", request.rate, "learning rate")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--domain", request.domain, "DDS domain of the babbling")
      ->check(CLI::Range(0, 101))
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  const auto places = nido::find_places();
  if (!places) return nido::end_experiment(places.error());
  request.urdf = (places->config / "robots" / "icub.urdf").string();
  return nido::end_experiment(nido::reach::run(request));
}
