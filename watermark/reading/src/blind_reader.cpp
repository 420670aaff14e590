#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr Index kLeastSide = 16;

// The likeliest class of each place and its softmax.
void likeliest(const float* logits, Index classes, SeenPlaces& places) {
  const Index n = places.height * places.width;
  places.cell.resize(static_cast<std::size_t>(n));
  places.share.resize(static_cast<std::size_t>(n));
  for (Index p = 0; p < n; ++p) {
    const float* row = logits + p * classes;
    const float* most = std::max_element(row, row + classes);
    double total = 0;
    for (Index c = 0; c < classes; ++c) total += std::exp(static_cast<double>(row[c] - *most));
    const Index cell = most - row;
    places.cell[static_cast<std::size_t>(p)] = cell + 1 < classes ? static_cast<std::int32_t>(cell) : -1;
    places.share[static_cast<std::size_t>(p)] = static_cast<float>(1 / total);
  }
}

}  // namespace

Tensor<float> opaque_image(const Tensor<float>& picture, float background) {
  check_rank("blind_reader", "image", picture.shape, 3, "[H, W, C]");
  const Index h = picture.shape[0], w = picture.shape[1], channels = picture.shape[2];
  if (channels < 1 || channels > 4 || h < kLeastSide || w < kLeastSide)
    throw ShapeError("[blind_reader] image must be [H, W, 1 to 4] with sides of at least " +
                     std::to_string(kLeastSide) + ", got shape " + picture.shape.str());
  if (channels == 3) return picture;
  Tensor<float> out({h, w, 3});
  const bool colour = channels >= 3, alpha = channels % 2 == 0;
  for (Index p = 0; p < h * w; ++p) {
    const float* from = picture.data.data() + p * channels;
    const float a = alpha ? from[channels - 1] : 1.f;
    for (Index c = 0; c < 3; ++c) out[3 * p + c] = a * from[colour ? c : 0] + (1 - a) * background;
  }
  return out;
}

std::vector<double> BlindReader::evidence(const Tensor<float>& picture) const {
  return evidence(picture, nullptr);
}

std::vector<double> BlindReader::evidence(const Tensor<float>& picture, SeenPlaces* places) const {
  const float background = nerf::background_value(owner_.field.background);
  const Tensor<float> whole = opaque_image(picture, background);
  const PatchSize size = owner_.options().patch();
  const Window window = object_window(whole, background, size.aspect());
  const Tensor<float> image = cut_window(whole, window, size, background);
  Tape<float> tape;
  const Params<float> params(owner_.params, nullptr);
  const Var<float> input = tape.constant(image.data.data(), {1, size.height, size.width, 3});
  if (places) *places = {.window = window};
  if (owner_.pooled_reader) {
    const Var<float> logits = (*owner_.pooled_reader)(params, input);
    return {logits.value(), logits.value() + logits.shape().size()};
  }
  const auto out = (*owner_.reader)(params, input);
  std::vector<double> evidence(static_cast<std::size_t>(owner_.cells.count()));
  extractor::cell_evidence(out.sign.value(), out.index.value(), out.height * out.width, owner_.cells.count(),
                           evidence.data());
  if (places) {
    places->height = out.height;
    places->width = out.width;
    likeliest(out.index.value(), owner_.cells.count() + 1, *places);
  }
  return evidence;
}

}  // namespace fieldmark::watermark
