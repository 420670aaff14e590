#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/mark_network.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "in_blocks.h"

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

// Switches of version 0.1 that preset code sets.
Json code_fusion() { return Json::array({"late_direction", "raw_colour", "repeated"}); }

}  // namespace

FusionMarkOptions code_options() { return {.message_features = 128, .authors_code = true}; }

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
              // Keys of version 0.1 for the other kind.
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

// Colours of the message composited over the background.
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

}  // namespace fieldmark::watermark
