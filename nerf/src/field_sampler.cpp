#include <fieldmark/nerf/field_sampler.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "checks.h"
#include "hierarchical_sampler.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kWave = 16;    // samples per ray in a wave
constexpr Index kBlock = 512;  // rows that pass through the network together, to stay in cache

}  // namespace

void sample_weights(const RaySamples& samples, float step, float* weights) {
  const bool uniform = samples.delta.empty();
  for (std::size_t r = 0; r + 1 < samples.ray_begin.size(); ++r) {
    float transmittance = 1;
    for (Index i = samples.ray_begin[r]; i < samples.ray_begin[r + 1]; ++i) {
      weights[i] =
          -transmittance * std::expm1(-samples.sigma[at(i)] * (uniform ? step : samples.delta[at(i)]));
      transmittance -= weights[i];
    }
  }
}

struct FieldSampler::State {
  RaySampler march;
  HierarchicalSampler hierarchical;
  RaySamples first;
  std::vector<float> weights, x, features, transmittance;
  std::vector<Index> alive, evaluated, rows;
  Tape<float> tape;

  void evaluate_rows(const Field<float>& net, const ParamStore<float>& store, const Params<float>& params,
                     RaySamples& out);
  void evaluate(const RadianceField& field, const Params<float>& params, float stop, RaySamples& out);
  void keep_evaluated(Index width, RaySamples& out) const;
};

FieldSampler::FieldSampler() : state_(std::make_unique<State>()) {}
FieldSampler::FieldSampler(FieldSampler&&) noexcept = default;
FieldSampler::~FieldSampler() = default;

void FieldSampler::sample(const RadianceField& field, const RayBatch& rays, std::span<const float> jitter,
                          const FieldSamplingOptions& options, RaySamples& out,
                          const PackedWeights<float>* packed) {
  State& s = *state_;
  if (!field.coarse) {
    s.march.sample(field.field, field.params, field.grid, rays, jitter,
                   {.step = field.step() / options.finer, .stop = options.stop}, out, packed);
    return;
  }
  const Params<float> params =
      packed ? Params<float>(field.params, nullptr, *packed) : Params<float>(field.params, nullptr);
  const bool refined = options.points.importance > 0;
  s.hierarchical.spread(field.grid, rays, jitter, field.step(), options.points, refined ? s.first : out);
  if (refined) {
    s.first.sigma.resize(s.first.t.size());
    s.rows.resize(s.first.t.size());
    std::iota(s.rows.begin(), s.rows.end(), Index{0});
    s.evaluate_rows(*field.coarse, field.params, params, s.first);
    s.weights.resize(s.first.t.size());
    sample_weights(s.first, 0, s.weights.data());
    s.hierarchical.refine(rays, s.first, s.weights, out);
  }
  s.evaluate(field, params, options.stop, out);
}

// Computes the densities of the samples in `rows`, and z unless out.z is empty.
void FieldSampler::State::evaluate_rows(const Field<float>& net, const ParamStore<float>& store,
                                        const Params<float>& params, RaySamples& out) {
  const Index width = net.density_width(), columns = net.geometry_width();
  features.resize(at(kBlock * width));
  x.resize(at(3 * kBlock));
  for (Index begin = 0; begin < std::ssize(rows); begin += kBlock) {
    const Index n = std::min(kBlock, std::ssize(rows) - begin);
    const Index* row = rows.data() + begin;
    for (Index i = 0; i < n; ++i) std::copy_n(&out.position[at(3 * row[i])], 3, &x[at(3 * i)]);
    tape.reset();
    net.encode(store, x.data(), n, features.data(), nullptr);
    const Var<float> z = net.geometry(params, tape.constant(features.data(), {n, width}));
    const Var<float> sigma = net.density(z);
    for (Index i = 0; i < n; ++i) {
      out.sigma[at(row[i])] = sigma.value()[i];
      if (!out.z.empty()) std::copy_n(z.value() + i * columns, columns, &out.z[at(row[i] * columns)]);
    }
  }
}

void FieldSampler::State::evaluate(const RadianceField& field, const Params<float>& params, float stop,
                                   RaySamples& out) {
  const Index rays = std::ssize(out.ray_begin) - 1;
  out.sigma.resize(out.t.size());
  out.z.resize(at(out.size() * field.field.geometry_width()));
  alive.resize(at(rays));
  std::iota(alive.begin(), alive.end(), Index{0});
  transmittance.assign(at(rays), 1.f);
  evaluated.assign(at(rays), 0);
  while (!alive.empty()) {
    rows.clear();
    for (const Index r : alive) {
      const Index from = out.ray_begin[at(r)] + evaluated[at(r)];
      for (Index i = from; i < std::min(from + kWave, out.ray_begin[at(r + 1)]); ++i) rows.push_back(i);
    }
    evaluate_rows(field.field, field.params, params, out);
    // Keeps the sample that makes a ray opaque, because it stops the light.
    std::erase_if(alive, [&](Index r) {
      const Index from = out.ray_begin[at(r)], count = out.ray_begin[at(r + 1)] - from;
      Index& done = evaluated[at(r)];
      float& left = transmittance[at(r)];
      for (const Index end = std::min(done + kWave, count); done < end && left >= stop; ++done)
        left *= std::exp(-out.sigma[at(from + done)] * out.delta[at(from + done)]);
      return done == count || left < stop;
    });
  }
  keep_evaluated(field.field.geometry_width(), out);
}

// Drops the samples past the end of each ray.
void FieldSampler::State::keep_evaluated(Index width, RaySamples& out) const {
  const std::pair<std::vector<float>*, Index> columns[] = {
      {&out.t, 1}, {&out.delta, 1}, {&out.sigma, 1}, {&out.position, 3}, {&out.z, width}};
  Index to = 0;
  for (std::size_t r = 0; r < evaluated.size(); ++r) {
    const Index from = out.ray_begin[r], n = evaluated[r];
    for (const auto& [v, k] : columns)
      if (to != from) std::copy_n(v->begin() + from * k, n * k, v->begin() + to * k);
    out.ray_begin[r] = to;
    to += n;
  }
  out.ray_begin.back() = to;
  for (const auto& [v, k] : columns) v->resize(at(to * k));
}

}  // namespace fieldmark::nerf
