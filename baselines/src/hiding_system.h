#pragma once
#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/nerf/dataset.h>
#include "crop_source.h"
#include "image_marker.h"

#include <array>
#include <memory>
#include <optional>
#include <string_view>

namespace fieldmark::baselines {

/// PSNR over the whole image at which images are marked, dB.
constexpr double kHidingStrength = 30;

/// How a system of paper_systems() uses a 2-D network.
struct HidingSystem {
  HidingKind kind = HidingKind::hidden;  ///< which network
  bool renders = false;  ///< true: marks renders of an unmarked field; false: its training images
};
/// Returns how a system uses a 2-D network; nullopt if it has none.
std::optional<HidingSystem> hiding_system(std::string_view system);

/// Returns the images of a split over its background, for crops.
std::vector<Tensor<float>> images_of(const nerf::Dataset& data);

/// Returns a data set whose images carry a message, each marked over the background of the data set.
/// Transparent pixels stay transparent and lose what the network added there, so that the fields with and
/// without a mark differ only in the colours of their images.
nerf::Dataset marked_images(const nerf::Dataset& data, const ImageMarker& marker,
                            const watermark::Message& message, double mark_psnr = kHidingStrength);

/// Returns the fraction of the bits of `sent` read correctly, mean over images [H, W, 3] in [0, 1].
/// @throws ValueError if there are no images   @throws ShapeError if one is not an image
double accuracy_of(const ImageMarker& marker, const std::vector<Tensor<float>>& images,
                   const watermark::Message& sent);

/// How reliably a 2-D network reads the images that it marked itself.
struct OwnScores {
  double accuracy = 0;  ///< fraction of bits correct, mean over images
  double psnr = 0;      ///< of the marked images, dB, mean
};
/// Measures on windows of images, each with a random message, rounded to 8 bits.
/// @param count  number of windows, at least 1   @param size  their side in pixels
OwnScores own_scores(const ImageMarker& marker, const CropSource& images, Index count, Index size,
                     std::uint64_t seed, double mark_psnr = kHidingStrength);

/// Alternates two fields trained on marked images, one for the message and one for its complement. A reader
/// with the same output for every image thus gets exactly half of the bits right.
/// @param fields  for `message` and its opposite()
MarkedScene marked_scene(const std::shared_ptr<const ImageMarker>& marker,
                         const std::array<std::shared_ptr<const nerf::RadianceField>, 2>& fields,
                         const watermark::Message& message);
/// Returns the message with every bit flipped.
watermark::Message opposite(const watermark::Message& message);

/// Marks renders of an unmarked field, each with its own message after rendering.
MarkedScene marked_renders(const std::shared_ptr<const ImageMarker>& marker,
                           const std::shared_ptr<const nerf::RadianceField>& field, std::uint64_t seed,
                           double mark_psnr = kHidingStrength);

}  // namespace fieldmark::baselines
