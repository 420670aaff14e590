#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/tools/bench/collapse_bench.h>

#include <algorithm>

#include "timing.h"

namespace fieldmark::bench {
namespace {

bool is_table(const std::string& name) { return name.starts_with("hash/"); }

// Multiplies the networks' parameters or the table.
void multiply(nerf::RadianceField& field, bool table, float factor) {
  for (const auto& entry : field.params.entries()) {
    if (is_table(entry.name) != table) continue;
    for (float& v : field.params.values(field.params.find(entry.name))) v *= factor;
  }
}

// Gives each camera the image of the next.
void shift_images(nerf::Dataset& data) {
  auto& views = data.views;
  for (std::size_t v = 0; v + 1 < views.size(); ++v) {
    std::swap(views[v].rgba, views[v + 1].rgba);
    std::swap(views[v].valid, views[v + 1].valid);
    std::swap(views[v].offsets, views[v + 1].offsets);
  }
}

// Turns every camera by half a turn about its own upward axis.
void turn_away(nerf::Dataset& data) {
  for (nerf::View& view : data.views)
    for (std::size_t row = 0; row < 3; ++row)
      for (const std::size_t column : {std::size_t{0}, std::size_t{2}})
        view.camera.pose[4 * row + column] *= -1;
}

WatchedTraining finished(WatchedTraining row, const nerf::Trainer& trainer, nerf::CollapseWatch& watch) {
  row.steps = trainer.steps();
  row.explained = watch.explained();
  return row;
}

}  // namespace

std::vector<TrainingFault> training_faults() {
  const auto begun_with = [](const char* name, auto damage) { return TrainingFault{name, damage, {}}; };
  const auto struck_by = [](const char* name, auto damage) { return TrainingFault{name, {}, damage}; };
  return {
      begun_with("step size times 1,000",
                 [](nerf::Dataset&, nerf::TrainOptions& o) { o.schedule.lr *= 1000; }),
      begun_with("cameras that look the other way",
                 [](nerf::Dataset& data, nerf::TrainOptions&) { turn_away(data); }),
      begun_with("images of one colour",
                 [](nerf::Dataset& data, nerf::TrainOptions&) {
                   for (nerf::View& v : data.views) std::ranges::fill(v.rgba.data, 1.f);
                 }),
      begun_with("each camera with the image of the next",
                 [](nerf::Dataset& data, nerf::TrainOptions&) { shift_images(data); }),
      struck_by("a weight that is not a number",
                [](nerf::RadianceField& field) {
                  multiply(field, false, std::numeric_limits<float>::quiet_NaN());
                }),
      struck_by("network weights times 100", [](nerf::RadianceField& field) { multiply(field, false, 100); }),
      struck_by("all parameters 0",
                [](nerf::RadianceField& field) { std::ranges::fill(field.params.values(), 0.f); }),
      struck_by("table times 1,000", [](nerf::RadianceField& field) { multiply(field, true, 1000); }),
      struck_by("no occupied cell", [](nerf::RadianceField& field) {
        field.grid.set_bits(std::vector<std::uint8_t>(static_cast<std::size_t>(field.grid.cells())));
      })};
}

WatchedTraining watch_fault(const nerf::Dataset& train, const nerf::Dataset& judge,
                            const TrainingFault& fault, const FaultTimes& times,
                            const std::function<void()>& tick) {
  const double after = fault.before ? 0 : times.after;
  TrainingVariant training = training_variants({.seconds = after + times.patience}, times.seed).front();
  nerf::Dataset damaged = train;
  if (fault.before) fault.before(damaged, training.train);
  WatchedTraining row{.scene = train.name, .what = fault.name, .said = {}};
  nerf::RadianceField field(training.field);
  nerf::Trainer trainer(field, damaged, training.train);
  nerf::CollapseWatch watch(field, judge);
  const double begin = now();
  bool struck = !fault.during;
  double struck_at = after;
  while (row.said.empty() && !trainer.done() && !(struck && now() - begin > struck_at + times.patience)) {
    if (tick) tick();
    if (!struck && now() - begin >= after) {
      fault.during(field);
      struck = true;
      struck_at = now() - begin;
    }
    row.said = watch.look(trainer.steps(), trainer.train_psnr(), now() - begin);
    if (row.said.empty()) trainer.step(now() - begin);
  }
  if (row.said.empty()) row.said = watch.verdict(trainer.steps());
  if (!row.said.empty()) row.noticed_after = now() - begin - struck_at;
  return finished(row, trainer, watch);
}

WatchedTraining watch_ordinary(const nerf::Dataset& train, const nerf::Dataset& judge,
                               const TrainingVariant& training, const std::function<void()>& tick) {
  WatchedTraining row{.scene = train.name, .what = training.name(), .said = {}};
  nerf::RadianceField field(training.field);
  nerf::Trainer trainer(field, train, training.train);
  nerf::CollapseWatch watch(field, judge);
  const double begin = now();
  const auto heard = [&](const std::string& said) {
    if (said.empty() || !row.said.empty()) return;
    row.said = said;
    row.noticed_after = now() - begin;
  };
  while (!trainer.done()) {
    if (tick) tick();
    heard(watch.look(trainer.steps(), trainer.train_psnr(), now() - begin));
    trainer.step(now() - begin);
  }
  heard(watch.verdict(trainer.steps()));
  return finished(row, trainer, watch);
}

}  // namespace fieldmark::bench
