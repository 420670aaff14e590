#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/spherical_harmonics.h>
#include <fieldmark/watermark/baker.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr int kShards = 16;
constexpr Index kRays = 64, kChunks = 32;  // of a chunk, of a step
constexpr float kLeastWeight = 1e-3f;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// The first number of the colour side: networks come before the table, density's before colour's.
Index colour_begin(const ParamStore<float>& params) {
  return params.entry(params.find("colour/0/weight")).offset;
}

}  // namespace

// The samples of a chunk that light reaches, what they look like unmarked, and what they pass back to the
// table.
struct Baker::Chunk {
  nerf::CubeRays rays;
  std::vector<float> jitter;
  std::vector<float> position, direction, weight, geometry_features, base_features, harmonics, target,
      features, dfeatures, unused;
  Index samples = 0;
};

Baker::Baker(const Owner& owner, const Message& message, const BakeOptions& options)
    : owner_(owner),
      options_(options),
      schedule_(options.schedule),
      rng_(options.seed, 21),
      field_(owner.field),
      loop_(kShards, owner.field.field.network_size()),
      adam_(owner.field.params.size(), {.lr = 1, .zero_grads = true}),
      chunks_(kChunks),
      samplers_(kShards),
      samples_(kShards) {
  if (message.size() != owner.options().bits)
    throw ValueError("[baker] message must have the owner's " + std::to_string(owner.options().bits) +
                     " bits, got " + std::to_string(message.size()));
  if (options.cameras < 1)
    throw ValueError("[baker] cameras must be at least 1, got " + std::to_string(options.cameras));
  marking_ = owner.marking(cell_signs(owner.code(), message));
  cameras_ =
      nerf::make_cameras(owner.field.cameras, nerf::CameraSet::near, options.cameras, 0, options.seed + 31);
}

Baker::~Baker() = default;

void Baker::choose_rays(Index chunk, Chunk& c) const {
  const auto step = static_cast<std::uint64_t>(steps_);
  c.rays.resize(kRays);
  c.jitter.resize(at(kRays));
  for (Index i = 0; i < kRays; ++i) {
    const auto u = rng_.uniform4(step, static_cast<std::uint64_t>(chunk * kRays + i));
    const auto pick = [](float x, Index n) {
      return std::min(static_cast<Index>(x * static_cast<float>(n)), n - 1);
    };
    const nerf::Camera& camera = cameras_[at(pick(u[0], static_cast<Index>(cameras_.size())))];
    const float pixel[2] = {u[1] * static_cast<float>(camera.width) - 0.5f,
                            u[2] * static_cast<float>(camera.height) - 0.5f};
    c.rays.set(field_.space, i, camera, pixel);
    c.jitter[at(i)] = u[3];
  }
}

void Baker::select(const nerf::RaySamples& s, Chunk& c) const {
  const Index width = field_.field.encoding().width();
  std::vector<float> weights(at(s.size()));
  nerf::sample_weights(s, field_.step(), weights.data());
  Tape<float> tape;
  const Var<float> of_ray = nerf::spherical_harmonics(tape.constant(c.rays.seen_from.data(), {kRays, 3}));
  for (auto* v : {&c.position, &c.direction, &c.weight, &c.geometry_features, &c.base_features, &c.harmonics})
    v->clear();
  const auto append = [](std::vector<float>& to, const float* from, Index n) {
    to.insert(to.end(), from, from + n);
  };
  for (Index r = 0; r < kRays; ++r)
    for (Index i = s.ray_begin[at(r)]; i < s.ray_begin[at(r + 1)]; ++i) {
      if (weights[at(i)] < kLeastWeight) continue;
      append(c.position, &s.position[at(3 * i)], 3);
      append(c.direction, &c.rays.seen_from[at(3 * r)], 3);
      append(c.weight, &weights[at(i)], 1);
      append(c.geometry_features, &s.density_features[at(i * width)], width);
      append(c.base_features, &s.colour_features[at(i * width)], width);
      append(c.harmonics, of_ray.value() + r * nerf::kSphericalHarmonics, nerf::kSphericalHarmonics);
    }
  c.samples = static_cast<Index>(c.weight.size());
}

double Baker::run_chunk(Index index, Index shard, Tape<float>& tape, float* grads) {
  Chunk& c = chunks_[at(index)];
  choose_rays(index, c);
  nerf::RaySamples& s = samples_[at(shard)];
  samplers_[at(shard)].sample(owner_.field.field, owner_.field.params, owner_.field.grid,
                              c.rays.batch(field_.space), c.jitter, {.step = field_.step(), .stop = 1e-3f},
                              s);
  select(s, c);
  const Index n = c.samples, width = field_.field.encoding().width();
  c.features.resize(at(n * width));
  c.unused.resize(at(n * width));
  c.dfeatures.resize(at(2 * n * width));
  if (n == 0) return 0;
  const nerf::Field<float>& net = field_.field;
  const Params<float> frozen(owner_.field.params, nullptr), learnt(field_.params, grads);
  const Var<float> harmonics = tape.constant(c.harmonics.data(), {n, nerf::kSphericalHarmonics});
  const Var<float> z = net.geometry(frozen, tape.constant(c.geometry_features.data(), {n, width}));
  const Var<float> base = net.colour(frozen, z, tape.constant(c.base_features.data(), {n, width}), harmonics);
  c.target.assign(base.value(), base.value() + 3 * n);
  marking_(c.position.data(), c.direction.data(), n, c.target.data());

  net.encoding().encode(field_.params.values(net.encoding().table()), c.position.data(), n, c.unused.data(),
                        c.features.data());
  const Var<float> features = tape.fresh_leaf(c.features.data(), nullptr, {n, width});
  const Var<float> rgb = net.colour(learnt, z, features, harmonics);
  float* weights = tape.scratch(3 * n);
  for (Index i = 0; i < 3 * n; ++i) weights[i] = c.weight[at(i / 3)];
  const Var<float> loss = mse_loss<float>(rgb, tape.constant(c.target.data(), {n, 3}),
                                          std::span<const float>(weights, at(3 * n)));
  const double value = static_cast<double>(loss.value()[0]);
  tape.backward(loss);
  net.encoding().deal_to_levels(n, nullptr, features.grad(), c.dfeatures.data());
  return value;
}

void Baker::step(double seconds) {
  schedule_.observe(steps_, seconds);
  const nerf::HashEncoding<float>& encoding = field_.field.encoding();
  const Index network = field_.field.network_size(), begin = colour_begin(field_.params);
  const double loss = loop_.run(
      kChunks,
      [&](Index c, Index shard, Tape<float>& tape, float* grads) { return run_chunk(c, shard, tape, grads); },
      field_.params.grads().first(at(network)));
  parallel_for(encoding.levels(), 1, [&](Index level, Index) {
    for (const Chunk& c : chunks_)
      encoding.backward_level(static_cast<int>(level), c.position.data(), c.samples,
                              c.dfeatures.data() + level * c.samples * 2 * encoding.features(),
                              field_.params.grads(encoding.table()));
  });
  // Density's numbers get no gradient: its networks are outside the range, its features are left alone where
  // it is 0.
  const AdamRange ranges[] = {
      {.begin = begin, .end = network, .lr_factor = 0.2 * schedule_.lr(steps_)},
      {.begin = network, .end = field_.params.size(), .lr_factor = schedule_.lr(steps_), .skip_zero = true}};
  adam_.step(field_.params.values(), field_.params.grads(), ranges);
  smoothed_ = smoothed_ < 0 ? loss / kChunks : 0.98 * smoothed_ + 0.02 * loss / kChunks;
  ++steps_;
}

double Baker::psnr() const { return -10 * std::log10(std::max(smoothed_, 1e-10)); }

}  // namespace fieldmark::watermark
