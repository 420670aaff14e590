#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/mark_network.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fixed_carriers.h"
#include "in_blocks.h"

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

// The squared norm of the content loss is a sum over the patch in the paper and a mean here.
const PooledTrainingOptions kWarm{
    .content_weight = 60, .content_psnr = 25.5, .matrix_rate = 2, .warm_steps = 1500};
constexpr Index kLessonMessages = 16, kLessonSamples = 512;  // messages per step, and samples of each
constexpr double kColourLesson = 30;  // weight of the squared error of colours relative to that of features

// Switches of version 0.1 that preset code sets.
Json code_fusion() { return Json::array({"late_direction", "raw_colour", "repeated"}); }

}  // namespace

FusionMarkOptions paper_options() {
  return {.width = 128, .message_features = 256, .channels = 32, .running_norm = true, .training = kWarm};
}

FusionMarkOptions code_options() {
  return {.message_features = 128, .authors_code = true, .training = kWarm};
}

GlobalMarkOptions network_options(const FusionMarkOptions& o, Index bits) {
  return {.bits = bits,
          .message_features = o.message_features > 0 ? o.message_features : o.width,
          .colour_features = o.width,
          .width = o.width,
          .authors_code = o.authors_code};
}

MarkMaker fusion_mark(const FusionMarkOptions& options) {
  return [options](const MarkSite& site) {
    GlobalMark<float> network(site.params, "mark", network_options(options, site.bits), site.seed + 100);
    return std::make_shared<FusionMark>(std::move(network), pooled_reader(site, options.channels), options);
  };
}

std::string FusionMark::configuration() const {
  const MarkNetworkOptions other;
  return Json{{"preset", preset()},
              {"width", options_.width},
              {"message_features", options_.message_features},
              {"fusion", options_.authors_code ? code_fusion() : Json::array()},
              {"channels", options_.channels},
              {"running_norm", options_.running_norm},
              // Keys of version 0.1 for the other kind of mark.
              {"bands", other.bands},
              {"features", other.features},
              {"tilt", other.tilt},
              {"shading", other.shading},
              {"red_green", other.red_green},
              {"luminance", other.luminance},
              {"base_channels", 32}}
      .dump();
}

FusionMarkOptions stored_fusion_mark(const std::string& configuration) {
  const Json j = Json::parse(configuration);
  FusionMarkOptions o{.authors_code = j.at("preset") == "code"};
  o.width = j.value("width", o.width);
  o.channels = j.value("channels", o.channels);
  o.message_features = j.value("message_features", o.message_features);
  o.running_norm = j.value("running_norm", o.running_norm);  // missing in older owners
  const Json fusion = j.value("fusion", Json::array());
  if (fusion != (o.authors_code ? code_fusion() : Json::array()))
    throw ValueError("[owner] fusion must be that of its preset, got an ablation of version 0.1: " +
                     fusion.dump());
  return o;
}

std::vector<float> FusionMark::network_colours(const nerf::RadianceField& field, const float* x,
                                               const float* rgb, Index n) const {
  if (!options_.authors_code) return {rgb, rgb + 3 * n};
  const nerf::Field<float>& net = field.field;
  std::vector<float> density(at(n * net.density_width())), colour(at(n * net.colour_width()));
  net.encode(field.params, x, n, density.data(), colour.data());
  Tape<float> tape;
  const Var<float> z = net.geometry(Params<float>(field.params, nullptr),
                                    tape.constant(density.data(), {n, net.density_width()}));
  std::vector<float> raw(at(4 * n));
  for (Index i = 0; i < n; ++i) {
    for (Index a = 0; a < 3; ++a) {
      const float c = std::clamp(rgb[3 * i + a], 1e-3f, 1 - 1e-3f);
      raw[at(4 * i + a)] = std::log(c / (1 - c));
    }
    raw[at(4 * i + 3)] = z.value()[i * net.geometry_width()] / 16;
  }
  return raw;
}

nerf::Renderer::Recolour FusionMark::recolour(const Owner& owner, std::vector<std::int8_t> signs) const {
  return in_blocks([this, &owner, message = std::vector<float>(signs.begin(), signs.end())](
                       Tape<float>& tape, const float* x, const float* d, Index n, float* rgb) {
    const std::vector<float> base = network_colours(owner.field, x, rgb, n);
    const Var<float> colour =
        network_(Params<float>(owner.params, nullptr), tape.constant(x, {n, 3}), tape.constant(d, {n, 3}),
                 tape.constant(base.data(), {n, network_.colour_inputs()}),
                 tape.constant(message.data(), {1, std::ssize(message)}));
    std::copy_n(colour.value(), 3 * n, rgb);
  });
}

// Composites the colours of the message over the background.
PooledMark::Painter FusionMark::painter(const Owner& owner, std::span<const CachedView> views) const {
  std::vector<std::vector<float>> colours;
  for (const CachedView& v : views)
    colours.push_back(network_colours(owner.field, v.position.data(), v.colour.data(),
                                      static_cast<Index>(v.weight.size())));
  const float level = nerf::background_value(owner.field.background);
  return [this, views, level, colours = std::move(colours)](Tape<float>& tape, const Params<float>& params,
                                                            const TrainingImage& image, Var<float> message) {
    const CachedView& v = views[at(image.view)];
    const Index samples = static_cast<Index>(v.weight.size()), pixels = v.height * v.width;
    const Var<float> colour = network_(
        params, tape.constant(image.positions, {samples, 3}), tape.constant(v.direction.data(), {samples, 3}),
        tape.constant(colours[at(image.view)].data(), {samples, network_.colour_inputs()}), message);
    float* behind = tape.scratch(3 * pixels);
    for (Index i = 0; i < pixels; ++i) {
      float opacity = 0;
      for (Index k = v.sample_begin[at(i)]; k < v.sample_begin[at(i + 1)]; ++k) opacity += v.weight[at(k)];
      std::fill_n(behind + 3 * i, 3, (1 - opacity) * level);
    }
    return add(weighted_segments<float>(colour, v.sample_begin, v.weight),
               tape.constant(behind, {pixels, 3}));
  };
}

// Samples for one step of the warm start, drawn from all views.
struct FusionMark::Lesson {
  float *position, *direction, *colour, *input, *marked, *carried, *message;
};

// The networks regress to the carriers' colours. The first N_b colour features regress to the texture of the
// bit that a place carries, so the fusion only has to multiply them by the message.
PooledMark::Learner FusionMark::learner(const Owner& owner, std::span<const CachedView> views) const {
  std::vector<Index> shown;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (!views[v].weight.empty()) shown.push_back(static_cast<Index>(v));
  return [this, &owner, views, shown = std::move(shown)](Tape<float>& tape, const Params<float>& params,
                                                         const FixedCarriers& carriers, Index step) {
    const Index bits = network_.options().bits, inputs = network_.colour_inputs(),
                n = kLessonMessages * kLessonSamples;
    const Lesson l = lesson(tape, owner, views, shown, carriers, step);
    const auto out = network_.with_features(
        params, tape.constant(l.position, {n, 3}), tape.constant(l.direction, {n, 3}),
        tape.constant(l.input, {n, inputs}), tape.constant(l.message, {kLessonMessages, bits}));
    const Var<float> colours =
        scale(mse_loss<float>(out.colour, tape.constant(l.marked, {n, 3})), kColourLesson);
    if (!out.features || out.features->shape()[1] < bits) return colours;
    return add(colours, mse_loss<float>(slice(*out.features, 0, bits), tape.constant(l.carried, {n, bits})));
  };
}

FusionMark::Lesson FusionMark::lesson(Tape<float>& tape, const Owner& owner,
                                      std::span<const CachedView> views, std::span<const Index> shown,
                                      const FixedCarriers& carriers, Index step) const {
  const Index bits = network_.options().bits, inputs = network_.colour_inputs(),
              n = kLessonMessages * kLessonSamples;
  const Lesson l{tape.scratch(3 * n),
                 tape.scratch(3 * n),
                 tape.scratch(3 * n),
                 tape.scratch(inputs * n),
                 tape.scratch(3 * n),
                 tape.scratch(bits * n),
                 tape.scratch(bits * kLessonMessages)};
  const CounterRng rng(owner.options().seed, 16);
  const auto one_of = [](std::uint32_t number, Index count) { return static_cast<Index>(number) % count; };
  std::fill_n(l.carried, bits * n, 0.f);
  for (Index i = 0; i < n; ++i) {
    const auto drawn = rng.bits(static_cast<std::uint64_t>(step * n + i));
    const CachedView& v = views[at(shown[at(one_of(drawn[0], std::ssize(shown)))])];
    const Index k = one_of(drawn[1], std::ssize(v.weight));
    std::copy_n(&v.position[at(3 * k)], 3, l.position + 3 * i);
    std::copy_n(&v.direction[at(3 * k)], 3, l.direction + 3 * i);
    std::copy_n(&v.colour[at(3 * k)], 3, l.colour + 3 * i);
    const auto carried = carriers.carried(l.position + 3 * i);
    if (carried.bit >= 0) l.carried[bits * i + carried.bit] = carried.wave;
  }
  const CounterRng messages(owner.options().seed, 17);
  for (Index m = 0; m < kLessonMessages; ++m) {
    const Message sent =
        random_message(bits, messages, static_cast<std::uint64_t>(step * kLessonMessages + m));
    for (Index b = 0; b < bits; ++b) l.message[m * bits + b] = sent.bits[at(b)] ? 1.f : -1.f;
    const Index first = 3 * m * kLessonSamples;
    carriers.mark({l.message + m * bits, at(bits)}, l.position + first, l.colour + first, kLessonSamples,
                  l.marked + first);
  }
  const std::vector<float> read = network_colours(owner.field, l.position, l.colour, n);
  std::copy(read.begin(), read.end(), l.input);
  return l;
}

}  // namespace fieldmark::watermark
