#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/rendered_dataset.h>
#include <fieldmark/watermark/attacks/extractor_attack.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/power_budget.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

void check(const Tensor<float>& view_image, const Tensor<float>& object, const ExtractorAttackOptions& o) {
  check_rank("extractor_attack", "image", view_image.shape, 3, "[H, W, 3]");
  if (view_image.shape[2] != 3 || object.shape != Shape{view_image.shape[0], view_image.shape[1]})
    throw ShapeError("[extractor_attack] image must be [H, W, 3] and object [H, W], got " +
                     view_image.shape.str() + " and " + object.shape.str());
  if (!(o.mark_psnr >= 10 && o.mark_psnr <= 60))
    throw ValueError("[extractor_attack] mark_psnr must be 10 to 60 dB, got " + number_text(o.mark_psnr));
  if (o.steps < 1)
    throw ValueError("[extractor_attack] steps must be at least 1, got " + std::to_string(o.steps));
  if (!(o.step > 0 && o.step <= 1))
    throw ValueError("[extractor_attack] step must be above 0 and at most 1, got " + number_text(o.step));
}

// Adds `factor` times the unit vector of `from`; a zero vector adds nothing.
void add_direction(const std::vector<float>& from, double factor, std::vector<float>& to) {
  double squares = 0;
  for (const float x : from) squares += static_cast<double>(x) * static_cast<double>(x);
  const auto scale = static_cast<float>(squares > 0 ? factor / std::sqrt(squares) : 0);
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += scale * from[i];
}

// Draws normal random numbers on the foreground.
std::vector<float> first_residual(const Tensor<float>& object, const CounterRng& rng) {
  std::vector<float> r(at(3 * object.size()), 0.f);
  for (Index p = 0; p < object.size(); ++p)
    if (object[p] > 0.5f) {
      const auto z = rng.normal4(static_cast<std::uint64_t>(p));
      std::copy_n(z.data(), 3, &r[at(3 * p)]);
    }
  return r;
}

}  // namespace

Tensor<float> against_extractor(const Owner& owner, const Tensor<float>& view_image,
                                const Tensor<float>& object, const ExtractorAttackOptions& options) {
  check(view_image, object, options);
  const auto confirmation = owner.mark().confirmation(owner, view_image);
  const Index pixels = object.size();
  const double target = std::pow(10.0, -options.mark_psnr / 20);
  std::vector<float> mask(at(pixels)), gradient(at(3 * pixels)), next(at(3 * pixels)),
      residual = first_residual(object, CounterRng(options.seed, 41));
  for (Index p = 0; p < pixels; ++p) mask[at(p)] = object[p] > 0.5f ? 1.f : 0.f;
  Tape<float> tape;
  const auto changed = [&] {
    tape.reset();
    const Var<float> r = tape.fresh_leaf(residual.data(), gradient.data(), {pixels, 3});
    return add(tape.constant(view_image.data.data(), {pixels, 3}), power_budget<float>(r, mask, target));
  };
  for (Index k = 0; k < options.steps; ++k) {
    tape.backward(confirmation(changed()));
    for (Index p = 0; p < pixels; ++p)
      if (mask[at(p)] == 0) std::fill_n(&gradient[at(3 * p)], 3, 0.f);
    std::ranges::fill(next, 0.f);
    add_direction(residual, 1, next);
    add_direction(gradient, options.step, next);
    residual.swap(next);
  }
  Tensor<float> out(view_image.shape);
  const float* y = changed().value();
  std::transform(y, y + 3 * pixels, out.data.begin(), [](float x) { return std::clamp(x, 0.f, 1.f); });
  return out;
}

nerf::Dataset renders_against_extractor(const Owner& owner, const nerf::RadianceField& field, Index views,
                                        const ExtractorAttackOptions& options,
                                        const std::function<bool(Index done, Index total)>& progress) {
  std::vector<nerf::Camera> cameras;
  for (const CachedView& v : cache_novel_views(field, owner.options().patch(), views, options.seed + 51))
    cameras.push_back(v.camera);
  nerf::Dataset data = nerf::rendered_dataset(field, cameras);
  const float background = nerf::background_value(field.background);
  ExtractorAttackOptions of_view = options;
  for (nerf::View& view : data.views) {
    Tensor<float>& rgba = view.rgba;
    Tensor<float> object({rgba.shape[0], rgba.shape[1]});
    for (Index p = 0; p < object.size(); ++p) object[p] = rgba[4 * p + 3];
    const Tensor<float> changed =
        against_extractor(owner, nerf::composited(view, field.background), object, of_view);
    // Converts back to straight alpha: a composited pixel changes by opacity times the change of its colour.
    for (Index p = 0; p < object.size(); ++p)
      for (Index c = 0; c < 3 && object[p] > 0.5f; ++c)
        rgba[4 * p + c] =
            std::clamp((changed[3 * p + c] - (1 - object[p]) * background) / object[p], 0.f, 1.f);
    ++of_view.seed;
    const Index done = &view - data.views.data() + 1;
    if (progress && !progress(done, std::ssize(data.views)))
      throw Error("stopped while attacking the extractor");
  }
  return data;
}

}  // namespace fieldmark::watermark
