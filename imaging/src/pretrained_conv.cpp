#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/pretrained_conv.h>

namespace fieldmark {

Tensor<float> read_weights(const SafetensorsFile& file, const WeightTensor& tensor) {
  const auto fail = [&](const std::string& found) {
    throw IoError("[weights] " + file.path + ": tensor \"" + tensor.name + "\": expected F32 " +
                  tensor.shape.str() + ", found " + found);
  };
  if (!file.has(tensor.name)) fail("none of this name");
  const auto& entry = file.at(tensor.name);
  const bool readable = entry.dtype == "F32" || entry.dtype == "F16" || entry.dtype == "BF16";
  if (!readable || entry.shape != tensor.shape) fail(entry.dtype + " " + entry.shape.str());
  return file.f32(tensor.name);
}

std::vector<WeightTensor> pretrained_conv_tensors(std::string_view name, const PretrainedConvOptions& o) {
  return {{std::string(name) + ".weight", {o.out, o.in, o.kernel, o.kernel}},
          {std::string(name) + ".bias", {o.out}}};
}

template <class T>
PretrainedConv<T>::PretrainedConv(const SafetensorsFile& file, std::string_view name,
                                  const PretrainedConvOptions& o)
    : options_(o), weight_({o.kernel, o.kernel, o.in, o.out}), bias_({o.out}) {
  const auto tensors = pretrained_conv_tensors(name, o);
  const Tensor<float> w = read_weights(file, tensors[0]), b = read_weights(file, tensors[1]);
  const Index taps = o.kernel * o.kernel;
  for (Index out = 0; out < o.out; ++out)
    for (Index in = 0; in < o.in; ++in)
      for (Index t = 0; t < taps; ++t)
        weight_[(t * o.in + in) * o.out + out] = static_cast<T>(w[(out * o.in + in) * taps + t]);
  bias_.data.assign(b.data.begin(), b.data.end());
}

template <class T>
PretrainedConv<T> PretrainedConv<T>::per_channel(std::span<const double> scale,
                                                 std::span<const double> shift) {
  const auto channels = static_cast<Index>(scale.size());
  check_extent("pretrained_conv", "shift", {static_cast<Index>(shift.size())}, 0, channels, "as scale");
  PretrainedConv conv;
  conv.options_ = {.in = channels,
                   .out = channels,
                   .kernel = 1,
                   .stride = 1,
                   .padding = 0,
                   .activation = Activation::none};
  conv.weight_ = Tensor<T>({1, 1, channels, channels});
  conv.bias_ = Tensor<T>({channels});
  for (Index c = 0; c < channels; ++c) {
    conv.weight_[c * channels + c] = static_cast<T>(scale[static_cast<std::size_t>(c)]);
    conv.bias_[c] = static_cast<T>(shift[static_cast<std::size_t>(c)]);
  }
  return conv;
}

template <class T>
Var<T> PretrainedConv<T>::operator()(Var<T> x) const {
  const Var<T> w = x.tape().constant(weight_), b = x.tape().constant(bias_);
  return conv2d(x, w, b, {.stride = options_.stride, .padding = options_.padding}, options_.activation);
}

template class PretrainedConv<float>;
template class PretrainedConv<double>;

}  // namespace fieldmark
