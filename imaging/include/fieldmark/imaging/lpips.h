#pragma once
#include <fieldmark/imaging/pretrained_conv.h>

#include <vector>

namespace fieldmark {

/// The networks whose features LPIPS compares: AlexNet at 5 depths, SqueezeNet 1.1 at 7.
enum class LpipsNetwork { alex, squeeze };

/// Returns the tensors of a network's weight file: convolutions, "lin<k>.weight" [1, C, 1, 1] and
/// "scaling.shift", "scaling.scale" [3].
std::vector<WeightTensor> lpips_tensors(LpipsNetwork network);

/// Result of Lpips::distance().
struct LpipsDistance {
  double value = 0;               ///< sum over the depths, >= 0
  std::vector<double> per_layer;  ///< contribution of each depth, shallowest first
};

/// Learned perceptual distance of images (LPIPS, version 0.1).
///   lpips(a, b) = sum_k feature_distance(f_k(a), f_k(b), lin_k)
/// where f_k are the features at depth k, after a ReLU, of a network trained on ImageNet. Its input is
/// ((2 x - 1) - shift) / scale. Source: Zhang et al. 2018 (The unreasonable effectiveness of deep features),
/// eq. 1; version 0.1 of the authors' linear layers. Gradients reach the images; the weights are fixed.
template <class T>
class Lpips {
 public:
  /// @throws IoError if the file lacks a tensor of lpips_tensors() or one has another shape
  Lpips(const SafetensorsFile& file, LpipsNetwork network);

  /// Least height and width of an image: 31 for AlexNet, 17 for SqueezeNet. Smaller images leave a pooling
  /// layer without a window.
  Index smallest() const { return smallest_; }

  /// @param x  [N, H, W, 3] in [0, 1], RGB   @return the features at each depth, shallowest first
  /// @throws ShapeError if x does not fit      Differentiable in: x, with the kinks of ReLU and max_pool().
  std::vector<Var<T>> features(Var<T> x) const;

  /// Computes the distance of each pair of images. The object must outlive the pass.
  /// @param a, b  [N, H, W, 3] of one shape in [0, 1], RGB   @return [N]
  /// @throws ShapeError if they do not fit
  /// Differentiable in: a, b, with the kinks of ReLU and max_pool().
  Var<T> operator()(Var<T> a, Var<T> b) const;

  /// Computes the distance of two images depth by depth. It holds the features of two depths at a time: in
  /// float about 2.5 kB (SqueezeNet) or 0.4 kB (AlexNet) per pixel of an image.
  /// @param a, b  [H, W, 3] of one shape in [0, 1], RGB   @throws ShapeError if they do not fit
  LpipsDistance distance(const Tensor<float>& a, const Tensor<float>& b) const;

 private:
  // A convolution, or a fire module: one convolution followed by two parallel ones.
  using Block = std::vector<PretrainedConv<T>>;
  // The layers between two depths.
  struct Stage {
    bool pool = false;
    std::vector<Block> blocks;
    Tensor<T> lin;
  };
  void check(const Shape& a, const Shape& b) const;
  Var<T> run(std::size_t stage, Var<T> x) const;

  Index smallest_;
  bool ceil_mode_;  // of the pooling layers
  PretrainedConv<T> scaling_;
  std::vector<Stage> stages_;
};

}  // namespace fieldmark
