#pragma once
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/group_norm.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace fieldmark::extractor {

/// Options of a DenseExtractor.
struct DenseExtractorOptions {
  Index classes = 0;  ///< cells + 1 for the background, at least 2
  Index base = 32;    ///< channels at half resolution, a multiple of 8
};

/// Reads the mark at every place: which cell of the scene each 4 x 4 pixels show, and the sign of the mark
/// there. A U-shaped network: 2 x 2 pixels into channels, then 3 x 3 convolutions at 1/2 (base channels), 1/4
/// (2 base), 1/8 (3 base) and 1/16 (3 base) of the image; back up to 1/4 by bilinear interpolation with the
/// skipped features concatenated; and two heads of 1 x 1 convolutions. Group normalisation and ReLU follow
/// each 3 x 3 convolution, so that an image gives the same result in training and test, alone and in a batch.
/// Source: Ronneberger et al. 2015 (U-Net), figure 1; Wu and He 2018 (group normalisation). Departures: four
/// levels instead of five, zero padding instead of valid convolutions, and output at 1/4, because a place
/// needs no finer label and full resolution would cost 16 times as much.
template <class T>
class DenseExtractor {
 public:
  /// The network's output for every place of an image.
  struct Output {
    Var<T> sign;   ///< [P] logit that the mark is positive at each place, row-major
    Var<T> index;  ///< [P, classes] logits of the cell each place shows, the last class the background
    Index height;  ///< in places, H / 4 rounded down
    Index width;   ///< in places, W / 4 rounded down; P = height * width
  };

  /// Registers parameters "<name>/down0/conv/weight" and so on, about 620 base^2 + 2 base classes in all.
  /// @throws ValueError if an option is out of range, or the names are taken in the store
  DenseExtractor(ParamStore<T>& store, std::string_view name, const DenseExtractorOptions& options,
                 std::uint64_t seed);

  /// Place (i, j) covers pixels 4 i .. 4 i + 3, 4 j .. 4 j + 3. Up to 3 last rows and columns belong to no
  /// place (an odd last row or column is ignored).
  /// @param image [1, H, W, 3] in [0, 1], H and W at least 16   @throws ShapeError if it is not
  /// Differentiable in: image and the parameters; kinks of the ReLUs.
  Output operator()(const Params<T>& params, Var<T> image) const;

 private:
  struct Block {
    Conv2d<T> conv;
    GroupNorm<T> norm;
    Var<T> operator()(const Params<T>& params, Var<T> x) const { return norm(params, conv(params, x)); }
  };
  Var<T> up(const Params<T>& params, Var<T> coarse, Var<T> skip, const Block& block) const;

  std::vector<Block> down_;      // two per level, four levels
  std::vector<Block> up_;        // up to 1/8, then to 1/4
  std::vector<Dense<T>> heads_;  // sign, hidden layer of index, index
};

}  // namespace fieldmark::extractor
