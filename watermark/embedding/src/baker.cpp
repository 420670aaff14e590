#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fieldmark/watermark/mark/cameras_around.h>

namespace fieldmark::watermark {
namespace {

constexpr int kShards = 16;
constexpr Index kRays = 64;  // per chunk
constexpr float kLeastWeight = 1e-3f;
constexpr int kRounds = 4;          // rounds of scale_to(), each confirmed on all views
constexpr double kNear = 0.02;      // dB from the target mark PSNR
constexpr float kOfSamples = 0.1f;  // weight of the samples' own colours relative to those of rays
constexpr double kEmphasisRate = 1. / 200;  // per step
constexpr double kMarkResolution = 128;     // cells per axis that suffice for a mark on an object

// True for an object in a hash field, which bakes with many rays, large steps and emphasis.
bool is_object_of_hash(const nerf::RadianceField& field) {
  return field.field.has_table() && field.space.kind == nerf::SpaceKind::cube;
}

// Chunks per step, and step sizes relative to the schedule's.
struct StepPlan {
  Index chunks;
  double table, network;
};

// Rays of objects are short: there is time for many of them and for large steps, without which colours learn
// a mark from all directions too faintly. Elsewhere there is time for a tenth of the steps.
StepPlan plan_of(const nerf::RadianceField& field) {
  if (!field.field.has_table()) return {.chunks = 32, .table = 0, .network = 0.01};
  if (is_object_of_hash(field)) return {.chunks = 128, .table = 1, .network = 0.2};
  return {.chunks = 32, .table = 0.2, .network = 0.04};
}

// Returns the ranges of the table's levels. A mark has little detail finer than kMarkResolution. On an
// object's finer levels, a row sees fewer rays and learns mostly noise, so its step shrinks with the volume
// of a cell.
std::vector<AdamRange> table_ranges(const nerf::RadianceField& field, double lr_factor) {
  const nerf::HashEncoding<float>& encoding = field.field.encoding();
  const bool object = is_object_of_hash(field);
  const auto begin_of = [&](int level) {
    return field.field.network_size() + encoding.first_row(level) * 2 * encoding.features();
  };
  std::vector<AdamRange> ranges;
  for (int level = 0; level < encoding.levels(); ++level) {
    const double coarser = kMarkResolution / static_cast<double>(encoding.resolution(level));
    ranges.push_back({.begin = begin_of(level),
                      .end = begin_of(level + 1),
                      .lr_factor = lr_factor * (object ? std::min(1., std::pow(coarser, 3)) : 1.),
                      .skip_zero = true});
  }
  return ranges;
}

// Returns the power of a difference of colours on rays, sum_r |sum_i w_i (a_i - b_i)|^2 over their samples.
double power_on_rays(std::span<const std::int32_t> begin, std::span<const float> weight, const float* a,
                     const float* b) {
  double power = 0;
  for (std::size_t r = 0; r + 1 < begin.size(); ++r)
    for (Index channel = 0; channel < 3; ++channel) {
      double sum = 0;
      for (Index i = begin[r]; i < begin[r + 1]; ++i)
        sum += static_cast<double>(weight[at(i)] * (a[3 * i + channel] - b[3 * i + channel]));
      power += sum * sum;
    }
  return power;
}

// Returns the range of the colour networks' parameters, which are contiguous.
AdamRange colour_range(const ParamStore<float>& params, double lr_factor) {
  AdamRange range{.begin = params.size(), .lr_factor = lr_factor};
  for (const auto& e : params.entries())
    if (nerf::Field<float>::is_colour(e.name)) {
      range.begin = std::min(range.begin, e.offset);
      range.end = e.offset + e.shape.size();
    }
  return range;
}

}  // namespace

// The visible samples of a chunk, their marked colours, the target (marked, emphasised), and the gradients
// that they pass back to the table.
struct Baker::Chunk {
  nerf::CubeRays rays;
  std::vector<float> jitter;
  std::vector<float> position, direction, weight, geometry_features, base_features, of_direction, marked,
      target, features, dfeatures, unused;
  std::vector<std::int32_t> begin;  // of each ray's samples, and the end
  Index samples = 0;
  double asked = 0, learnt = 0;  // power of the mark on rays
};

Baker::Baker(const Owner& owner, const Message& message, const BakeOptions& options)
    : TrainingRun(options.schedule),
      owner_(owner),
      options_(options),
      message_(message),
      rng_(options.seed, 21),
      field_(owner.field),
      loop_(kShards, owner.field.field.network_size()),
      chunks_(at(plan_of(owner.field).chunks)),
      samplers_(kShards),
      samples_(kShards) {
  if (message.size() != owner.options().bits)
    throw ValueError("[baker] message must have the owner's " + std::to_string(owner.options().bits) +
                     " bits, got " + std::to_string(message.size()));
  if (options.cameras < 1 || options.around < 0)
    throw ValueError("[baker] cameras must be at least 1 and around at least 0, got " +
                     std::to_string(options.cameras) + " and " + std::to_string(options.around));
  marking_ = owner.marking(cell_signs(owner.code(), message));
  // Colours that no ray constrains drift: without the cameras around, lego's underside changes by 29 dB.
  cameras_ = cameras_around(owner.field, options.cameras, options.around, 0, options.seed + 31);
  const StepPlan plan = plan_of(owner.field);
  // The parameters of the density get no gradient: its networks are outside the ranges, and its features do
  // not change where the gradient is 0.
  std::vector<AdamRange> ranges = {colour_range(field_.params, plan.network)};
  if (field_.field.has_table())
    for (const AdamRange& range : table_ranges(field_, plan.table)) ranges.push_back(range);
  keep("emphasis", emphasis_);
  train(field_.params, {.lr = 1, .beta2 = 0.99, .eps = 1e-15, .zero_grads = true}, std::move(ranges));
}

Baker::~Baker() = default;

void Baker::choose_rays(Index chunk, Chunk& c) const {
  const auto step = static_cast<std::uint64_t>(steps());
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
  const nerf::Field<float>& net = field_.field;
  const Index density = net.density_width(), colour = net.colour_width(), direction = net.direction_width();
  std::vector<float> weights(at(s.size()));
  nerf::sample_weights(s, field_.step(), weights.data());
  Tape<float> tape;
  const Var<float> of_ray = net.encode_directions(tape.constant(c.rays.seen_from.data(), {kRays, 3}));
  for (auto* v :
       {&c.position, &c.direction, &c.weight, &c.geometry_features, &c.base_features, &c.of_direction})
    v->clear();
  c.begin.assign(1, 0);
  const auto append = [](std::vector<float>& to, const float* from, Index n) {
    to.insert(to.end(), from, from + n);
  };
  for (Index r = 0; r < kRays; ++r) {
    for (Index i = s.ray_begin[at(r)]; i < s.ray_begin[at(r + 1)]; ++i) {
      if (weights[at(i)] < kLeastWeight) continue;
      append(c.position, &s.position[at(3 * i)], 3);
      append(c.direction, &c.rays.seen_from[at(3 * r)], 3);
      append(c.weight, &weights[at(i)], 1);
      if (s.z.empty())
        append(c.geometry_features, s.density_features.data() + i * density, density);
      else
        append(c.geometry_features, s.z.data() + i * net.geometry_width(), net.geometry_width());
      append(c.base_features, s.colour_features.data() + i * colour, colour);
      append(c.of_direction, of_ray.value() + r * direction, direction);
    }
    c.begin.push_back(static_cast<std::int32_t>(c.weight.size()));
  }
  c.samples = static_cast<Index>(c.weight.size());
}

void Baker::set_target(const float* unmarked, Chunk& c) const {
  c.marked.assign(unmarked, unmarked + 3 * c.samples);
  marking_(c.position.data(), c.direction.data(), c.samples, c.marked.data());
  c.asked = power_on_rays(c.begin, c.weight, c.marked.data(), unmarked);
  c.target = c.marked;
  const auto factor = static_cast<float>(emphasis_);
  if (factor == 1) return;
  for (std::size_t i = 0; i < c.target.size(); ++i)
    c.target[i] = std::clamp(unmarked[i] + factor * (c.marked[i] - unmarked[i]), 0.f, 1.f);
}

// Raises the emphasis while the learnt change has less power than the mark, else lowers it. Networks are not
// linear, so scaling a faint change in scale_to() costs bits.
void Baker::update_emphasis() {
  double asked = 0, learnt = 0;
  for (const Chunk& c : chunks_) {
    asked += c.asked;
    learnt += c.learnt;
  }
  const double ratio = learnt > 0 ? std::clamp(std::sqrt(asked / learnt), 0.5, 2.) : 1;
  emphasis_ = std::clamp(emphasis_ * (1 + kEmphasisRate * (ratio - 1)), 1., kLargestEmphasis);
}

double Baker::run_chunk(Index index, Index shard, Tape<float>& tape, float* grads) {
  Chunk& c = chunks_[at(index)];
  choose_rays(index, c);
  nerf::RaySamples& s = samples_[at(shard)];
  samplers_[at(shard)].sample(owner_.field, c.rays.batch(field_.space), c.jitter,
                              {.stop = 1e-3f, .points = field_.options().points}, s);
  select(s, c);
  const nerf::Field<float>& net = field_.field;
  const Index n = c.samples, density = net.density_width(), colour = net.colour_width();
  c.features.resize(at(n * colour));
  c.unused.resize(at(n * density));
  c.dfeatures.resize(at(2 * n * colour));
  c.asked = c.learnt = 0;
  if (n == 0) return 0;
  const Params<float> frozen(owner_.field.params, nullptr), learnt(field_.params, grads);
  const Var<float> of_direction = tape.constant(c.of_direction.data(), {n, net.direction_width()});
  const float* geometry = c.geometry_features.data();
  const Var<float> z = s.z.empty() ? net.geometry(frozen, tape.constant(geometry, {n, density}))
                                   : tape.constant(geometry, {n, net.geometry_width()});
  const Var<float> base =
      net.colour(frozen, z, tape.constant(c.base_features.data(), {n, colour}), of_direction);
  set_target(base.value(), c);

  if (net.has_table()) net.encode(field_.params, c.position.data(), n, c.unused.data(), c.features.data());
  const Var<float> features = tape.fresh_leaf(c.features.data(), nullptr, {n, colour});
  const Var<float> rgb = net.colour(learnt, z, features, of_direction);
  c.learnt = power_on_rays(c.begin, c.weight, rgb.value(), base.value());
  float* weights = tape.scratch(3 * n);
  for (Index i = 0; i < 3 * n; ++i) weights[i] = c.weight[at(i / 3)];
  const Var<float> target = tape.constant(c.target.data(), {n, 3});
  const Var<float> of_samples = mse_loss<float>(rgb, target, std::span<const float>(weights, at(3 * n)));
  const Var<float> seen = weighted_segments<float>(sub(rgb, target), c.begin, c.weight);
  float* nothing = tape.scratch(3 * kRays);
  std::fill_n(nothing, 3 * kRays, 0.f);
  const Var<float> of_rays = mse_loss<float>(seen, tape.constant(nothing, {kRays, 3}));
  const double error = power_on_rays(c.begin, c.weight, rgb.value(), c.marked.data());
  tape.backward(add(of_rays, scale(of_samples, kOfSamples)));
  if (net.has_table()) net.encoding().deal_to_levels(n, nullptr, features.grad(), c.dfeatures.data());
  return error / (3 * kRays);
}

void Baker::backward_table() {
  const nerf::HashEncoding<float>& encoding = field_.field.encoding();
  parallel_for(encoding.levels(), 1, [&](Index level, Index) {
    for (const Chunk& c : chunks_)
      encoding.backward_level(static_cast<int>(level), c.position.data(), c.samples,
                              c.dfeatures.data() + level * c.samples * 2 * encoding.features(),
                              field_.params.grads(encoding.table()));
  });
}

double Baker::take_step(double) {
  const Index network = field_.field.network_size();
  const auto chunks = static_cast<Index>(chunks_.size());
  const double loss = loop_.run(
      chunks,
      [&](Index c, Index shard, Tape<float>& tape, float* grads) { return run_chunk(c, shard, tape, grads); },
      field_.params.grads().first(at(network)));
  if (field_.field.has_table()) backward_table();
  update();
  // Other scenes learn the whole mark: fern shows it to 0.1 dB after 780 steps.
  if (owner_.mark().has_gain() && is_object_of_hash(field_)) update_emphasis();
  return loss / static_cast<double>(chunks);
}

void Baker::describe(RunFingerprint& f) const {
  f.option("run", "bake");
  f.options("field", owner_.field.configuration());
  f.options("mark", owner_.mark().configuration());
  f.option("cameras", options_.cameras);
  f.option("around", options_.around);
  f.option("seed", options_.seed);
  f.option("gain", owner_.gain);
  f.option("emphasis_rate", kEmphasisRate);
  f.option("mark_resolution", kMarkResolution);
  f.input("field", owner_.field.params.values());
  f.input("occupancy", owner_.field.grid.bits());
  f.input("mark", owner_.params.values());
  f.input("cells", owner_.cells.numbers());
  f.input("message", cell_signs(owner_.code(), message_));
}

std::string Baker::status() const {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f dB to the marked colours", psnr());
  return text;
}

double Baker::mark_psnr(const MarkPsnrViews& views) const {
  nerf::Renderer marked(field_, mark_psnr_rendering());
  return MarkPsnrMeter(owner_.field, views)(marked);
}

// Parameters that training left unchanged keep their bytes, including the sign of a zero.
void Baker::set_scale(double scale, std::span<const float> learnt) {
  const auto unmarked = owner_.field.params.values();
  const auto values = field_.params.values();
  const auto s = static_cast<float>(scale);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = learnt[i] == unmarked[i] ? unmarked[i] : unmarked[i] + s * (learnt[i] - unmarked[i]);
}

// Searches the scale on a subset of the views. The mean of the subset differs from that of all views by a
// bias that hardly depends on the scale; all views confirm the result.
Baker::MarkPsnr Baker::scale_to(double target, const MarkPsnrViews& views) {
  const MarkPsnrMeter meter(owner_.field, views);
  nerf::Renderer marked(field_, mark_psnr_rendering());
  MarkPsnr found{.learnt = meter(marked)};
  found.scaled = found.learnt;
  const std::vector<float> learnt(field_.params.values().begin(), field_.params.values().end());
  const Index every = meter.guess_step();
  double bias = every > 1 ? found.scaled - meter(marked, {}, every) : 0;
  for (int round = 0; round < kRounds && std::abs(found.scaled - target) > kNear; ++round) {
    const double before = found.scale;
    seek(
        target, learnt, [&] { return meter(marked, {}, every) + bias; }, found);
    if (every == 1 || !std::isfinite(found.scaled) || found.scale == before) break;
    const double guess = found.scaled - bias;
    found.scaled = meter(marked);
    bias = found.scaled - guess;
  }
  return found;
}

// Secant method for the mark PSNR over log scale. The first slope is that of a linear change, 6 dB for a
// factor of 2, from which rounding and clamped colours deviate.
void Baker::seek(double target, std::span<const float> learnt, const std::function<double()>& measure,
                 MarkPsnr& found) {
  double slope = -1;
  for (int round = 0; round < 6 && std::abs(found.scaled - target) > kNear; ++round) {
    const double scale = std::clamp(found.scale * std::pow(10.0, (target - found.scaled) / slope / 20),
                                    1 / kLargestScale, kLargestScale);
    if (!std::isfinite(found.scaled) || scale == found.scale) break;
    set_scale(scale, learnt);
    const double scaled = measure(),
                 secant = (scaled - found.scaled) / (20 * std::log10(scale / found.scale));
    if (secant < -0.2) slope = secant;
    found.scale = scale;
    found.scaled = scaled;
  }
}

double Baker::psnr() const { return -10 * std::log10(std::max(loss(), 1e-10)); }

}  // namespace fieldmark::watermark
