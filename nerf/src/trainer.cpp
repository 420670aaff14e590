#include <fieldmark/core/digest.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/distortion_loss.h>
#include <fieldmark/nerf/photometric_loss.h>
#include <fieldmark/nerf/trainer.h>
#include "scene_space.h"
#include "silhouettes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "image_corrections.h"
#include "trainer_shard.h"

namespace fieldmark::nerf {
namespace {

constexpr int kShards = 32;             // a few chunks each, so that threads wait little for the last
constexpr int kMlpShards = 8;           // few, because each holds the gradients of two large networks
constexpr Index kRays = 64;             // of a chunk
constexpr Index kOccupancyPeriod = 16;  // steps
constexpr Index kMostRays = 1 << 16;
constexpr Index kPosesAfter = 100;  // steps: a field that shows nothing yet would mislead the cameras
constexpr Index kShortSteps = 8000, kLongSteps = 20000;  // of a run, see field_options()
constexpr double kShortSeconds = 120, kLongSeconds = 400;

AdamOptions adam_options(const RadianceField& field) {
  if (field.coarse) return {.lr = 1, .beta2 = 0.999, .eps = 1e-8, .zero_grads = true};
  return {.lr = 1, .beta2 = 0.99, .eps = 1e-15, .zero_grads = true};  // as Mueller et al. 2022 for tables
}

// Returns the number of parameters whose gradients the loop sums: all of an mlp field, the networks of a hash
// field.
Index loop_size(const RadianceField& field) {
  return field.coarse ? field.params.size() : field.field.network_size();
}

// Computes the places of samples along their rays by summing the distances between consecutive positions.
void fill_middles(const RaySamples& s, float* middle) {
  for (std::size_t r = 0; r + 1 < s.ray_begin.size(); ++r) {
    float way = 0;
    for (Index i = s.ray_begin[r]; i < s.ray_begin[r + 1]; ++i) {
      if (i > s.ray_begin[r]) {
        const float *a = &s.position[at(3 * i - 3)], *b = &s.position[at(3 * i)];
        way += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
      }
      middle[i] = way;
    }
  }
}

void must(bool holds, const char* rule, auto value) {
  if (!holds) throw ValueError(std::string("[trainer] ") + rule + ", got " + number_text(value));
}

void check(const TrainOptions& o, const RadianceField& field) {
  must(o.samples_per_step >= 1024, "samples_per_step must be at least 1024", o.samples_per_step);
  must(o.first_samples >= 1024, "first_samples must be at least 1024", o.first_samples);
  must(o.least_rays >= kRays && o.least_rays <= kMostRays && o.least_rays % kRays == 0,
       "least_rays must be a multiple of 64, 64 to 65536", o.least_rays);
  must(o.grow_after > 0, "grow_after must be positive", o.grow_after);
  must(o.stop >= 0 && o.stop < 1, "stop must be in [0, 1)", o.stop);
  must(o.distortion >= 0 && std::isfinite(o.distortion), "distortion must be at least 0", o.distortion);
  must(o.table_decay >= 0 && std::isfinite(o.table_decay), "table_decay must be at least 0", o.table_decay);
  must(o.decay_after >= 0, "decay_after must be at least 0", o.decay_after);
  must(o.supersample_after >= 0, "supersample_after must be at least 0", o.supersample_after);
  must(o.hard_pixels >= 0 && o.hard_pixels <= 1, "hard_pixels must be in [0, 1]", o.hard_pixels);
  if (field.coarse && field.options().supersampling > 1)
    throw ValueError("[trainer] field must be a hash field to have supersampling, got an mlp field");
  if (field.coarse && (o.refine_poses || o.freeze))
    throw ValueError(
        "[trainer] field must be a hash field to refine poses or to be frozen, got an mlp field");
  if (o.freeze && !(o.keep && (o.image_colours || o.refine_poses)))
    throw ValueError("[trainer] freeze needs keep, and image_colours or refine_poses to learn");
}

}  // namespace

TrainOptions train_options(FieldKind kind) {
  TrainOptions options;
  if (kind == FieldKind::mlp) {
    options.schedule = {.lr = 5e-4, .half_after = 1e9, .cooldown = 0.9, .last = 0.1};
    options.samples_per_step = 6144;
  }
  return options;
}

RadianceFieldOptions field_options(const ScheduleOptions& length) {
  RadianceFieldOptions options;
  HashEncodingOptions& e = options.field.encoding;
  const bool by_steps = length.steps > 0;
  if (by_steps ? length.steps <= kShortSteps : length.seconds <= kShortSeconds) {
    e.log2_table = 17;
    e.finest_resolution = 512;
  } else if (by_steps ? length.steps > kLongSteps : length.seconds > kLongSeconds) {
    e.log2_table = 19;
    e.finest_resolution = 1024;
    options.field.width = 64;
    options.step = 1.f / 512;
  }
  return options;
}

Trainer::Trainer(RadianceField& field, const Dataset& data, const TrainOptions& options)
    : TrainingRun(options.schedule),
      field_(field),
      data_(data),
      options_(options),
      pixel_rng_(options.seed, 1),
      background_rng_(options.seed, 2),
      occupancy_rng_(options.seed, 3),
      second_rng_(options.seed, 4),
      place_rng_(options.seed, 5),
      packed_(field.params, {.precision = options.precision}),
      loop_(field.coarse ? kMlpShards : kShards, loop_size(field)),
      shards_(at(loop_.shards())),
      rays_per_step_(options.least_rays) {
  check(options, field);
  if (data.views.empty()) throw ValueError("[trainer] data must have at least one view");
  for (const View& v : data.views)
    if (v.offsets && std::ssize(*v.offsets) != v.camera.width * v.camera.height)
      throw ValueError("[trainer] data must have an offset for each pixel, got " +
                       std::to_string(v.offsets->size()) + " for view " + v.name);
  // The table of a hash field is stepped level by level, see backward_table().
  train(field.params, adam_options(field), {{.end = loop_size(field)}}, {}, !field.coarse);
  if (options.keep) {
    start_ = sha256_hex(std::as_bytes(field.params.values()));
    const std::vector<std::uint8_t> bits(field_.grid.bits().begin(), field_.grid.bits().end());
    field_.grid.restrict_to(bits);
  } else {
    field_.background = data.background;
    field_.cameras = camera_span(data);
    lay_out_space();
  }
  choose_pixels();
  prepare_images();
  if (field.coarse) rays_per_step_ = mlp_rays();
  // Starts every tile at the worst error, so that tiles not yet seen are preferred.
  if (options.hard_pixels > 0 && !field.coarse) tile_errors_.assign(at(tile_of(all_pixels() - 1) + 1), 1.f);
  for (Shard& s : shards_) {
    s.samples.reserve(at(kMostRays / kRays / kShards + 1));
    if (!tile_errors_.empty()) s.errors.reserve(at(kMostRays / kShards + kRays));
  }
  keep("rays_per_step", rays_per_step_);
  keep("samples", samples_);
  if (!tile_errors_.empty()) keep("tile_errors", tile_errors_);
}

Trainer::~Trainer() { std::ranges::fill(field_.params.grads(), 0.f); }

void Trainer::lay_out_space() {
  field_.space = scene_space(data_, field_.space.bounds);
  if (field_.space.kind == SpaceKind::contracted && field_.coarse)
    throw ValueError(
        "[trainer] field must be a hash field where a scene has no bounds (points of mlp fields are "
        "spread over straight rays), got an mlp field");
  if (field_.space.kind == SpaceKind::cube) {
    if (options_.carve && !options_.refine_poses && has_alpha(data_)) carve();
    return;
  }
  std::vector<Camera> cameras;
  for (const View& v : data_.views) cameras.push_back(v.camera);
  field_.grid.restrict_to(seen_cells(cameras, field_.space, field_.grid.resolution()));
}

void Trainer::carve() {
  const Index n = field_.grid.resolution();
  field_.space.bounds = tighten(field_.space.bounds, visual_hull(data_.views, field_.space.bounds, n), n);
  field_.grid.restrict_to(visual_hull(data_.views, field_.space.bounds, n));
  pixels_ = training_pixels(data_.views, hull_margin(data_.views, field_.space.bounds, n));
}

// Rays go only through valid pixels.
void Trainer::choose_pixels() {
  for (const View& v : data_.views)
    valid_pixels_ += v.valid.empty() ? v.camera.width * v.camera.height : std::ranges::count(v.valid, 1);
  if (valid_pixels_ == all_pixels() || !pixels_.empty()) return;
  pixels_ = training_pixels(data_.views, std::nullopt);
  if (pixels_.empty())
    throw ValueError("[trainer] data must have a valid pixel, got none: masks exclude all");
}

double Trainer::run_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads) {
  choose_rays(index * kRays, kRays, shard);
  RaySamples& s = shard.found;
  shard.sampler.sample(field_.field, field_.params, field_.grid, shard.rays.batch(field_.space), shard.jitter,
                       {.step = field_.step(), .stop = options_.stop}, s, &packed_);
  const Index n = s.size(), width = field_.field.encoding().width(), encoded = field_.field.direction_width();
  shard.samples.push_back(n);
  std::copy(s.position.begin(), s.position.end(), shard.position.append(3 * n));

  // The sampler already looked up the features; as leaves they collect the gradient for the table.
  const Params<float> params(field_.params, options_.freeze ? nullptr : grads, packed_);
  const Var<float> density_features = tape.fresh_leaf(s.density_features.data(), nullptr, {n, width});
  const Var<float> colour_features = tape.fresh_leaf(s.colour_features.data(), nullptr, {n, width});
  const Var<float> of_ray =
      field_.field.encode_directions(tape.constant(shard.rays.seen_from.data(), {kRays, 3}));
  float* harmonics = tape.scratch(n * encoded);
  for (Index r = 0; r < kRays; ++r)
    for (Index i = s.ray_begin[at(r)]; i < s.ray_begin[at(r + 1)]; ++i)
      std::copy_n(of_ray.value() + r * encoded, encoded, harmonics + i * encoded);
  float* delta = tape.scratch(n);
  std::fill_n(delta, n, field_.step());

  const Var<float> z = field_.field.geometry(params, density_features);
  const Var<float> rgb =
      field_.field.colour(params, z, colour_features, tape.constant(harmonics, {n, encoded}));
  const Var<float> sigma = field_.field.density(z);
  Var<float> rays = composite(sigma, rgb, tape.constant(delta, {n}), s.ray_begin);
  if (const Index k = rays_along_pixel(); k > 1)
    rays = tape.reshape(avg_pool(tape.reshape(rays, {kRays / (k * k), k, k, 4}), k), {kRays / (k * k), 4});
  rays = coloured(rays, shard);
  const double share = static_cast<double>(kRays) / static_cast<double>(rays_per_step_);
  const Var<float> loss =
      photometric_loss<float>(rays, shard.truth, shard.background, {.huber = options_.huber, .scale = share});
  const double value = static_cast<double>(loss.value()[0]);
  if (!tile_errors_.empty()) note_errors(rays, shard);
  if (options_.distortion > 0) {
    float* middle = tape.scratch(n);
    fill_middles(s, middle);
    tape.backward(add(loss, distortion_loss<float>(sigma, {delta, at(n)}, {middle, at(n)}, s.ray_begin,
                                                   options_.distortion * share)));
  } else {
    tape.backward(loss);
  }
  if (options_.refine_poses && (options_.freeze || steps() >= kPosesAfter))
    add_motions(density_features.grad(), colour_features.grad(), shard);
  if (!options_.freeze)
    field_.field.encoding().deal_to_levels(n, density_features.grad(), colour_features.grad(),
                                           shard.dfeatures.append(2 * n * width));
  return value;
}

double Trainer::wanted_samples() const {
  const double most = static_cast<double>(options_.samples_per_step);
  const double grown = std::max(1.0, static_cast<double>(steps()) / options_.grow_after);
  return std::min(most, static_cast<double>(options_.first_samples) * grown);
}

// The step of a hashed level reads all its gradients and touches cache lines all over four arrays, which
// takes as long for few samples as for many. So a level waits for samples_per_step samples, each level in a
// different training step; the run's last step leaves none waiting.
bool Trainer::level_steps(int level) const {
  const auto period =
      std::max<Index>(1, std::lround(static_cast<double>(options_.samples_per_step) / wanted_samples()));
  return field_.field.encoding().mask(level) == 0 || steps() + 1 == planned() ||
         (steps() + level) % period == 0;
}

// A level owns its rows of the table; shards, and chunks within them, are added in order. If a level's step
// is due, its rows are stepped at once, while their gradients are still in cache.
void Trainer::backward_table() {
  const HashEncoding<float>& encoding = field_.field.encoding();
  const std::span<float> grad = field_.params.grads(encoding.table());
  const Index entry = 2 * encoding.features(), table = grad.data() - field_.params.grads().data();
  parallel_for(encoding.levels(), 1, [&](Index l, Index) {
    const int level = static_cast<int>(encoding.levels() - 1 - l);  // the finest, slowest level first
    for (const Shard& shard : shards_) {
      const float *x = shard.position.numbers.data(), *d = shard.dfeatures.numbers.data();
      for (const Index n : shard.samples) {
        encoding.backward_level(level, x, n, d + level * n * entry, grad);
        x += 3 * n;
        d += encoding.levels() * n * entry;
      }
    }
    if (!level_steps(level)) return;
    extend_update({.begin = table + encoding.first_row(level) * entry,
                   .end = table + encoding.first_row(level + 1) * entry,
                   .skip_zero = true,
                   .weight_decay = steps() < options_.decay_after ? 0 : options_.table_decay});
  });
}

double Trainer::take_step(double) {
  packed_.update();
  for (Shard& s : shards_) s.begin_step();
  place_cameras();
  const double loss = field_.coarse ? step_mlp() : step_hash();
  for (const Shard& s : shards_)
    samples_ += static_cast<double>(std::accumulate(s.samples.begin(), s.samples.end(), Index{0}));
  return loss;
}

double Trainer::step_hash() {
  if (steps() % kOccupancyPeriod == 0 && !options_.freeze) refresh_occupancy();
  const Index network = field_.field.network_size();
  const double loss = loop_.run(
      rays_per_step_ / kRays,
      [this](Index c, Index shard, Tape<float>& tape, float* grads) {
        return run_chunk(c, shards_[at(shard)], tape, grads);
      },
      field_.params.grads().first(at(network)));
  if (!options_.freeze) {
    update();
    backward_table();
  }
  step_images();

  for (const Shard& s : shards_)
    for (const auto& [tile, error] : s.errors)
      tile_errors_[at(tile)] = 0.5f * (tile_errors_[at(tile)] + error);

  // Sets the rays of the next step to give the wanted number of samples, changing by at most a half.
  Index samples = 0;
  for (const Shard& s : shards_) samples = std::accumulate(s.samples.begin(), s.samples.end(), samples);
  const double wanted = static_cast<double>(rays_per_step_) * wanted_samples() /
                        static_cast<double>(std::max<Index>(samples, 1));
  const Index next = static_cast<Index>(std::clamp(wanted, static_cast<double>(rays_per_step_) / 1.5,
                                                   static_cast<double>(rays_per_step_) * 1.5));
  rays_per_step_ = std::clamp(next / kRays * kRays, options_.least_rays, kMostRays);
  return loss;
}

double Trainer::train_psnr() const {
  const double share =
      pixels_.empty() ? 1 : static_cast<double>(pixels_.size()) / static_cast<double>(valid_pixels_);
  return -10 * std::log10(std::max(2 * share * loss(), 1e-10));
}

void Trainer::refresh_occupancy() {
  static_assert(OccupancyGrid::kLanes <= kShards);
  const OccupancyGrid::Density density = [this](Index lane, const float* x, Index n, float* sigma) {
    const HashEncoding<float>& encoding = field_.field.encoding();
    Tape<float>& tape = loop_.tape(lane);
    tape.reset();
    float* features = tape.scratch(n * encoding.width());
    float* unused = tape.scratch(n * encoding.width());
    encoding.encode(field_.params.values(encoding.table()), x, n, features, unused);
    const Var<float> z = field_.field.geometry(Params<float>(field_.params, nullptr, packed_),
                                               tape.constant(features, {n, encoding.width()}));
    std::copy_n(field_.field.density(z).value(), n, sigma);
  };
  const bool warm = steps() >= options_.warm_up;
  field_.grid.update(density, occupancy_rng_,
                     {.decay = 0.5f,  // halved at each update: 0.95 kept fog for a thousand steps
                                      // (21 samples per ray, not 7)
                      .step = field_.step(),
                      .threshold = warm ? 0.01f : -1.f,  // below zero: every candidate stays occupied
                      .fraction = steps() < 2 * options_.warm_up ? 1 : 4,
                      .round = static_cast<std::uint64_t>(steps() / kOccupancyPeriod)});
}

std::string Trainer::status() const {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f dB on the rays trained", train_psnr());
  return text;
}

}  // namespace fieldmark::nerf
