#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/tools/bench/training_bench.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>

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
  std::string name() const { return variant.choice + ": " + variant.setting; }
  // Runs the clock during work(now); now() returns its time.
  template <class F>
  void timed(F work) {
    const auto begin = std::chrono::steady_clock::now();
    const auto now = [&, before = seconds] {
      return before + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    work(now);
    seconds = now();
  }
  void take_turn() {
    const double until = seconds + kTurn;
    timed([&](auto now) {
      while (!trainer->done() && now() < until) trainer->step(now());
    });
  }
  double part() const {
    if (trainer->done()) return 1;
    const ScheduleOptions& length = variant.train.schedule;
    return length.steps > 0 ? static_cast<double>(trainer->steps()) / static_cast<double>(length.steps)
                            : std::min(1.0, seconds / length.seconds);
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

std::vector<TrainingVariant> training_variants(const ScheduleOptions& schedule, std::uint64_t seed) {
  TrainingVariant base{
      "default", "as trained", nerf::field_options(schedule), {.schedule = schedule, .seed = seed}};
  base.field.seed = seed;
  std::vector<TrainingVariant> all{base};
  const auto vary = [&](const char* choice, const char* setting, auto change) {
    TrainingVariant v = base;
    v.choice = choice;
    v.setting = setting;
    change(v);
    all.push_back(std::move(v));
  };
  vary("batch", "24576 samples from the first step on",
       [](TrainingVariant& v) { v.train.first_samples = v.train.samples_per_step; });
  vary("batch", "6144 samples to the end, every level stepped each time",
       [](TrainingVariant& v) { v.train.samples_per_step = v.train.first_samples; });
  vary("batch", "3072 samples at first", [](TrainingVariant& v) { v.train.first_samples = 3072; });
  vary("learning rate", "no last part that falls", [](TrainingVariant& v) { v.train.schedule.last = 1; });
  vary("learning rate", "no decay before the last part",
       [](TrainingVariant& v) { v.train.schedule.half_after = 1e12; });
  vary("learning rate", "half", [](TrainingVariant& v) { v.train.schedule.lr /= 2; });
  vary("hard pixels", "off", [](TrainingVariant& v) { v.train.hard_pixels = 0; });
  vary("hard pixels", "every ray", [](TrainingVariant& v) { v.train.hard_pixels = 1; });
  vary("distortion loss", "weight 1e-3", [](TrainingVariant& v) { v.train.distortion = 1e-3; });
  vary("distortion loss", "weight 1e-2", [](TrainingVariant& v) { v.train.distortion = 1e-2; });
  vary("pixels", "means of 2 x 2 rays after 1000 steps, rendered so", [](TrainingVariant& v) {
    v.field.supersampling = 2;
    v.train.supersample_after = 1000;
  });
  vary("table decay", "off", [](TrainingVariant& v) { v.train.table_decay = 0; });
  vary("table decay", "from the first step on", [](TrainingVariant& v) { v.train.decay_after = 0; });
  vary("loss", "plain square",
       [](TrainingVariant& v) { v.train.huber = std::numeric_limits<double>::infinity(); });
  vary("early stop", "rays end at a transmittance of 1e-4", [](TrainingVariant& v) { v.train.stop = 1e-4f; });
  vary("silhouettes", "not used", [](TrainingVariant& v) { v.train.carve = false; });
  vary("model", "table of 2^16", [](TrainingVariant& v) { v.field.field.encoding.log2_table = 16; });
  vary("model", "table of 2^18, finest level of 768: the default of longer runs", [](TrainingVariant& v) {
    v.field.field.encoding.log2_table = 18;
    v.field.field.encoding.finest_resolution = 768;
  });
  vary("model", "networks of 64", [](TrainingVariant& v) { v.field.field.width = 64; });
  return all;
}

std::vector<TrainingRow> run_training_bench(const nerf::Dataset& train, const nerf::Dataset& judge,
                                            const std::vector<TrainingVariant>& variants,
                                            const std::function<void(const std::string&, double)>& progress) {
  std::vector<std::unique_ptr<Run>> runs;
  runs.reserve(variants.size());
  for (const TrainingVariant& v : variants) runs.push_back(std::make_unique<Run>(v, train));
  for (bool more = true; more;) {
    more = false;
    for (const auto& run : runs) {
      if (progress) progress(run->name(), mean_part(runs));
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
