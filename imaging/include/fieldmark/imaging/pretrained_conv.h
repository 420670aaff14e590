#pragma once
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/safetensors.h>

#include <span>
#include <string_view>

namespace fieldmark {

/// A tensor of a weight file under its PyTorch name; the model fixes its shape.
struct WeightTensor {
  std::string name;  ///< in the file: "features.0.weight"
  Shape shape;       ///< convolutions: [out, in, K, K]
};

/// Reads a tensor of the given shape.
/// @throws IoError if it is missing, has another shape or is not F32, F16 or BF16
Tensor<float> read_weights(const SafetensorsFile& file, const WeightTensor& tensor);

/// Extents and activation of a PretrainedConv.
struct PretrainedConvOptions {
  Index in = 0;                              ///< channels of the input, >= 1
  Index out = 0;                             ///< channels of the output, >= 1
  Index kernel = 3;                          ///< side of the window, >= 1
  Index stride = 1;                          ///< pixels from one window to the next, >= 1
  Index padding = 1;                         ///< pixels of zeros around the image, >= 0
  Activation activation = Activation::relu;  ///< applied to the sums
};

/// Returns the tensors of the convolution `name`: "<name>.weight" and "<name>.bias".
std::vector<WeightTensor> pretrained_conv_tensors(std::string_view name,
                                                  const PretrainedConvOptions& options);

/// Convolution with fixed weights read from a file in PyTorch's layout. Gradients reach its input only. The
/// object holds the weights and must outlive a pass.
template <class T>
class PretrainedConv {
 public:
  /// Reads "<name>.weight" [out, in, K, K] and "<name>.bias" [out]. @throws IoError as read_weights()
  PretrainedConv(const SafetensorsFile& file, std::string_view name, const PretrainedConvOptions& options);
  /// Makes y_c = scale_c x_c + shift_c for every pixel. @param scale, shift  one value per channel
  /// @throws ShapeError if they differ in size
  static PretrainedConv per_channel(std::span<const double> scale, std::span<const double> shift);

  /// @param x  [N, H, W, in]   @return  see conv2d()   @throws ShapeError if x does not fit
  /// Differentiable in: x.
  Var<T> operator()(Var<T> x) const;

 private:
  PretrainedConv() = default;
  PretrainedConvOptions options_;
  Tensor<T> weight_, bias_;  // [K, K, in, out], [out]
};

}  // namespace fieldmark
