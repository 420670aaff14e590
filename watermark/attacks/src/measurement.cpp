#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/attacks/measurement.h>

#include <algorithm>
#include <cmath>

#include "readers.h"

namespace fieldmark::watermark {
namespace {

struct Images {
  nerf::Rendering plain;
  Tensor<float> marked;  // 8 bits
};

class Views {
 public:
  Views(const Owner& owner, const nerf::RadianceField* baked)
      : owner_(owner), baked_(baked != nullptr), plain_(owner.field), marked_(baked ? *baked : owner.field) {}
  Images render(const nerf::Camera& camera, const CellCode& code, const Message& message) {
    if (!baked_) marked_.set_recolour(owner_.marking(cell_signs(code, message)));
    return {plain_.render(camera), quantize8(marked_.render(camera).rgb)};
  }

 private:
  const Owner& owner_;
  bool baked_;
  nerf::Renderer plain_, marked_;
};

}  // namespace

Measurement measure(const Owner& owner, const nerf::RadianceField* baked, const Message* message,
                    const MeasureOptions& options) {
  if ((baked == nullptr) != (message == nullptr))
    throw ValueError("[measure] baked and message must be given both or neither");
  if (options.cameras.empty()) throw ValueError("[measure] cameras must not be empty");
  std::vector<distort::Distortion> attacks;
  for (const std::string& name : options.under) attacks.push_back(distort::parse_distortion(name));
  const CounterRng messages(options.seed, 41), distortions(options.seed, 42);
  const float level = nerf::background_value(owner.field.background);
  const float background[3] = {level, level, level};
  const CellCode code = owner.code();
  Readers readers(owner, code, options.informed_views > 0);
  Views views(owner, baked);
  Accuracies accuracy;
  std::vector<double> psnr_whole, psnr_foreground, similarity, perceptual;
  std::vector<Accuracies> under(attacks.size());
  const auto total = static_cast<Index>(options.cameras.size());
  for (std::size_t i = 0; i < options.cameras.size(); ++i) {
    const auto view = static_cast<Index>(i);
    const Message sent = message            ? *message
                         : options.messages ? options.messages(view)
                                            : random_message(owner.options().bits, messages, i);
    const Images p = views.render(options.cameras[i], code, sent);
    const auto read = [&](const Tensor<float>& image, const std::string& name) {
      return readers.read(image, sent, view < options.informed_views, [&](const auto& evidence) {
        if (options.on_reading) options.on_reading(view, name, evidence, sent);
      });
    };
    accuracy.add(read(p.marked, ""));
    for (std::size_t a = 0; a < attacks.size(); ++a)
      under[a].add(read(
          distort::apply_distortion(attacks[a], p.marked, distortions, i * attacks.size() + a, background),
          options.under[a]));
    psnr_whole.push_back(psnr(p.marked, p.plain.rgb));
    psnr_foreground.push_back(psnr_masked(p.marked, p.plain.rgb, p.plain.opacity));
    const Tensor<float> plain = quantize8(p.plain.rgb);
    similarity.push_back(ssim(p.marked, plain));
    if (options.lpips && std::min(plain.shape[0], plain.shape[1]) >= options.lpips->smallest())
      perceptual.push_back(options.lpips->distance(p.marked, plain).value);
    if (options.progress && !options.progress(static_cast<Index>(i) + 1, total))
      throw Error("stopped while measuring");
  }
  Measurement m{.bits = owner.options().bits,
                .views = total,
                .baked = baked != nullptr,
                .accuracy = accuracy.mean(),
                .accuracy_p5 = percentile_5(accuracy.blind),
                .psnr_base = finite_mean(psnr_whole),
                .psnr_base_foreground = finite_mean(psnr_foreground),
                .ssim_base = finite_mean(similarity),
                .lpips_base = finite_mean(perceptual),
                .under = {},
                .informed_views = readers.informed() ? std::min(options.informed_views, total) : 0,
                .informed_seconds = readers.seconds(),
                .blind_seconds = readers.blind_seconds()};
  for (std::size_t a = 0; a < attacks.size(); ++a) m.under[options.under[a]] = under[a].mean();
  return m;
}

}  // namespace fieldmark::watermark
