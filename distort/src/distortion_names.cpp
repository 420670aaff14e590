#include "distortion_names.h"

#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

// Names of distortions and chains.
namespace fieldmark::distort {
namespace {

struct Kind {
  std::string_view name;
  DistortionKind kind;
  double low, high;
};
constexpr std::array<Kind, 19> kKinds{{{"noise", DistortionKind::noise, 0, 1},
                                       {"rotation", DistortionKind::rotation, 0, 180},
                                       {"scale", DistortionKind::scale, 0.01, 4},
                                       {"scale-nearest", DistortionKind::scale_nearest, 0.01, 4},
                                       {"scale-bilinear", DistortionKind::scale_bilinear, 0.01, 4},
                                       {"scale-bicubic", DistortionKind::scale_bicubic, 0.01, 4},
                                       {"scale-lanczos", DistortionKind::scale_lanczos, 0.01, 4},
                                       {"blur", DistortionKind::blur, 0, 100},
                                       {"crop", DistortionKind::crop, 0.0001, 1},
                                       {"jpeg", DistortionKind::jpeg, 1, 100},
                                       {"jpeg444", DistortionKind::jpeg444, 1, 100},
                                       {"webp", DistortionKind::webp, 1, 100},
                                       {"h264", DistortionKind::h264, 0, 51},
                                       {"gamma", DistortionKind::gamma, 0.01, 10},
                                       {"brightness", DistortionKind::brightness, 0, 10},
                                       {"contrast", DistortionKind::contrast, 0, 10},
                                       {"hue", DistortionKind::hue, -360, 360},
                                       {"stretch", DistortionKind::stretch, 0.25, 4},
                                       {"part", DistortionKind::part, 0.05, 1}}};
// A kind without a severity.
struct PlainKind {
  std::string_view name;
  DistortionKind kind;
};
constexpr std::array<PlainKind, 13> kPlainKinds{{{"greyscale", DistortionKind::greyscale},
                                                 {"sepia", DistortionKind::sepia},
                                                 {"mirror", DistortionKind::mirror},
                                                 {"pillarbox", DistortionKind::pillarbox},
                                                 {"letterbox", DistortionKind::letterbox},
                                                 {"background_black", DistortionKind::background_black},
                                                 {"background_white", DistortionKind::background_white},
                                                 {"background_grey", DistortionKind::background_grey},
                                                 {"background_green", DistortionKind::background_green},
                                                 {"background_noise", DistortionKind::background_noise},
                                                 {"background_shapes", DistortionKind::background_shapes},
                                                 {"caption", DistortionKind::caption},
                                                 {"collage", DistortionKind::collage}}};
// Names that expand to a chain.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kChains{
    {{"combined", "noise_0.10,crop_0.40,jpeg_50"},
     {"screenshot", "scale-bicubic_1.25,blur_0.5,gamma_1.1,scale-lanczos_0.8,jpeg_80"}}};

bool is_whole(DistortionKind kind) {
  using enum DistortionKind;
  return kind == jpeg || kind == jpeg444 || kind == webp || kind == h264;
}

// Rejects a chain that this build cannot apply before the work begins, by trying it on an arbitrary image.
void check_library(const Distortion::Step& step) {
  const Tensor<float> pixel({1, 1, 3});
  if (step.kind == DistortionKind::webp) encode_webp(pixel, static_cast<int>(step.amount));
  if (step.kind == DistortionKind::jpeg) encode_jpeg(pixel, static_cast<int>(step.amount));
}

std::string range_of(const Kind& k) {
  char text[64];
  std::snprintf(text, sizeof text, "%g to %g%s", k.low, k.high, is_whole(k.kind) ? ", whole" : "");
  return text;
}

[[noreturn]] void fail(std::string_view name, const Kind& kind) {
  throw ValueError("[distortion] name: " + std::string(kind.name) + "_A must have A in " + range_of(kind) +
                   ", got '" + std::string(name) + "'");
}

[[noreturn]] void fail(std::string_view name) {
  std::string text = "[distortion] name: must be a chain, separated by commas, of";
  for (const Kind& k : kKinds) text += " " + std::string(k.name) + "_A (" + range_of(k) + "),";
  for (const PlainKind& k : kPlainKinds) text += " " + std::string(k.name) + ",";
  text.pop_back();
  for (const auto& chain : kChains) text += ", " + std::string(chain.first);
  throw ValueError(text + ", got '" + std::string(name) + "'");
}

Distortion::Step parse_step(std::string_view name) {
  for (const PlainKind& plain : kPlainKinds)
    if (name == plain.name) return {plain.kind, 0};
  const std::size_t line = name.find('_');
  const auto kind = std::find_if(kKinds.begin(), kKinds.end(),
                                 [&](const Kind& k) { return k.name == name.substr(0, line); });
  if (kind == kKinds.end()) fail(name);
  if (line == std::string_view::npos) fail(name, *kind);
  const char *begin = name.data() + line + 1, *end = name.data() + name.size();
  double amount = 0;
  const auto [stop, error] = std::from_chars(begin, end, amount);
  // Written so that NaN fails.
  if (error != std::errc() || stop != end || !(amount >= kind->low && amount <= kind->high) ||
      (is_whole(kind->kind) && amount != std::floor(amount)))
    fail(name, *kind);
  const Distortion::Step step{kind->kind, amount};
  check_library(step);
  return step;
}

}  // namespace

void refuse_clip(const Distortion& distortion) {
  if (needs_clip(distortion))
    throw ValueError("[distortion] name: h264 needs a clip, images in order, where '" + distortion.name +
                     "' is for single images; `fieldmark distort` applies it to a folder");
}

bool needs_clip(const Distortion& distortion) {
  return std::ranges::any_of(distortion.steps,
                             [](const auto& step) { return step.kind == DistortionKind::h264; });
}

Distortion parse_distortion(std::string_view name) {
  Distortion distortion = parse_clip_distortion(name);
  refuse_clip(distortion);
  return distortion;
}

Distortion parse_clip_distortion(std::string_view name) {
  Distortion distortion{.name = std::string(name), .steps = {}};
  std::string_view rest = name;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    const std::string_view step = rest.substr(0, comma);
    const auto chain =
        std::find_if(kChains.begin(), kChains.end(), [&](const auto& c) { return c.first == step; });
    if (chain != kChains.end()) {
      for (const auto& s : parse_clip_distortion(chain->second).steps) distortion.steps.push_back(s);
    } else {
      distortion.steps.push_back(parse_step(step));
    }
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
  }
  return distortion;
}

std::vector<Distortion> clip_stages(const Distortion& distortion) {
  std::vector<Distortion> stages;
  bool alone = true;  // true if the last stage accepts no more steps
  for (std::size_t i = 0; i < distortion.steps.size(); ++i) {
    const bool clip = distortion.steps[i].kind == DistortionKind::h264;
    if (clip || alone)
      stages.push_back({.name = distortion.name, .steps = {}, .first = distortion.first + i});
    stages.back().steps.push_back(distortion.steps[i]);
    alone = clip;
  }
  return stages;
}

}  // namespace fieldmark::distort
