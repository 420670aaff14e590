#include "message_field.h"
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/field_sampler.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr Index kKnots = 513;     // of G ...
constexpr float kRange = 16;      // ... from -kRange to kRange
constexpr Index kBlock = 256;     // rays of an unrecorded image at a time
constexpr float kTrainFiner = 1;  // samples as in the training of the base field
constexpr const char* kName = "mark/";

MessageFieldOptions checked(const MessageFieldOptions& o, const nerf::RadianceField& base) {
  if (o.bits < 1 || o.width < 2)
    throw ValueError("[message_field] bits must be at least 1 and width at least 2, got " +
                     std::to_string(o.bits) + " and " + std::to_string(o.width));
  if (o.place == MessagePlace::inputs && !base.field.has_table())
    throw ValueError(
        "[message_field] base must have a table for a message beside its inputs, got an mlp field");
  return o;
}

// A layer of the base field with `more` extra inputs, initialised with the base field's weights if any.
Dense<float> widened(ParamStore<float>& store, const nerf::RadianceField& base, const std::string& name,
                     Index more, Activation activation, std::uint64_t seed) {
  const ParamStore<float>& from = base.params;
  const Shape shape = from.entry(from.find(name + "/weight")).shape;
  const Dense<float> layer(store, kName + name,
                           {.in = shape[0] + more, .out = shape[1], .activation = activation}, seed);
  for (const char* part : {"/weight", "/bias"}) {
    const auto values = from.values(from.find(name + part));
    std::copy(values.begin(), values.end(), store.values(store.find(kName + name + part)).begin());
  }
  return layer;
}

}  // namespace

// Samples of the base field along some rays, in memory of the tape: the samples do not outlive the pass.
struct MessageField::Rays {
  std::span<const Index> begin;  // R + 1 offsets
  Var<float> density_features;   // [S, density_width()]; empty for an mlp field
  Var<float> colour_features;    // [S, colour_width()]
  Var<float> direction;          // [S, direction_width()]
  Var<float> z;                  // [S, geometry_width()] of the base field; empty for `inputs`
  Var<float> delta;              // [S]
};

MessageField::MessageField(ParamStore<float>& store, const nerf::RadianceField& base,
                           const MessageFieldOptions& options)
    : options_(checked(options, base)) {
  const std::uint64_t seed = options.seed + 300;
  const Index n = options.bits;
  if (options.place == MessagePlace::inputs) {
    density_ = {widened(store, base, "density/0", n, Activation::relu, seed + 1),
                widened(store, base, "density/1", 0, Activation::none, seed + 2)};
    colour_ = {widened(store, base, "colour/0", n, Activation::relu, seed + 3),
               widened(store, base, "colour/1", 0, Activation::relu, seed + 4),
               widened(store, base, "colour/2", 0, Activation::none, seed + 5)};
    return;
  }
  const Index widths[] = {1 + n, options.width, options.width / 2, 1};
  for (int k = 0; k < 3; ++k)
    density_.emplace_back(
        store, kName + ("geometry/" + std::to_string(k)),
        DenseOptions{
            .in = widths[k], .out = widths[k + 1], .activation = k < 2 ? Activation::relu : Activation::none},
        seed + static_cast<std::uint64_t>(k));
}

// z_0 + G(z_0 / 16, M) [S, 1].
Var<float> MessageField::changed(const Params<float>& params, Var<float> z_0, Var<float> message) const {
  Tape<float>& tape = message.tape();
  float* knots = tape.scratch(kKnots);
  for (Index k = 0; k < kKnots; ++k)
    knots[k] = 2 * static_cast<float>(k) / static_cast<float>(kKnots - 1) - 1;
  Var<float> g = concatenate<float>({tape.constant(knots, {kKnots, 1}), broadcast_rows(message, kKnots)});
  for (const auto& layer : density_) g = layer(params, g);

  const Index n = z_0.shape()[0];
  auto *below = tape.scratch<std::int32_t>(n), *above = tape.scratch<std::int32_t>(n);
  float *near = tape.scratch(n), *far = tape.scratch(n);
  for (Index i = 0; i < n; ++i) {
    const float place =
        std::clamp((z_0.value()[i] / kRange + 1) / 2, 0.f, 1.f) * static_cast<float>(kKnots - 1);
    below[i] = std::min(static_cast<std::int32_t>(place), static_cast<std::int32_t>(kKnots - 2));
    above[i] = below[i] + 1;
    far[i] = place - static_cast<float>(below[i]);
    near[i] = 1 - far[i];
  }
  const auto part = [&](const std::int32_t* index, const float* weight) {
    return mul(gather_rows(g, std::span<const std::int32_t>(index, at(n))), tape.constant(weight, {n, 1}));
  };
  return add(z_0, add(part(below, near), part(above, far)));
}

// Marches the rays through pixels begin to end - 1 of a camera.
MessageField::Rays MessageField::march(Tape<float>& tape, const nerf::RadianceField& base,
                                       const nerf::Camera& camera, Index begin, Index end,
                                       const nerf::RenderOptions& options) const {
  const Index rays = end - begin;
  std::vector<float> pixels;
  pixels.reserve(static_cast<std::size_t>(2 * rays));
  for (Index p = begin; p < end; ++p) {
    const Index column = p % camera.width, row = p / camera.width;
    pixels.push_back(static_cast<float>(column));
    pixels.push_back(static_cast<float>(row));
  }
  nerf::CubeRays cube;
  cube.resize(rays);
  cube.set(base.space, 0, camera, pixels);
  nerf::FieldSampler sampler;
  nerf::RaySamples s;
  sampler.sample(base, cube.batch(base.space), {},
                 {.finer = options.finer,
                  .stop = options.stop,
                  .points = options.points.value_or(base.options().points)},
                 s);

  const Index n = s.size();
  const auto kept = [&](const std::vector<float>& from, Shape shape) {
    float* to = tape.scratch(std::ssize(from));
    std::copy(from.begin(), from.end(), to);
    return tape.constant(to, shape);
  };
  Index* ray_begin = tape.scratch<Index>(rays + 1);
  std::copy(s.ray_begin.begin(), s.ray_begin.end(), ray_begin);
  auto* ray = tape.scratch<std::int32_t>(n);
  for (Index r = 0; r < rays; ++r)
    std::fill(ray + ray_begin[r], ray + ray_begin[r + 1], static_cast<std::int32_t>(r));
  if (s.delta.empty()) s.delta.assign(at(n), base.step() / options.finer);

  const nerf::Field<float>& net = base.field;
  const Var<float> features = kept(s.density_features, {n, net.has_table() ? net.density_width() : 0});
  const Var<float> z = !s.z.empty() ? kept(s.z, {n, net.geometry_width()})
                       : options_.place == MessagePlace::density
                           ? net.geometry(Params<float>(base.params, nullptr), features)
                           : features;
  return {.begin = {ray_begin, at(rays + 1)},
          .density_features = features,
          .colour_features = kept(s.colour_features, {n, net.colour_width()}),
          .direction = gather_rows(net.encode_directions(kept(cube.seen_from, {rays, 3})),
                                   std::span<const std::int32_t>(ray, at(n))),
          .z = z,
          .delta = kept(s.delta, {n})};
}

// Computes the colours [pixels, 3] of pixels begin to end - 1.
Var<float> MessageField::pixels(Tape<float>& tape, const Params<float>& params,
                                const nerf::RadianceField& base, const nerf::Camera& camera, Index begin,
                                Index end, const nerf::RenderOptions& options, Var<float> message) const {
  check_rank("message_field", "message", message.shape(), 2, "[1, N_b]");
  check_extent("message_field", "message", message.shape(), 0, 1, "one message for all places");
  check_extent("message_field", "message", message.shape(), 1, options_.bits, "bits of the field");
  const Rays r = march(tape, base, camera, begin, end, options);
  const nerf::Field<float>& net = base.field;
  Var<float> log_density = message, rgb = message;
  if (options_.place == MessagePlace::inputs) {
    const Var<float> bits = broadcast_rows(message, r.delta.shape()[0]);
    const Var<float> z =
        density_[1](params, density_[0](params, concatenate<float>({r.density_features, bits})));
    log_density = slice(z, 0, 1);
    rgb = concatenate<float>({z, r.colour_features, r.direction, bits});
    for (const auto& layer : colour_) rgb = layer(params, rgb);
    rgb = sigmoid(rgb);
  } else {
    log_density = changed(params, slice(r.z, 0, 1), message);
    rgb = net.colour(Params<float>(base.params, nullptr), r.z, r.colour_features, r.direction);
  }
  const Var<float> seen = nerf::composite<float>(net.density(log_density), rgb, r.delta, r.begin);
  // C + (1 - A) background, with C and A multiplied by a matrix.
  const float level = nerf::background_value(base.background);
  float *over = tape.scratch(12), *behind = tape.scratch(3 * (end - begin));
  for (int i = 0; i < 12; ++i) over[i] = i >= 9 ? -level : (i % 4 == 0 ? 1.f : 0.f);
  std::fill_n(behind, 3 * (end - begin), level);
  return add(matmul(seen, tape.constant(over, {4, 3})), tape.constant(behind, {end - begin, 3}));
}

Var<float> MessageField::image(Tape<float>& tape, const Params<float>& params,
                               const nerf::RadianceField& base, const nerf::Camera& camera,
                               Var<float> message) const {
  return pixels(tape, params, base, camera, 0, camera.height * camera.width, {.finer = kTrainFiner}, message);
}

Tensor<float> MessageField::render(const ParamStore<float>& store, const nerf::RadianceField& base,
                                   const nerf::Camera& camera, std::span<const std::int8_t> signs,
                                   const nerf::RenderOptions& options) const {
  const std::vector<float> bits(signs.begin(), signs.end());
  const Params<float> params(store, nullptr);
  Tensor<float> image({camera.height, camera.width, 3});
  const Index count = camera.height * camera.width;
  parallel_for((count + kBlock - 1) / kBlock, 1, [&](Index first, Index last) {
    Tape<float> tape;
    for (Index block = first; block < last; ++block) {
      tape.reset();
      const Index begin = block * kBlock, end = std::min(begin + kBlock, count);
      const Var<float> rgb = pixels(tape, params, base, camera, begin, end, options,
                                    tape.constant(bits.data(), {1, std::ssize(bits)}));
      for (Index i = 0; i < 3 * (end - begin); ++i)
        image[3 * begin + i] = std::clamp(rgb.value()[i], 0.f, 1.f);
    }
  });
  return image;
}

}  // namespace fieldmark::baselines
