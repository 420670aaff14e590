#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/tools/bench/training_bench.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "timing.h"
#include "training_loop.h"

namespace fieldmark::bench {
namespace {

constexpr double kTurn = 0.5;  // seconds

// A variant in training, with its own clock.
struct Run {
  const TrainingVariant& variant;
  nerf::RadianceField field;
  std::optional<nerf::Trainer> trainer;
  double seconds = 0;

  Run(const TrainingVariant& v, const nerf::Dataset& train) : variant(v), field(v.field) {
    timed([&](auto) { trainer.emplace(field, train, v.train); });
  }
  // Runs the clock during work(clock); clock() returns its time.
  template <class F>
  void timed(F work) {
    const double begin = now() - seconds;
    const auto clock = [begin] { return now() - begin; };
    work(clock);
    seconds = clock();
  }
  void take_turn() {
    const double until = seconds + kTurn;
    timed([&](auto clock) {
      while (!trainer->done() && clock() < until) trainer->step(clock());
    });
  }
  double part() const {
    return trainer->done() ? 1 : part_done(variant.train.schedule, trainer->steps(), seconds);
  }
  TrainingRow judged(const nerf::Dataset& judge) const {
    nerf::Renderer renderer(field);
    const nerf::Evaluation evaluation = nerf::evaluate(renderer, judge);
    return {.variant = variant,
            .steps = trainer->steps(),
            .samples = trainer->samples(),
            .seconds = seconds,
            .psnr = evaluation.psnr,
            .seconds_per_view = evaluation.seconds_per_view};
  }
};

double mean_part(const std::vector<std::unique_ptr<Run>>& runs) {
  double sum = 0;
  for (const auto& run : runs) sum += run->part();
  return sum / static_cast<double>(runs.size());
}

}  // namespace

std::vector<TrainingRow> run_training_bench(const nerf::Dataset& train, const nerf::Dataset& judge,
                                            const std::vector<TrainingVariant>& variants,
                                            const std::function<void(const std::string&, double)>& progress) {
  std::vector<std::unique_ptr<Run>> runs;
  runs.reserve(variants.size());
  for (const TrainingVariant& v : variants) runs.push_back(std::make_unique<Run>(v, train));
  for (bool more = true; more;) {
    more = false;
    for (const auto& run : runs) {
      if (progress) progress(run->variant.name(), mean_part(runs));
      run->take_turn();
      more = more || !run->trainer->done();
    }
  }
  std::vector<TrainingRow> rows;
  rows.reserve(runs.size());
  for (const auto& run : runs) rows.push_back(run->judged(judge));
  return rows;
}

}  // namespace fieldmark::bench
