#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/watermark/reading/blind_reader.h>
#include "surround.h"

#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr Index kLeastSide = 16;

}  // namespace

void check_finite(const char* op, const Tensor<float>& image) {
  const Index channels = image.shape[2], w = image.shape[1];
  for (Index i = 0; i < image.size(); ++i)
    if (!std::isfinite(image[i]))
      throw ValueError("[" + std::string(op) + "] image must be finite, got " + number_text(image[i]) +
                       " in row " + std::to_string(i / channels / w) + ", column " +
                       std::to_string(i / channels % w));
}

Tensor<float> opaque_image(const Tensor<float>& view_image, float background) {
  check_rank("blind_reader", "image", view_image.shape, 3, "[H, W, C]");
  const Index h = view_image.shape[0], w = view_image.shape[1], channels = view_image.shape[2];
  if (channels < 1 || channels > 4 || h < kLeastSide || w < kLeastSide)
    throw ShapeError("[blind_reader] image must be [H, W, 1 to 4] with sides of at least " +
                     std::to_string(kLeastSide) + ", got shape " + view_image.shape.str());
  check_finite("blind_reader", view_image);
  if (channels == 3) return view_image;
  Tensor<float> out({h, w, 3});
  const bool colour = channels >= 3, alpha = channels % 2 == 0;
  for (Index p = 0; p < h * w; ++p) {
    const float* from = view_image.data.data() + p * channels;
    const float a = alpha ? from[channels - 1] : 1.f;
    for (Index c = 0; c < 3; ++c) out[3 * p + c] = a * from[colour ? c : 0] + (1 - a) * background;
  }
  return out;
}

std::vector<double> BlindReader::evidence(const Tensor<float>& view_image) const {
  return evidence(view_image, nullptr);
}

std::vector<double> BlindReader::evidence(const Tensor<float>& view_image, SeenPlaces* places) const {
  const float background = nerf::background_value(owner_.field.background);
  const bool object = owner_.field.space.kind == nerf::SpaceKind::cube;
  const Surround cleared = clear_surround(opaque_image(view_image, background), background, object);
  const PatchSize size = owner_.options().patch();
  const Window window = object_window(cleared.image, background, size.aspect());
  const Tensor<float> image = cut_window(cleared.image, window, size, background);
  if (places) {
    *places = {.window = window};
    places->window.x += static_cast<double>(cleared.left);
    places->window.y += static_cast<double>(cleared.top);
  }
  return owner_.mark().evidence(owner_, image, places);
}

}  // namespace fieldmark::watermark
