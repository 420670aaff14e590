#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Images that cannot show a mark: what the test says of them shows what it says without one.
struct Control {
  std::string name;                   ///< one word
  std::string meaning;                ///< a sentence on what it is and what it shows
  std::vector<Tensor<float>> images;  ///< [H, W, 3] each
};

/// An image cut into equal squares, `across` of them along its shorter side, put together in a random order:
/// every colour and the finest detail stay, the object is gone. Rows and columns left over are dropped.
/// @param image  [H, W, C], both sides at least `across`   @param across  at least 1
/// @throws ShapeError if it is no image or too small   @throws ValueError if across is below 1
Tensor<float> shuffled_blocks(const Tensor<float>& image, Index across, const CounterRng& rng,
                              std::uint64_t index);

/// Three controls that every owner has:
///   blank     one image in the background's colour: what key and extractor give of themselves
///   unmarked  novel views of the owner's field as it was before the mark: the scene without the mark
///   shuffled  the images in question in 16 blocks across (shuffled_blocks()): their colours without the
///             scene
/// Images with inverted colours or mirrored are none: the one turns every sign of the mark, the other
/// leaves small parts of it readable.
/// @param images  in question, [H, W, 1 to 4], sides of at least 16; the first `views` are shuffled, and as
///                  many views rendered
/// @param views     at least 1   @throws ValueError if there is no image or views is below 1
std::vector<Control> built_in_controls(const Owner& owner, std::span<const Tensor<float>> images, Index views,
                                       std::uint64_t seed);

}  // namespace fieldmark::watermark
