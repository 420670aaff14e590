#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/photometric_loss.h>

#include <algorithm>
#include <numeric>

#include "trainer_shard.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kMlpRays = 4;  // per chunk: 128 rows for the coarse network, 256 for the fine one

// Computes colour and opacity of rays from given samples and stores the densities in samples.sigma.
Var<float> look(const Field<float>& net, const ParamStore<float>& store, const Params<float>& params,
                std::span<const float> directions, RaySamples& samples, Tape<float>& tape) {
  const Index n = samples.size(), width = net.density_width(), encoded = net.direction_width(),
              rays = std::ssize(samples.ray_begin) - 1;
  float* features = tape.scratch(n * width);
  net.encode(store, samples.position.data(), n, features, nullptr);
  const Var<float> of_ray = net.encode_directions(tape.constant(directions.data(), {rays, 3}));
  float* direction = tape.scratch(n * encoded);
  for (Index r = 0; r < rays; ++r)
    for (Index i = samples.ray_begin[at(r)]; i < samples.ray_begin[at(r + 1)]; ++i)
      std::copy_n(of_ray.value() + r * encoded, encoded, direction + i * encoded);
  const Var<float> z = net.geometry(params, tape.constant(features, {n, width}));
  const Var<float> sigma = net.density(z);
  samples.sigma.assign(sigma.value(), sigma.value() + n);
  const Var<float> rgb =
      net.colour(params, z, tape.constant(features, {n, 0}), tape.constant(direction, {n, encoded}));
  return composite(sigma, rgb, tape.constant(samples.delta.data(), {n}), samples.ray_begin);
}

}  // namespace

Index Trainer::mlp_rays() const {
  const RayPoints& points = field_.options().points;
  const Index samples = points.total() + (points.importance > 0 ? points.first() : 0);
  return std::max<Index>(1, options_.samples_per_step / samples / kMlpRays) * kMlpRays;
}

// Both networks see the same pixels: the coarse one from its own points, the fine one from all.
double Trainer::run_mlp_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads) {
  choose_rays(index * kMlpRays, kMlpRays, shard);
  const RayBatch rays = shard.rays.batch(field_.space);
  const RayPoints& points = field_.options().points;
  const Params<float> params(field_.params, grads, packed_);
  const auto loss_of = [&](const Field<float>& net, RaySamples& samples) {
    shard.samples.push_back(samples.size());
    const double share = static_cast<double>(kMlpRays) / static_cast<double>(rays_per_step_);
    const Var<float> seen = look(net, field_.params, params, shard.rays.seen_from, samples, tape);
    return photometric_loss<float>(coloured(seen, shard), shard.truth, shard.background,
                                   {.huber = options_.huber, .scale = share});
  };
  const bool refined = points.importance > 0;
  RaySamples& first = refined ? shard.first : shard.found;
  shard.hierarchical.spread(field_.grid, rays, shard.jitter, field_.step(), points, first);
  if (!refined) {
    const Var<float> loss = loss_of(field_.field, first);
    tape.backward(loss);
    return static_cast<double>(loss.value()[0]);
  }
  const Var<float> coarse = loss_of(*field_.coarse, first);
  shard.weights.resize(first.t.size());
  sample_weights(first, 0, shard.weights.data());
  shard.hierarchical.refine(rays, first, shard.weights, shard.found);
  const Var<float> fine = loss_of(field_.field, shard.found);
  tape.backward(add(coarse, fine));
  return static_cast<double>(fine.value()[0]);
}

double Trainer::step_mlp() {
  const double loss = loop_.run(
      rays_per_step_ / kMlpRays,
      [this](Index c, Index shard, Tape<float>& tape, float* grads) {
        return run_mlp_chunk(c, shards_[at(shard)], tape, grads);
      },
      field_.params.grads());
  update();
  step_images();
  return loss;
}

}  // namespace fieldmark::nerf
