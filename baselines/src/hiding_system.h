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

/// Images are marked at this PSNR over the whole image, dB.
constexpr double kHidingStrength = 30;

/// How a system of paper_systems() uses a 2-D network.
struct HidingSystem {
  HidingKind kind = HidingKind::hidden;  ///< which network
  bool renders = false;  ///< marks renders of an unmarked field; else images, on which a field is trained
};
/// Nothing for a system that has no 2-D network.
std::optional<HidingSystem> hiding_system(std::string_view system);

/// The images of a split over its background, for crops.
std::vector<Tensor<float>> images_of(const nerf::Dataset& data);

/// A data set whose images carry a message, each marked over the background of the data set. Where a
/// image is transparent it stays so, and what the network left there is lost: the fields with and
/// without a mark then differ in their images' colours alone.
nerf::Dataset marked_images(const nerf::Dataset& data, const ImageMarker& marker,
                            const watermark::Message& message, double mark_psnr = kHidingStrength);

/// Share of the bits of `sent` that are read right, mean over images [H, W, 3] in [0, 1].
/// @throws ValueError if there are none   @throws ShapeError if one is not an image
double accuracy_of(const ImageMarker& marker, const std::vector<Tensor<float>>& images,
                   const watermark::Message& sent);

/// How well a 2-D network reads the images that it marked itself.
struct OwnScores {
  double accuracy = 0;  ///< share of bits right, mean over images
  double psnr = 0;      ///< of the marked images, dB, mean
};
/// On windows of images, each with a random message, rounded to 8 bits.
/// @param count  windows, at least 1   @param size  of their sides, pixels
OwnScores own_scores(const ImageMarker& marker, const CropSource& images, Index count, Index size,
                     std::uint64_t seed, double mark_psnr = kHidingStrength);

/// Fields trained on marked images, one for a message and one for the message with every bit flipped,
/// shown in turns: a reader that says the same of every image is right on half of the bits exactly.
/// @param fields  of `message` and of its opposite()
MarkedScene marked_scene(const std::shared_ptr<const ImageMarker>& marker,
                         const std::array<std::shared_ptr<const nerf::RadianceField>, 2>& fields,
                         const watermark::Message& message);
/// The message with every bit flipped.
watermark::Message opposite(const watermark::Message& message);

/// Renders of an unmarked field, each marked with a message of its own after it was rendered.
MarkedScene marked_renders(const std::shared_ptr<const ImageMarker>& marker,
                           const std::shared_ptr<const nerf::RadianceField>& field, std::uint64_t seed,
                           double mark_psnr = kHidingStrength);

}  // namespace fieldmark::baselines
