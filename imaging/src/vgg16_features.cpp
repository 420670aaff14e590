#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/vgg16_features.h>

#include <algorithm>
#include <array>

namespace fieldmark {
namespace {

struct Layer {
  const char* name;   // in the file
  const char* depth;  // after its ReLU
  bool pool;          // a pooling layer precedes it
  Index in, out;
};
constexpr std::array<Layer, 13> kLayers{{{"features.0", "relu1_1", false, 3, 64},
                                         {"features.2", "relu1_2", false, 64, 64},
                                         {"features.5", "relu2_1", true, 64, 128},
                                         {"features.7", "relu2_2", false, 128, 128},
                                         {"features.10", "relu3_1", true, 128, 256},
                                         {"features.12", "relu3_2", false, 256, 256},
                                         {"features.14", "relu3_3", false, 256, 256},
                                         {"features.17", "relu4_1", true, 256, 512},
                                         {"features.19", "relu4_2", false, 512, 512},
                                         {"features.21", "relu4_3", false, 512, 512},
                                         {"features.24", "relu5_1", true, 512, 512},
                                         {"features.26", "relu5_2", false, 512, 512},
                                         {"features.28", "relu5_3", false, 512, 512}}};

PretrainedConvOptions options_of(const Layer& layer) { return {.in = layer.in, .out = layer.out}; }

// (x - mean) / deviation, torchvision's values for ImageNet.
template <class T>
PretrainedConv<T> imagenet() {
  constexpr std::array mean{0.485, 0.456, 0.406}, deviation{0.229, 0.224, 0.225};
  std::array<double, 3> scale{}, shift{};
  for (std::size_t c = 0; c < 3; ++c) {
    scale[c] = 1 / deviation[c];
    shift[c] = -mean[c] / deviation[c];
  }
  return PretrainedConv<T>::per_channel(scale, shift);
}

std::size_t layers_in(const SafetensorsFile& file) {
  std::size_t count = 1;  // reading the first one reports an empty file
  for (std::size_t k = 0; k < kLayers.size(); ++k)
    for (const WeightTensor& t : pretrained_conv_tensors(kLayers[k].name, options_of(kLayers[k])))
      if (file.has(t.name)) count = k + 1;
  return count;
}

}  // namespace

std::vector<WeightTensor> vgg16_tensors() {
  std::vector<WeightTensor> all;
  for (const Layer& layer : kLayers)
    for (const WeightTensor& t : pretrained_conv_tensors(layer.name, options_of(layer))) all.push_back(t);
  return all;
}

template <class T>
Vgg16Features<T>::Vgg16Features(const SafetensorsFile& file) : normalise_(imagenet<T>()) {
  const std::size_t count = layers_in(file);
  for (std::size_t k = 0; k < count; ++k) convs_.emplace_back(file, kLayers[k].name, options_of(kLayers[k]));
}

template <class T>
std::vector<std::string> Vgg16Features<T>::depths() const {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < convs_.size(); ++k) names.emplace_back(kLayers[k].depth);
  return names;
}

template <class T>
std::vector<Var<T>> Vgg16Features<T>::operator()(Var<T> x, std::span<const std::string_view> taps) const {
  check_rank("vgg16_features", "x", x.shape(), 4, "[N, H, W, 3]");
  check_extent("vgg16_features", "x", x.shape(), 3, 3, "RGB");
  std::vector<std::size_t> layer_of;
  for (const std::string_view tap : taps) {
    const auto at =
        std::find_if(kLayers.begin(), kLayers.end(), [&](const Layer& l) { return tap == l.depth; });
    layer_of.push_back(static_cast<std::size_t>(at - kLayers.begin()));
    if (layer_of.back() >= convs_.size())
      throw ValueError("[vgg16_features] taps: expected depths from relu1_1 to " +
                       std::string(kLayers[convs_.size() - 1].depth) + " (what the weights reach), got " +
                       std::string(tap));
  }
  if (taps.empty()) return {};
  const std::size_t deepest = *std::max_element(layer_of.begin(), layer_of.end());
  Index least = 1;
  for (std::size_t k = 0; k <= deepest; ++k) least *= kLayers[k].pool ? 2 : 1;
  if (std::min(x.shape()[1], x.shape()[2]) < least)
    throw ShapeError("[vgg16_features] x: height and width must be at least " + std::to_string(least) +
                     " (down to " + kLayers[deepest].depth + "), got shape " + x.shape().str());
  std::vector<Var<T>> found(taps.size(), x);
  x = normalise_(x);
  for (std::size_t k = 0; k <= deepest; ++k) {
    if (kLayers[k].pool) x = max_pool(x, {.size = 2, .stride = 2});
    x = convs_[k](x);
    for (std::size_t t = 0; t < taps.size(); ++t)
      if (layer_of[t] == k) found[t] = x;
  }
  return found;
}

template <class T>
Var<T> Vgg16Features<T>::loss(Var<T> a, Var<T> b, std::span<const std::string_view> taps) const {
  check_same("vgg16_features", "a", a.shape(), "b", b.shape());
  if (taps.empty()) throw ValueError("[vgg16_features] taps must not be empty");
  const auto of_a = (*this)(a, taps), of_b = (*this)(b, taps);
  Var<T> total = mse_loss(of_a[0], of_b[0]);
  for (std::size_t k = 1; k < taps.size(); ++k) total = add(total, mse_loss(of_a[k], of_b[k]));
  return total;
}

template class Vgg16Features<float>;
template class Vgg16Features<double>;

}  // namespace fieldmark
