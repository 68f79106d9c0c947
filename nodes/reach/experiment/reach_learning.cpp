// nido-experiment-reach-learning: motor babbling through ports and eyes, then the paper's network (Table II,
// Fig. 6-8) and the model of where the eyes see the hand. --weights DIR writes the files that nido-reach
// uses.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "nido/experiment/domain.h"
#include "nido/experiment/kept.h"
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
  int body_samples = 1000;  // of arm, wrist and torso, for the model of the seen hand
  std::string from;         // folder with samples of an earlier run
  std::string weights;      // folder for the weights
  std::string urdf;
  std::string hand = "right";
  long iterations = 50000;
  double rate = 0.05;
  int domain = kFreeDomain;
};

constexpr double kPaperRmse = 0.156;
constexpr int kShown = 150;  // positions and test samples in the paper's figures 6 and 8
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
      "--set rate={} --set weights=config/weights{}",
      request.seed, request.samples, request.body_samples, request.iterations, request.rate,
      request.hand == "right" ? "" : " --hand " + request.hand);
}

// One robot that babbles, with eyes of its own, in a DDS domain of its own.
struct Babble {
  std::string name;  // of its folder, log and samples
  int samples = 0;
  bool whole_body = false;
  std::uint64_t seed = 1;
};

// Learned and tested samples come from different seeds.
std::vector<Babble> babbles(const Request& request) {
  return {{"babbling_learn", request.samples / 2, false, request.seed},
          {"babbling_test", request.samples - request.samples / 2, false, request.seed + 1000},
          {"babbling_body", request.body_samples, true, request.seed + 2000}};
}

std::filesystem::path samples_file(const std::filesystem::path& folder, const Babble& babble) {
  return folder / (babble.name + ".txt");
}

std::filesystem::path log_of(const std::filesystem::path& folder, const Babble& babble) {
  return folder / babble.name / "logs" / "reach.log";
}

Result<LaunchedApp> start(const Request& request, const Babble& babble, int domain) {
  const std::filesystem::path out = std::filesystem::absolute(request.out);
  std::error_code absent;
  std::filesystem::remove(log_of(out, babble), absent);  // of an earlier run: it would be taken for progress
  return LaunchedApp::start(
      "reach_babbling",
      in_lockstep(babble.seed,
                  {"--hand", request.hand, "--domain", std::to_string(domain), "--out",
                   (out / babble.name).string(), "--set", fmt::format("reach.samples={}", babble.samples),
                   "--set", fmt::format("reach.whole_body={}", babble.whole_body), "--set",
                   fmt::format("reach.samples_file={}", samples_file(out, babble).string())}),
      (out / (babble.name + ".log")).string());
}

// What a babbling robot has gathered so far, from its log ("babbling: 300 of 2500 samples").
long gathered(const std::filesystem::path& log_file) {
  std::ifstream log(log_file);
  long last = 0;
  for (std::string line; std::getline(log, line);) {
    const std::size_t at = line.find("babbling: ");
    if (at != std::string::npos) last = std::max(last, std::atol(line.c_str() + at + 10));
  }
  return last;
}

// Robots babble, `jobs` of them at once, until all samples are there.
Status babble(const Request& request) {
  const std::vector<Babble> all = babbles(request);
  long wanted = 0;
  for (const Babble& babble : all) wanted += babble.samples;
  ProgressBar progress("babbling", wanted);
  const auto domains = take_domains(request.domain, static_cast<int>(all.size()));
  if (!domains) return domains.error();
  std::vector<std::optional<LaunchedApp>> apps(all.size());
  std::size_t next = 0;
  std::size_t done = 0;
  while (done < all.size()) {
    while (next < all.size() && next - done < static_cast<std::size_t>(request.jobs)) {
      auto app = start(request, all[next], (*domains)[next].number());
      if (!app) return app.error();
      apps[next++].emplace(std::move(*app));
    }
    for (auto& app : apps) {
      const auto ended = app ? app->poll() : std::nullopt;
      if (!ended) continue;
      if (!*ended) return *ended;  // the others are interrupted with the list
      app.reset();
      ++done;
    }
    long sum = 0;
    for (std::size_t i = 0; i < next; ++i) {
      sum += apps[i] ? gathered(log_of(request.out, all[i])) : all[i].samples;
    }
    progress.update(sum, "sightings of the hand");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return {};
}

Result<Samples> gather(const Request& request) {
  const std::filesystem::path folder = request.from.empty() ? request.out : request.from;
  if (request.from.empty()) {
    if (Status done = babble(request); !done) return done.error();
  }
  const std::vector<Babble> all = babbles(request);
  auto learn = load_samples(samples_file(folder, all[0]));
  if (!learn) return learn.error();
  auto test = load_samples(samples_file(folder, all[1]));
  if (!test) return test.error();
  auto body = load_samples(samples_file(folder, all[2]));
  if (!body) return body.error();
  // the network learns from the first half
  const std::size_t half = std::min(learn->size(), test->size());
  learn->resize(half);
  test->resize(half);
  learn->insert(learn->end(), test->begin(), test->end());
  return Samples{std::move(*learn), std::move(*body)};
}

std::vector<Plot> cloud_plots(const std::vector<BabblingSample>& samples) {
  Plot top{"babbling-cloud-top", "Fig. 6: where the hand was seen while babbling, from above",
           "to the right (m)", "forward (m)"};
  Plot front{"babbling-cloud-front", "Fig. 6: the same from behind the robot", "to the right (m)", "up (m)"};
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
  Plot curve{"learning-curve", "Fig. 7: error of the paper's network during training",
             "iteration (a pass over the learned samples)", "RMSE"};
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
    Plot trace{fmt::format("joint-{}", joint), fmt::format("Fig. 8: test samples, {}", kJointNames[joint]),
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

// What one training gave.
struct Trained {
  std::uint64_t seed = 0;
  Result<void> status;
  std::optional<PostureNetwork> network;
  PostureNetwork::TrainingReport report;
  double rmse_test_pattern = 0.0;  // with one pattern an iteration instead of a pass
};

// Trains `trials` networks from different first weights, `jobs` at once; those that are complete when
// interrupted.
Result<std::vector<Trained>> train(const Request& request, const ArmChain& chain,
                                   const std::vector<BabblingSample>& samples) {
  const InterruptFlag interrupt;
  std::vector<Trained> all(static_cast<std::size_t>(request.trials));
  std::atomic<std::size_t> next = 0;
  std::atomic<long> passes = 0;
  std::atomic<std::size_t> ended = 0;
  const long report_every = std::max(1L, request.iterations / 100);
  const auto work = [&] {
    for (std::size_t i = next++; i < all.size(); i = next++) {
      Trained& trial = all[i];
      trial.seed = request.seed + i;
      const learning::OnlineOptions options{request.iterations, request.rate, trial.seed, report_every};
      PostureNetwork::TrainingReport by_pattern;
      auto pattern =
          PostureNetwork::train(chain, samples, options, PostureNetwork::Iteration::kPattern, &by_pattern);
      trial.rmse_test_pattern = by_pattern.rmse_test;
      auto trained = PostureNetwork::train(chain, samples, options, PostureNetwork::Iteration::kPass,
                                           &trial.report, [&](const learning::CurvePoint& point) {
                                             if (point.iteration > 0) passes += report_every;
                                             return !interrupt.raised();
                                           });
      if (!trained) {
        trial.status = trained.error();
      } else if (!interrupt.raised()) {
        trial.network = std::move(*trained);
      }
      ++ended;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int job = 0; job < std::min(request.jobs, request.trials); ++job) workers.emplace_back(work);
    ProgressBar progress("training", request.iterations * request.trials);
    while (ended < all.size()) {
      progress.update(passes, "passes");
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    progress.update(passes, "passes");
  }
  for (const Trained& trial : all) {
    if (!trial.status) return trial.status.error();
  }
  std::erase_if(all, [](const Trained& trial) { return !trial.network; });
  if (all.empty()) return Error{ErrorCode::kInterrupted, "interrupted before anything was learned"};
  return all;
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
  for (const auto& [file, name] : {std::pair(&posture_file, weights_file("reach_posture", request.hand)),
                                   std::pair(&hand_file, weights_file("reach_hand", request.hand))}) {
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
  auto body = load_body(request.urdf, "", request.hand);
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
      "place, an "
      "iteration is a pass over the learned half of the samples; the other half, babbled with another seed, "
      "tests it. A second model learns where the eyes "
      "see the hand for a "
      "posture, with the body's known geometry as prior: that one makes the hand arrive.";
  report.command = command_line(request);
  report.seed = request.seed;
  report.robot = "icub_sim";
  report.world = "empty";

  auto trained = train(request, body->chain, samples->arm);
  if (!trained) return trained.error();
  std::vector<double> rmse_test;
  std::vector<double> rmse_train;
  std::vector<double> rmse_pattern;
  std::vector<std::vector<double>> rmse_joint(PostureNetwork::kOutputs);
  for (const Trained& trial : *trained) {
    rmse_test.push_back(trial.report.rmse_test);
    rmse_train.push_back(trial.report.rmse_train);
    rmse_pattern.push_back(trial.rmse_test_pattern);
    Row row = {{"seed", static_cast<double>(trial.seed)},
               {"rmse_train", trial.report.rmse_train},
               {"rmse_test", trial.report.rmse_test},
               {"rmse_test.one_pattern_an_iteration", trial.rmse_test_pattern}};
    for (int joint = 0; joint < PostureNetwork::kOutputs; ++joint) {
      rmse_joint[static_cast<std::size_t>(joint)].push_back(trial.report.rmse_joint(joint));
      row.emplace_back(fmt::format("rmse_joint[{}]", joint), trial.report.rmse_joint(joint));
    }
    report.trials_detail.push_back(row);
  }
  const std::optional<PostureNetwork>& network = trained->front().network;
  report.plots = network_plots(trained->front().report);
  SeenHandModel::TrainingReport seen;
  SeenHandModel::TrainingOptions seen_options;
  seen_options.seed = request.seed;
  const auto hand = SeenHandModel::train(body->chain, samples->body, seen_options, &seen);
  if (!hand) return hand.error();

  report.trials = static_cast<long>(rmse_test.size());
  report.add("rmse_test", median_metric(rmse_test, "", kPaperRmse));
  report.add("rmse_test.one_pattern_an_iteration", median_metric(rmse_pattern, "", kPaperRmse));
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
  return save_and_print(report, request.out);
}

}  // namespace
}  // namespace nido::reach

int main(int argc, char** argv) {
  nido::reach::Request request;
  request.trials = 2;
  request.jobs = 2;
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
  app.add_option("--weights", request.weights, "folder to write the weights of reach to");
  nido::add_hand_option(app, request.hand);
  app.add_option("--iterations", request.iterations, "passes over the learned samples in training")
      ->check(CLI::Range(1L, 1000000000L))
      ->capture_default_str();
  app.add_option("--rate", request.rate, "learning rate")->check(CLI::PositiveNumber)->capture_default_str();
  nido::add_domain_option(app, request.domain);
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  const auto places = nido::find_places();
  if (!places) return nido::end_experiment(places.error());
  request.urdf = (places->config / "robots" / "icub.urdf").string();
  return nido::end_experiment(nido::reach::run(request));
}
