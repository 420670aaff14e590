#pragma once
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/safetensors.h>

#include <span>
#include <string_view>

namespace fieldmark {

/// An array of a weight file, as PyTorch's models name them, whose shape the model fixes.
struct WeightTensor {
  std::string name;  ///< in the file: "features.0.weight"
  Shape shape;       ///< of convolutions [out, in, K, K]
};

/// The numbers of a tensor that must have a given shape.
/// @throws IoError if it is missing, has another shape or is not F32, F16 or BF16: the text names the file,
/// the tensor, what was expected and what was found
Tensor<float> read_weights(const SafetensorsFile& file, const WeightTensor& tensor);

/// Extents of a PretrainedConv and what follows its sums.
struct PretrainedConvOptions {
  Index in = 0;                              ///< channels of the input, >= 1
  Index out = 0;                             ///< channels of the output, >= 1
  Index kernel = 3;                          ///< side of the window, >= 1
  Index stride = 1;                          ///< pixels from one window to the next, >= 1
  Index padding = 1;                         ///< pixels of zeros around the image, >= 0
  Activation activation = Activation::relu;  ///< applied to the sums
};

/// What a weight file holds for a convolution of this name: "<name>.weight" and "<name>.bias".
std::vector<WeightTensor> pretrained_conv_tensors(std::string_view name,
                                                  const PretrainedConvOptions& options);

/// Convolution whose weights come from a file of PyTorch's layout and stay as they are: gradients reach its
/// input only. It holds the numbers, and must outlive a pass.
template <class T>
class PretrainedConv {
 public:
  /// Reads "<name>.weight" [out, in, K, K] and "<name>.bias" [out]. @throws IoError as read_weights()
  PretrainedConv(const SafetensorsFile& file, std::string_view name, const PretrainedConvOptions& options);
  /// y_c = scale_c x_c + shift_c in every pixel. @param scale, shift  one number for each channel
  /// @throws ShapeError if they differ in number
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
