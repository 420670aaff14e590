#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Images that cannot show a mark, which calibrate the test.
struct Control {
  std::string name;                   ///< one word
  std::string meaning;                ///< a sentence for readers of the report
  std::vector<Tensor<float>> images;  ///< [H, W, 3] each
};

/// Shuffles equal squares of an image, `across` of them along its shorter side. Keeps colours and fine detail
/// but destroys the scene. Drops left-over rows and columns.
/// @param image  [H, W, C], both sides at least `across`   @param across  at least 1
/// @throws ShapeError if it is not an image or is too small   @throws ValueError if across is below 1
Tensor<float> shuffled_blocks(const Tensor<float>& image, Index across, const CounterRng& rng,
                              std::uint64_t index);

/// Makes the three controls that are available for every owner:
///   blank     an image of the background's colour: the bias of key and extractor
///   unmarked  novel views of the owner's unmarked field: the scene without the mark
///   shuffled  the given images in 16 blocks across (shuffled_blocks()): their colours without the scene
/// @param images  [H, W, 1 to 4], sides of at least 16; the first `views` are shuffled, and as many views
/// rendered
/// @param views  at least 1   @throws ValueError without images or if views is below 1
std::vector<Control> built_in_controls(const Owner& owner, std::span<const Tensor<float>> images, Index views,
                                       std::uint64_t seed);

}  // namespace fieldmark::watermark
