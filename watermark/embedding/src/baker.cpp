#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fieldmark/watermark/mark/cameras_around.h>

#include "bake_plan.h"
#include "mark_scale.h"
#include "ray_change.h"
#include "reading_guide.h"

namespace fieldmark::watermark {
namespace {

constexpr int kShards = 16;
constexpr Index kRays = 64;  // per chunk
constexpr float kLeastWeight = 1e-3f;
constexpr int kRounds = 4;                  // rounds of scale_to(), each confirmed on all views
constexpr float kOfSamples = 0.1f;          // weight of the samples' own colours relative to those of rays
constexpr double kEmphasisRate = 1. / 200;  // per step
constexpr Index kReadEvery = 6;             // steps: reading a view takes as long as one or two
constexpr Index kGuidedEvery = 2;           // chunks

}  // namespace

// The visible samples of a chunk of rays, their unmarked and marked colours, the target (marked, emphasised),
// what the rays should show beyond it, and the gradients that the samples pass back to the table.
struct Baker::Chunk {
  Chunk() : jitter(at(kRays)), beyond(at(3 * kRays)) { rays.resize(kRays); }
  nerf::CubeRays rays;
  std::vector<float> jitter, beyond;
  std::vector<float> position, direction, weight, z, base_features, of_direction, unmarked, marked, target,
      features, dfeatures, unused;
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
      samplers_(kShards),
      samples_(kShards) {
  if (message.size() != owner.options().bits)
    throw ValueError("[baker] message must have the owner's " + std::to_string(owner.options().bits) +
                     " bits, got " + std::to_string(message.size()));
  if (options.cameras < 1 || options.around < 0)
    throw ValueError("[baker] cameras must be at least 1 and around at least 0, got " +
                     std::to_string(options.cameras) + " and " + std::to_string(options.around));
  if (options.guide_views < 1 || !(options.guidance >= 0))
    throw ValueError("[baker] guide_views must be at least 1 and guidance at least 0, got " +
                     std::to_string(options.guide_views) + " and " + number_text(options.guidance));
  marking_ = owner.marking(cell_signs(owner.code(), message));
  // Colours that no ray constrains drift: without the cameras around, lego's underside changes by 29 dB.
  cameras_ = cameras_around(owner.field, options.cameras, options.around, 0, options.seed + 31);
  if (owner.mark().has_cells() && is_object_of_hash(owner.field) && options.guidance > 0) {
    const Index steps =
        options.schedule.steps > 0 ? options.schedule.steps : options.guide_views * kReadEvery;
    guide_ = std::make_unique<ReadingGuide>(owner, message,
                                            std::clamp<Index>(steps / kReadEvery, 1, options.guide_views),
                                            options.guidance, options.seed + 41);
    keep("guide", guide_->shifts());
  }
  BakePlan plan = bake_plan(owner.field);
  chunks_.resize(at(plan.chunks));
  // The parameters of the density get no gradient: its features do not change where the gradient is 0.
  keep("emphasis", emphasis_);
  train(field_.params, {.lr = 1, .beta2 = 0.99, .eps = 1e-15, .zero_grads = true}, std::move(plan.ranges));
}

Baker::~Baker() = default;

void Baker::choose_rays(Index chunk, Chunk& c) const {
  const auto step = static_cast<std::uint64_t>(steps());
  const Index turns = guide_ && chunk % kGuidedEvery == 0 ? turns_until(steps()) : 0;
  for (Index i = 0; i < kRays; ++i) {
    const auto u = rng_.uniform4(step, static_cast<std::uint64_t>(chunk * kRays + i));
    c.jitter[at(i)] = u[3];
    c.beyond[at(3 * i)] = c.beyond[at(3 * i + 1)] = c.beyond[at(3 * i + 2)] = 0;
    if (turns > 0) {
      const ReadingGuide::Pixel pixel = guide_->pick(std::span(u).first<3>(), turns);
      c.rays.set(field_.space, i, pixel.camera, pixel.place);
      std::ranges::copy(pixel.shift, &c.beyond[at(3 * i)]);
      continue;
    }
    const auto pick = [](float x, Index n) {
      return std::min(static_cast<Index>(x * static_cast<float>(n)), n - 1);
    };
    const nerf::Camera& camera = cameras_[at(pick(u[0], static_cast<Index>(cameras_.size())))];
    const float pixel[2] = {u[1] * static_cast<float>(camera.width) - 0.5f,
                            u[2] * static_cast<float>(camera.height) - 0.5f};
    c.rays.set(field_.space, i, camera, pixel);
  }
}

// Number of the guide's turns up to a step, inclusive.
Index Baker::turns_until(Index step) { return (step + 1) / kReadEvery; }

// Takes the pixels of a view in their order; a last chunk repeats the last pixel.
void Baker::take_pixels(const CachedView& view, Index chunk, Chunk& c) const {
  const auto step = static_cast<std::uint64_t>(steps());
  for (Index i = 0; i < kRays; ++i) {
    const Index p = std::min(chunk * kRays + i, view.height * view.width - 1);
    const float pixel[2] = {static_cast<float>(p % view.width), static_cast<float>(p / view.width)};
    c.rays.set(field_.space, i, view.camera, pixel);
    c.jitter[at(i)] = rng_.uniform4(step, static_cast<std::uint64_t>(p))[3];
  }
}

// Keeps the visible samples of the chunk's rays, with their unmarked colours.
void Baker::sample(Index shard, Tape<float>& tape, Chunk& c) {
  nerf::RaySamples& s = samples_[at(shard)];
  samplers_[at(shard)].sample(owner_.field, c.rays.batch(field_.space), c.jitter,
                              {.stop = 1e-3f, .points = field_.options().points}, s);
  const nerf::Field<float>& net = field_.field;
  const Index density = net.density_width(), colour = net.colour_width(), direction = net.direction_width(),
              geometry = net.geometry_width();
  std::vector<float> weights(at(s.size())), density_features;
  nerf::sample_weights(s, field_.step(), weights.data());
  const Var<float> of_ray = net.encode_directions(tape.constant(c.rays.seen_from.data(), {kRays, 3}));
  for (auto* v : {&c.position, &c.direction, &c.weight, &c.z, &c.base_features, &c.of_direction}) v->clear();
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
        append(density_features, s.density_features.data() + i * density, density);
      else
        append(c.z, s.z.data() + i * geometry, geometry);
      append(c.base_features, s.colour_features.data() + i * colour, colour);
      append(c.of_direction, of_ray.value() + r * direction, direction);
    }
    c.begin.push_back(static_cast<std::int32_t>(c.weight.size()));
  }
  const Index n = c.samples = static_cast<Index>(c.weight.size());
  c.unmarked.resize(at(3 * n));
  if (n == 0) return;
  const Params<float> frozen(owner_.field.params, nullptr);
  if (s.z.empty()) {
    const Var<float> z = net.geometry(frozen, tape.constant(density_features.data(), {n, density}));
    c.z.assign(z.value(), z.value() + n * geometry);
  }
  const Var<float> base = net.colour(frozen, tape.constant(c.z.data(), {n, geometry}),
                                     tape.constant(c.base_features.data(), {n, colour}),
                                     tape.constant(c.of_direction.data(), {n, direction}));
  std::copy_n(base.value(), 3 * n, c.unmarked.data());
}

void Baker::set_target(Chunk& c) const {
  c.marked = c.unmarked;
  marking_(c.position.data(), c.direction.data(), c.samples, c.marked.data());
  c.target = c.marked;
  const auto factor = static_cast<float>(emphasis_);
  if (factor == 1) return;
  for (std::size_t i = 0; i < c.target.size(); ++i)
    c.target[i] = std::clamp(c.unmarked[i] + factor * (c.marked[i] - c.unmarked[i]), 0.f, 1.f);
}

// Raises the emphasis while the learnt change has less power than the mark, else lowers it. Networks are not
// linear, so scaling in scale_to() costs bits.
void Baker::update_emphasis() {
  double asked = 0, learnt = 0;
  for (const Chunk& c : chunks_) {
    asked += c.asked;
    learnt += c.learnt;
  }
  const double ratio = learnt > 0 ? std::clamp(std::sqrt(asked / learnt), 0.5, 2.) : 1;
  emphasis_ = std::clamp(emphasis_ * (1 + kEmphasisRate * (ratio - 1)), kLeastEmphasis, kLargestEmphasis);
}

// Returns the learnt colours [samples, 3] and the features on which they depend.
Baker::Learnt Baker::learnt_colours(Tape<float>& tape, Chunk& c, float* grads) const {
  const nerf::Field<float>& net = field_.field;
  const Index n = c.samples, colour = net.colour_width();
  c.features.resize(at(n * colour));
  c.unused.resize(at(n * net.density_width()));
  if (net.has_table()) net.encode(field_.params, c.position.data(), n, c.unused.data(), c.features.data());
  const Var<float> features = tape.fresh_leaf(c.features.data(), nullptr, {n, colour});
  return {.features = features,
          .rgb = net.colour(Params<float>(field_.params, grads),
                            tape.constant(c.z.data(), {n, net.geometry_width()}), features,
                            tape.constant(c.of_direction.data(), {n, net.direction_width()}))};
}

// Adds the gradients of a chunk that has its target.
double Baker::learn(Chunk& c, Tape<float>& tape, float* grads) {
  const nerf::Field<float>& net = field_.field;
  const Index n = c.samples;
  c.dfeatures.resize(at(2 * n * net.colour_width()));
  c.asked = c.learnt = 0;
  if (n == 0) return 0;
  const auto [features, rgb] = learnt_colours(tape, c, grads);
  c.asked = power_on_rays(c.begin, c.weight, c.marked.data(), c.unmarked.data());
  c.learnt = power_on_rays(c.begin, c.weight, rgb.value(), c.unmarked.data());
  float* weights = tape.scratch(3 * n);
  for (Index i = 0; i < 3 * n; ++i) weights[i] = c.weight[at(i / 3)];
  const Var<float> target = tape.constant(c.target.data(), {n, 3});
  const Var<float> of_samples = mse_loss<float>(rgb, target, std::span<const float>(weights, at(3 * n)));
  const Var<float> seen = weighted_segments<float>(sub(rgb, target), c.begin, c.weight);
  const Var<float> of_rays = mse_loss<float>(seen, tape.constant(c.beyond.data(), {kRays, 3}));
  const double error = power_on_rays(c.begin, c.weight, rgb.value(), c.marked.data());
  tape.backward(add(of_rays, scale(of_samples, kOfSamples)));
  if (net.has_table()) net.encoding().deal_to_levels(n, nullptr, features.grad(), c.dfeatures.data());
  return error / (3 * kRays);
}

std::span<float> Baker::network_grads() {
  return field_.params.grads().first(at(field_.field.network_size()));
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

// Lets the guide read what the field shows of a view so far.
void Baker::read_view(Index turn) {
  const CachedView& view = guide_->view(turn);
  const Index pixels = view.height * view.width, count = (pixels + kRays - 1) / kRays;
  for (auto* seen : {&change_, &asked_}) seen->assign(at(3 * count * kRays), 0.f);
  loop_.run(
      count,
      [&](Index i, Index shard, Tape<float>& tape, float*) {
        Chunk& c = chunks_[at(shard)];
        take_pixels(view, i, c);
        sample(shard, tape, c);
        set_target(c);
        if (c.samples == 0) return 0.;
        const auto keep_change = [&](const float* colours, std::vector<float>& seen) {
          change_on_rays(c.begin, c.weight, colours, c.unmarked.data(), &seen[at(3 * i * kRays)]);
        };
        keep_change(learnt_colours(tape, c, nullptr).rgb.value(), change_);
        keep_change(c.marked.data(), asked_);
        return 0.;
      },
      network_grads());
  guide_->read(turn, std::span(change_).first(at(3 * pixels)), std::span(asked_).first(at(3 * pixels)));
}

double Baker::take_step(double) {
  if (guide_ && steps() % kReadEvery == kReadEvery - 1) read_view(turns_until(steps()) - 1);
  const double loss = loop_.run(
      std::ssize(chunks_),
      [&](Index i, Index shard, Tape<float>& tape, float* grads) {
        Chunk& c = chunks_[at(i)];
        choose_rays(i, c);
        sample(shard, tape, c);
        set_target(c);
        return learn(c, tape, grads);
      },
      network_grads());
  if (field_.field.has_table()) backward_table();
  update();
  // Other scenes learn the whole mark: fern shows it to 0.1 dB after 780 steps.
  if (owner_.mark().has_gain() && is_object_of_hash(field_)) update_emphasis();
  return loss / static_cast<double>(chunks_.size());
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
  f.option("guide_views", options_.guide_views);
  f.option("guidance", options_.guidance);
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
  ScaledMark found{.psnr = meter(marked)};
  const double before = found.psnr;
  const std::vector<float> learnt(field_.params.values().begin(), field_.params.values().end());
  const Index every = meter.guess_step();
  double bias = every > 1 ? before - meter(marked, {}, every) : 0;
  for (int round = 0; round < kRounds && !is_near(found, target); ++round) {
    const double scale = found.scale;
    found = seek_scale(found, target, kLargestScale, [&](double next) {
      set_scale(next, learnt);
      return meter(marked, {}, every) + bias;
    });
    set_scale(found.scale, learnt);
    if (every == 1 || !std::isfinite(found.psnr) || found.scale == scale) break;
    const double guess = found.psnr - bias;
    found.psnr = meter(marked);
    bias = found.psnr - guess;
  }
  return {.learnt = before, .scaled = found.psnr, .scale = found.scale};
}

double Baker::psnr() const { return -10 * std::log10(std::max(loss(), 1e-10)); }

}  // namespace fieldmark::watermark
