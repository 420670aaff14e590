#include "hiding_system.h"
#include <fieldmark/imaging/metrics.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace fieldmark::baselines {

std::optional<HidingSystem> hiding_system(std::string_view system) {
  if (system == "hidden_nerf") return HidingSystem{HidingKind::hidden, false};
  if (system == "mbrs_nerf") return HidingSystem{HidingKind::mbrs, false};
  if (system == "nerf_hidden") return HidingSystem{HidingKind::hidden, true};
  if (system == "nerf_mbrs") return HidingSystem{HidingKind::mbrs, true};
  return std::nullopt;
}

std::vector<Tensor<float>> images_of(const nerf::Dataset& data) {
  std::vector<Tensor<float>> images;
  for (const nerf::View& view : data.views) images.push_back(nerf::composited(view, data.background));
  return images;
}

nerf::Dataset marked_images(const nerf::Dataset& data, const ImageMarker& marker,
                            const watermark::Message& message, double mark_psnr) {
  nerf::Dataset marked = data;
  const float level = nerf::background_value(data.background);
  for (nerf::View& view : marked.views) {
    const Tensor<float> image = marker.mark(nerf::composited(view, data.background), message, mark_psnr);
    for (Index p = 0; p < image.size() / 3; ++p) {
      const float alpha = view.rgba[4 * p + 3];
      for (Index c = 0; alpha > 0 && c < 3; ++c)
        view.rgba[4 * p + c] = std::clamp((image[3 * p + c] - (1 - alpha) * level) / alpha, 0.f, 1.f);
    }
  }
  return marked;
}

double accuracy_of(const ImageMarker& marker, const std::vector<Tensor<float>>& images,
                   const watermark::Message& sent) {
  if (images.empty()) throw ValueError("[accuracy_of] images must not be empty");
  double sum = 0;
  for (const Tensor<float>& image : images) sum += marker.accuracy(image, sent);
  return sum / static_cast<double>(images.size());
}

OwnScores own_scores(const ImageMarker& marker, const CropSource& images, Index count, Index size,
                     std::uint64_t seed, double mark_psnr) {
  if (count < 1) throw ValueError("[own_scores] count must be at least 1, got " + std::to_string(count));
  const CounterRng messages(seed, 43);
  OwnScores scores;
  for (Index i = 0; i < count; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const Tensor<float> image = images.crop(size, index);
    const auto sent = watermark::random_message(marker.options().bits, messages, index);
    const Tensor<float> marked = marker.mark(image, sent, mark_psnr);
    scores.accuracy += marker.accuracy(marked, sent);
    scores.psnr += psnr(marked, image);
  }
  // Divides once: a sum of quotients may exceed 1.
  scores.accuracy /= static_cast<double>(count);
  scores.psnr /= static_cast<double>(count);
  return scores;
}

watermark::Message opposite(const watermark::Message& message) {
  watermark::Message flipped = message;
  for (auto& bit : flipped.bits) bit = bit ? 0 : 1;
  return flipped;
}

MarkedScene marked_scene(const std::shared_ptr<const ImageMarker>& marker,
                         const std::array<std::shared_ptr<const nerf::RadianceField>, 2>& fields,
                         const watermark::Message& message) {
  struct Fields {
    explicit Fields(const std::array<std::shared_ptr<const nerf::RadianceField>, 2>& both)
        : held(both), first(*both[0]), second(*both[1]) {}
    std::array<std::shared_ptr<const nerf::RadianceField>, 2> held;
    nerf::Renderer first, second;
  };
  const auto shown = std::make_shared<Fields>(fields);
  return {.bits = marker->options().bits,
          .message = [=](Index view) { return view % 2 == 0 ? message : opposite(message); },
          .render =
              [=](const nerf::Camera& camera, const watermark::Message& sent) {
                return (sent == message ? shown->first : shown->second).render(camera).rgb;
              },
          .accuracy = [=](const Tensor<float>& image,
                          const watermark::Message& sent) { return marker->accuracy(image, sent); }};
}

MarkedScene marked_renders(const std::shared_ptr<const ImageMarker>& marker,
                           const std::shared_ptr<const nerf::RadianceField>& field, std::uint64_t seed,
                           double mark_psnr) {
  const auto renderer = std::make_shared<nerf::Renderer>(*field);
  const Index bits = marker->options().bits;
  return {.bits = bits,
          .message = [=](Index view) { return message_of_view(bits, seed, view); },
          .render =
              [=](const nerf::Camera& camera, const watermark::Message& sent) {
                (void)field;  // kept alive for the renderer
                return marker->mark(renderer->render(camera).rgb, sent, mark_psnr);
              },
          .accuracy = [=](const Tensor<float>& image,
                          const watermark::Message& sent) { return marker->accuracy(image, sent); }};
}

}  // namespace fieldmark::baselines
