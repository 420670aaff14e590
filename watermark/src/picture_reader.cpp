#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/object_window.h>
#include <fieldmark/watermark/picture_reader.h>

namespace fieldmark::watermark {
namespace {

constexpr Index kLeastSide = 16;

// Any 8-bit picture as [H, W, 3] over the background.
Tensor<float> rgb(const Tensor<float>& picture, float background) {
  check_rank("picture_reader", "picture", picture.shape, 3, "[H, W, C]");
  const Index h = picture.shape[0], w = picture.shape[1], channels = picture.shape[2];
  if (channels < 1 || channels > 4 || h < kLeastSide || w < kLeastSide)
    throw ShapeError("[picture_reader] picture must be [H, W, 1 to 4] with sides of at least " +
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

}  // namespace

std::vector<double> PictureReader::evidence(const Tensor<float>& picture) const {
  const float background = nerf::background_value(owner_.field.background);
  const Tensor<float> whole = rgb(picture, background);
  const Index size = owner_.options().reader_size;
  const Tensor<float> image = cut_window(whole, object_window(whole, background), size, background);
  Tape<float> tape;
  const Params<float> params(owner_.params, nullptr);
  const Var<float> input = tape.constant(image.data.data(), {1, size, size, 3});
  if (owner_.pooled_reader) {
    const Var<float> logits = (*owner_.pooled_reader)(params, input);
    return {logits.value(), logits.value() + logits.shape().size()};
  }
  const auto out = (*owner_.reader)(params, input);
  std::vector<double> evidence(static_cast<std::size_t>(owner_.cells.count()));
  extractor::cell_evidence(out.sign.value(), out.index.value(), out.height * out.width, owner_.cells.count(),
                           evidence.data());
  return evidence;
}

}  // namespace fieldmark::watermark
