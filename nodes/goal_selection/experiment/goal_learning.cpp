// nido-experiment-goal-learning: trains the goal selection network as the paper did (Table V, Fig. 18) and
// reports.
// --weights FILE also writes the first trial's network: that is how config/weights/goal_selection.txt was
// made.

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "nido/goal_selection/goal_training.h"
#include "nido/launcher/paths.h"
#include "nido/learning/weights_file.h"
#include "nido/report/experiment_cli.h"
#include "nido/report/progress.h"
#include "nido/report/report.h"
#include "nido/report/statistics.h"

namespace nido {
namespace {

struct Request : ExperimentRequest {
  std::string phrases;
  std::string weights;
  long iterations = 50000;
  double rate = 0.07;
  std::size_t held_out = 6;
};

struct Trial {
  GoalTrainingReport all;       // learned from every phrase
  GoalTrainingReport held_out;  // learned without some
};

constexpr double kPaperRmse = 0.0368;

Report make_report(const Request& request, const std::vector<std::optional<Trial>>& trials, double wall_s) {
  Report report;
  report.name = "goal-learning";
  report.title = "Goal selection learns what phrases ask for";
  report.summary =
      "A feed-forward network with 15 hidden units takes seven parameters of the seen object and a code of "
      "the phrase, "
      "and learns by back-propagation which of idle, reach, grasp and drop to choose: one pattern for each "
      "of the 28 "
      "phrases to learn, 28 others to test.";
  report.command =
      fmt::format("nido experiment run goal-learning --seed {} --trials {}", request.seed, request.trials);
  report.seed = request.seed;
  report.wall_s = wall_s;

  std::vector<double> rmse_test;
  std::vector<double> rmse_train;
  std::vector<double> accuracy;
  std::vector<double> idle;
  std::vector<double> held_out;
  Plot curve{"learning-curve", "Fig. 18: error during training", "iteration (one pattern each)", "RMSE"};
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!trials[i]) continue;
    const GoalTrainingReport& all = trials[i]->all;
    rmse_test.push_back(all.rmse_test);
    rmse_train.push_back(all.rmse_train);
    accuracy.push_back(all.accuracy);
    idle.push_back(all.idle_without_speech);
    held_out.push_back(trials[i]->held_out.held_out_accuracy);
    report.trials_detail.push_back({{"seed", static_cast<double>(request.seed + i)},
                                    {"rmse_train", all.rmse_train},
                                    {"rmse_test", all.rmse_test},
                                    {"accuracy", all.accuracy},
                                    {"idle_without_speech", all.idle_without_speech},
                                    {"held_out_accuracy", trials[i]->held_out.held_out_accuracy}});
    if (curve.series.empty()) {
      Series train{"learned patterns"};
      Series test{"test patterns"};
      Series paper{"paper's end", {}, true, true};
      for (const auto& point : all.curve) {
        const auto iteration = static_cast<double>(point.iteration);
        train.points.push_back({iteration, point.train_rmse});
        test.points.push_back({iteration, point.test_rmse});
        paper.points.push_back({iteration, kPaperRmse});
      }
      curve.series = {train, test, paper};
    }
  }
  report.trials = static_cast<long>(rmse_test.size());
  if (!rmse_test.empty()) {
    report.add("rmse_test", median_metric(rmse_test, "", kPaperRmse));
    report.add("rmse_train", median_metric(rmse_train, ""));
    report.add("accuracy", mean_metric(accuracy, ""));
    report.add("idle_without_speech", mean_metric(idle, ""));
    report.add("held_out_accuracy", mean_metric(held_out, ""));
    report.plots.push_back(curve);
  }
  return report;
}

Status run(const Request& request) {
  const auto started = std::chrono::steady_clock::now();
  const auto book = PhraseBook::load(request.phrases);
  if (!book) return book.error();
  const GoalCode code(*book);

  std::vector<std::optional<Trial>> trials(static_cast<std::size_t>(request.trials));
  std::optional<learning::Mlp> first;
  const InterruptFlag interrupt;
  {
    ProgressBar progress("goal-learning", request.trials);
    std::atomic<int> next{0};
    std::mutex mutex;
    int done = 0;
    const auto work = [&] {
      for (int i = next++; i < request.trials && !interrupt.raised(); i = next++) {
        GoalTrainingOptions options{request.iterations, request.rate,
                                    request.seed + static_cast<std::uint64_t>(i), 0};
        GoalTraining all = train_goal_network(code, options);
        options.held_out = request.held_out;
        Trial trial{std::move(all.report), train_goal_network(code, options).report};
        const std::lock_guard lock(mutex);
        trials[static_cast<std::size_t>(i)] = std::move(trial);
        if (i == 0) first = std::move(all.network);
        progress.update(++done);
      }
    };
    std::vector<std::jthread> workers;
    for (int i = 0; i < request.jobs; ++i) workers.emplace_back(work);
  }

  if (!request.weights.empty() && first) {
    learning::WeightsFile file;
    file.command = fmt::format(
        "nido-experiment-goal-learning --seed {} --trials 1 --iterations {} --rate {} --weights FILE",
        request.seed, request.iterations, request.rate);
    first->write_to(file, "goal_selection");
    if (const Status saved = file.save(request.weights); !saved) return saved;
    fmt::print("{}\n", request.weights);
  }
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const Report report = make_report(request, trials, wall_s);
  if (const Status saved = save_and_print(report, request.out); !saved) return saved;
  if (interrupt.raised()) return Error{ErrorCode::kInterrupted, "interrupted: the report has what was done"};
  return {};
}

}  // namespace
}  // namespace nido

int main(int argc, char** argv) {
  nido::Request request;
  request.trials = 10;
  request.jobs = 2;
  request.out = "out/goal-learning";
  CLI::App app("Trains the network that chooses what to do about a phrase.", "nido-experiment-goal-learning");
  app.footer("example\n  nido experiment run goal-learning --seed 3 --trials 20 --out out/goals");
  nido::add_experiment_options(app, request);
  app.add_option("--phrases", request.phrases, "file of the phrases (default: the shipped one)");
  app.add_option("--weights", request.weights, "also write the first trial's network to this file");
  app.add_option("--iterations", request.iterations, "patterns presented in training")
      ->check(CLI::Range(1L, 1000000000L))
      ->capture_default_str();
  app.add_option("--rate", request.rate, "learning rate")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--held-out", request.held_out,
                 "verb-object pairs kept from learning in the second training")
      ->check(CLI::Range(std::size_t{1}, std::size_t{20}))
      ->capture_default_str();
  if (const auto code = nido::parse_experiment(app, argc, argv)) return *code;
  if (request.phrases.empty()) {
    const auto places = nido::find_places();
    if (!places) return nido::end_experiment(places.error());
    request.phrases = (places->config / "phrases.yaml").string();
  }
  return nido::end_experiment(nido::run(request));
}
