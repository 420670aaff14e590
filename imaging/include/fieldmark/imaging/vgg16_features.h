#pragma once
#include <fieldmark/imaging/pretrained_conv.h>

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fieldmark {

/// Returns the tensors of VGG-16 under torchvision's names, in order: "features.0.weight" ...
/// "features.28.bias".
std::vector<WeightTensor> vgg16_tensors();

/// Features of VGG-16 (Simonyan & Zisserman 2015, configuration D) for perceptual losses.
/// Images in [0, 1] are normalised as torchvision does: (x - mean) / deviation of ImageNet, per channel.
/// Depths are named after the ReLU that ends them: "relu1_1", "relu1_2", "relu2_1", ... "relu5_3". Gradients
/// reach the images; the weights are fixed.
template <class T>
class Vgg16Features {
 public:
  /// Reads all 13 convolutions of the file or only the first ones; ignores other tensors (a classifier's).
  /// @throws IoError if the first is missing, one is missing before one that is present, or a shape differs
  explicit Vgg16Features(const SafetensorsFile& file);

  /// Returns the names of the available depths, shallowest first.
  std::vector<std::string> depths() const;

  /// @param x     [N, H, W, 3] in [0, 1], RGB; at least 2^k pixels per side for depth relu(k + 1)
  /// @param taps  names of depths, in any order; layers below the deepest are not computed
  /// @return one per tap, [N, H / 2^k, W / 2^k, C]; the object must outlive the pass
  /// @throws ShapeError if x does not fit or is too small   @throws ValueError if a name is unknown or deeper
  /// than the weights
  /// Differentiable in: x, with the kinks of ReLU and max_pool().
  std::vector<Var<T>> operator()(Var<T> x, std::span<const std::string_view> taps) const;

  /// Computes a perceptual loss: the sum over taps of the mean squared difference of features, [1].
  /// Source: Johnson et al. 2016 (Perceptual losses), eq. 2, without the root.
  /// @param a, b  [N, H, W, 3] of one shape in [0, 1]   @param taps  as above, at least one
  /// @throws as above, and ShapeError if the shapes differ      Differentiable in: a, b.
  Var<T> loss(Var<T> a, Var<T> b, std::span<const std::string_view> taps) const;

 private:
  PretrainedConv<T> normalise_;
  std::vector<PretrainedConv<T>> convs_;
};

}  // namespace fieldmark
