#include <fieldmark/nerf/field_sampler.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr Index kWave = 16;    // samples of a ray in a wave
constexpr Index kBlock = 512;  // rows that pass through the network together: activations stay in cache

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Params<float> parameters(const RadianceField& field, const PackedWeights<float>* packed) {
  return packed ? Params<float>(field.params, nullptr, *packed) : Params<float>(field.params, nullptr);
}

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

void FieldSampler::sample(const RadianceField& field, const RayBatch& rays, std::span<const float> jitter,
                          const FieldSamplingOptions& options, RaySamples& out,
                          const PackedWeights<float>* packed) {
  if (!field.coarse) {
    march_.sample(field.field, field.params, field.grid, rays, jitter,
                  {.step = field.step() / options.finer, .stop = options.stop}, out, packed);
    return;
  }
  const Params<float> params = parameters(field, packed);
  const bool refined = options.points.importance > 0;
  hierarchical_.spread(field.grid, rays, jitter, field.step(), options.points, refined ? first_ : out);
  if (refined) {
    coarse_densities(field, params);
    weights_.resize(first_.t.size());
    sample_weights(first_, 0, weights_.data());
    hierarchical_.refine(rays, first_, weights_, out);
  }
  evaluate(field, params, options.stop, out);
}

void FieldSampler::coarse_densities(const RadianceField& field, const Params<float>& params) {
  const Index width = field.coarse->density_width();
  first_.sigma.resize(first_.t.size());
  features_.resize(at(kBlock * width));
  for (Index begin = 0; begin < first_.size(); begin += kBlock) {
    const Index n = std::min(kBlock, first_.size() - begin);
    tape_.reset();
    field.coarse->encode(field.params, first_.position.data() + 3 * begin, n, features_.data(), nullptr);
    const Var<float> z = field.coarse->geometry(params, tape_.constant(features_.data(), {n, width}));
    std::copy_n(field.coarse->density(z).value(), n, first_.sigma.data() + begin);
  }
}

void FieldSampler::evaluate(const RadianceField& field, const Params<float>& params, float stop,
                            RaySamples& out) {
  const Index rays = std::ssize(out.ray_begin) - 1;
  out.sigma.resize(out.t.size());
  out.z.resize(at(out.size() * field.field.geometry_width()));
  alive_.clear();
  for (Index r = 0; r < rays; ++r) alive_.push_back(r);
  transmittance_.assign(at(rays), 1.f);
  evaluated_.assign(at(rays), 0);
  while (!alive_.empty()) {
    rows_.clear();
    for (const Index r : alive_) {
      const Index from = out.ray_begin[at(r)] + evaluated_[at(r)];
      for (Index i = from; i < std::min(from + kWave, out.ray_begin[at(r + 1)]); ++i) rows_.push_back(i);
    }
    evaluate_wave(field, params, out);
    // The sample that makes a ray opaque is kept: it is what stops the light.
    std::erase_if(alive_, [&](Index r) {
      const Index from = out.ray_begin[at(r)], count = out.ray_begin[at(r + 1)] - from;
      Index& done = evaluated_[at(r)];
      float& transmittance = transmittance_[at(r)];
      for (const Index end = std::min(done + kWave, count); done < end && transmittance >= stop; ++done)
        transmittance *= std::exp(-out.sigma[at(from + done)] * out.delta[at(from + done)]);
      return done == count || transmittance < stop;
    });
  }
  keep_evaluated(field.field.geometry_width(), out);
}

// Density and z of the samples in rows_.
void FieldSampler::evaluate_wave(const RadianceField& field, const Params<float>& params, RaySamples& out) {
  const Field<float>& net = field.field;
  const Index width = net.density_width(), columns = net.geometry_width();
  features_.resize(at(kBlock * width));
  x_.resize(at(3 * kBlock));
  for (Index begin = 0; begin < std::ssize(rows_); begin += kBlock) {
    const Index n = std::min(kBlock, std::ssize(rows_) - begin);
    const Index* row = rows_.data() + begin;
    for (Index i = 0; i < n; ++i) std::copy_n(&out.position[at(3 * row[i])], 3, &x_[at(3 * i)]);
    tape_.reset();
    net.encode(field.params, x_.data(), n, features_.data(), nullptr);
    const Var<float> z = net.geometry(params, tape_.constant(features_.data(), {n, width}));
    const Var<float> sigma = net.density(z);
    for (Index i = 0; i < n; ++i) {
      out.sigma[at(row[i])] = sigma.value()[i];
      std::copy_n(z.value() + i * columns, columns, &out.z[at(row[i] * columns)]);
    }
  }
}

// Drops what lies behind the end of each ray.
void FieldSampler::keep_evaluated(Index width, RaySamples& out) {
  Index to = 0;
  for (std::size_t r = 0; r < evaluated_.size(); ++r) {
    const Index from = out.ray_begin[r], n = evaluated_[r];
    const auto move = [&](std::vector<float>& v, Index columns) {
      if (to != from) std::copy_n(v.begin() + from * columns, n * columns, v.begin() + to * columns);
    };
    move(out.t, 1), move(out.delta, 1), move(out.sigma, 1), move(out.position, 3), move(out.z, width);
    out.ray_begin[r] = to;
    to += n;
  }
  out.ray_begin.back() = to;
  for (auto [v, columns] :
       {std::pair{&out.t, Index{1}}, {&out.delta, 1}, {&out.sigma, 1}, {&out.position, 3}, {&out.z, width}})
    v->resize(at(to * columns));
}

}  // namespace fieldmark::nerf
