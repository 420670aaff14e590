#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/nerf/field_sizing.h>

#include <algorithm>
#include <cmath>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr double kGrowth = 1.75, kFiner = 1.5;
constexpr int kFirstTable = 9, kBase = 16, kMostFinest = 2048;
constexpr Index kMostTrials = 12;
constexpr Index kLeastRays = 128;      // per step: unbounded scenes have hundreds of samples per ray at first
constexpr Index kScout = 256;          // maximum steps for finding empty cells
constexpr Index kAsked = 16;           // steps between two calls of progress
constexpr double kHeaderBytes = 32e3;  // names and metadata of a file, cameras included

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Sets levels from kBase to the finest resolution, and the matching occupancy grid.
void set_resolution(RadianceFieldOptions& field, double finest) {
  HashEncodingOptions& e = field.field.encoding;
  e.base_resolution = std::min(kBase, static_cast<int>(finest));
  e.finest_resolution = finest;
  e.levels = 1 + static_cast<int>(std::lround(std::log(finest / e.base_resolution) / std::log(kGrowth)));
  field.occupancy = finest >= 384 ? 128 : finest >= 160 ? 64 : 32;
}

// Resamples a grid of `from` cells per axis to `to`: 1 where any overlapping cell is 1.
std::vector<std::uint8_t> resampled(std::span<const std::uint8_t> bits, Index from, Index to) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(to * to * to));
  const auto first = [&](Index c) { return c * to / from; };
  const auto end = [&](Index c) { return ((c + 1) * to + from - 1) / from; };
  for (Index z = 0; z < from; ++z)
    for (Index y = 0; y < from; ++y)
      for (Index x = 0; x < from; ++x) {
        if (!bits[static_cast<std::size_t>(x + from * (y + from * z))]) continue;
        for (Index k = first(z); k < end(z); ++k)
          for (Index j = first(y); j < end(y); ++j)
            for (Index i = first(x); i < end(x); ++i)
              out[static_cast<std::size_t>(i + to * (j + to * k))] = 1;
      }
  return out;
}

class Sizing {
 public:
  Sizing(const Dataset& data, const RadianceFieldOptions& start, const SizingOptions& options,
         const std::function<bool(Index, Index)>& progress)
      : data_(data), options_(options), progress_(progress), start_(start) {
    start_.seed = options.seed;
    found_.field = start_;
  }

  FieldSizing run() {
    RadianceField probe(found_.field);
    Trainer scout(probe, data_, short_run());  // places the scene in the cube
    if (probe.space.kind != SpaceKind::cube) find_empty(scout, probe.grid);
    found_.pixels = pixel_resolution(data_, probe.space);
    set_resolution(found_.field, std::clamp(std::floor(kFiner * found_.pixels), 16., double{kMostFinest}));
    grow_table();
    RadianceFieldOptions next = found_.field;
    next.field.directional = false;
    take_away("no viewing direction", next, -options_.worth / 6);
    next = found_.field;
    next.field.width = std::max<Index>(next.field.width / 2, 8);
    next.field.geometry = std::max<Index>(next.field.geometry / 2, 4);
    take_away("networks of half the width", next, options_.worth / 6);
    for (bool taken = true; taken && found_.field.field.encoding.levels > 2;) {
      next = found_.field;
      set_resolution(next, std::floor(next.field.encoding.finest_resolution / kGrowth));
      taken = take_away("without the finest level", next, options_.worth / 2);
    }
    return std::move(found_);
  }

 private:
  TrainOptions short_run() const {
    TrainOptions train;
    train.schedule.steps = options_.steps;
    train.samples_per_step = options_.samples_per_step;
    train.least_rays = kLeastRays;
    train.seed = options_.seed;
    return train;
  }

  bool goes_on() {
    const Index done = std::ssize(found_.trials);
    if (done >= kMostTrials || (progress_ && !progress_(done, kMostTrials))) ended_ = true;
    return !ended_;
  }

  // In an unbounded scene, finding empty cells takes most of a short training, so it is done once for all
  // trials.
  void find_empty(Trainer& scout, const OccupancyGrid& grid) {
    while (scout.steps() < std::min(kScout, options_.steps)) {
      scout.step(0);
      if (scout.steps() % kAsked == 0 && !goes_on()) return;
    }
    seen_.assign(grid.bits().begin(), grid.bits().end());
  }

  // Returns true if the training ran to its end.
  bool attempt(const std::string& what, const RadianceFieldOptions& field) {
    if (ended_ || !goes_on()) return false;
    RadianceField trial(field);
    Trainer trainer(trial, data_, short_run());
    if (!seen_.empty()) trial.grid.restrict_to(resampled(seen_, start_.occupancy, trial.grid.resolution()));
    while (!trainer.done()) {
      trainer.step(0);
      if (trainer.steps() % kAsked == 0 && !goes_on()) return false;
    }
    found_.trials.push_back({.what = what,
                             .field = field,
                             .parameters = trial.params.parameters(),
                             .samples = trainer.samples(),
                             .psnr = trainer.train_psnr()});
    return true;
  }

  void grow_table() {
    double best = -1;
    for (int log2 = kFirstTable;; log2 += 2) {
      const int rows = std::min(log2, options_.most_log2_table);
      RadianceFieldOptions next = found_.field;
      next.field.encoding.log2_table = rows;
      if (!attempt("table of 2^" + std::to_string(rows), next)) {
        found_.field = start_;
        found_.compared = false;
        for (SizingTrial& t : found_.trials) t.kept = false;
        return;
      }
      SizingTrial& trial = found_.trials.back();
      if (trial.psnr < best + options_.worth) return;
      best = trial.psnr;
      keep(trial);
      if (best >= options_.enough || rows == options_.most_log2_table) return;
    }
  }

  // Returns true if the smaller field was kept because it loses at most `loss` dB or is good enough.
  bool take_away(const std::string& what, const RadianceFieldOptions& next, double loss) {
    if (found_.trials.empty() || !attempt(what, next)) return false;
    SizingTrial& trial = found_.trials.back();
    if (trial.psnr < std::min(psnr_ - loss, options_.enough)) return false;
    keep(trial);
    return true;
  }

  void keep(SizingTrial& trial) {
    trial.kept = true;
    psnr_ = trial.psnr;
    found_.field = trial.field;
  }

  const Dataset& data_;
  const SizingOptions& options_;
  const std::function<bool(Index, Index)>& progress_;
  RadianceFieldOptions start_;
  FieldSizing found_;
  std::vector<std::uint8_t> seen_;  // occupied cells of start_'s grid; none: unknown
  double psnr_ = 0;                 // of found_.field
  bool ended_ = false;
};

}  // namespace

std::optional<RadianceFieldOptions> fit_field(RadianceFieldOptions field, double max_bytes) {
  int& log2_table = field.field.encoding.log2_table;
  for (const int least = field.field.kind == FieldKind::mlp ? log2_table : 4; log2_table >= least;
       --log2_table) {
    const RadianceField made(field);
    const double bytes =
        4.0 * static_cast<double>(made.params.size()) + static_cast<double>(made.grid.cells()) / 8;
    if (bytes + kHeaderBytes <= max_bytes) return field;
  }
  return std::nullopt;
}

double pixel_resolution(const Dataset& data, const Space& space) {
  std::vector<double> cells;
  const Bounds& b = space.bounds;
  const Vec3 middle{b.corner[0] + b.side / 2, b.corner[1] + b.side / 2, b.corner[2] + b.side / 2};
  for (const View& v : data.views) {
    if (space.kind == SpaceKind::ndc)
      cells.push_back(v.camera.fx / space.slope_x);
    else if (space.kind == SpaceKind::contracted)
      cells.push_back(4 * v.camera.fx);  // at half an inner side, in a cube of two inner sides
    else
      cells.push_back(b.side * v.camera.fx / norm(v.camera.position() - middle));
  }
  return median(std::move(cells));
}

FieldSizing size_field(const Dataset& data, const RadianceFieldOptions& start, const SizingOptions& options,
                       const std::function<bool(Index, Index)>& progress) {
  if (start.field.kind != FieldKind::hash)
    throw ValueError("[size_field] start must be a hash field, got an mlp field");
  if (options.steps < 64 || !(options.worth > 0) || options.most_log2_table < kFirstTable ||
      options.most_log2_table > 24)
    throw ValueError(
        "[size_field] options must have at least 64 steps, a positive worth and a table of 2^9 to "
        "2^24 at most, got " +
        std::to_string(options.steps) + " steps, " + number_text(options.worth) + " dB and 2^" +
        std::to_string(options.most_log2_table));
  return Sizing(data, start, options, progress).run();
}

}  // namespace fieldmark::nerf
