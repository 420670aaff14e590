#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/lpips.h>

#include <algorithm>
#include <array>
#include <span>

namespace fieldmark {
namespace {

struct NamedConv {
  std::string name;
  PretrainedConvOptions options;
};
using BlockPlan = std::vector<NamedConv>;  // one convolution, or the three of a fire module
struct StagePlan {
  bool pool = false;
  std::vector<BlockPlan> blocks;
  Index channels = 0;
};

BlockPlan fire(Index number, Index in, Index squeeze, Index expand) {
  const std::string name = "features." + std::to_string(number) + ".";
  return {{name + "squeeze", {.in = in, .out = squeeze, .kernel = 1, .padding = 0}},
          {name + "expand1x1", {.in = squeeze, .out = expand, .kernel = 1, .padding = 0}},
          {name + "expand3x3", {.in = squeeze, .out = expand}}};
}

// Krizhevsky 2014 (One weird trick), as in torchvision.
std::vector<StagePlan> alex_plan() {
  return {
      {false, {{{"features.0", {.in = 3, .out = 64, .kernel = 11, .stride = 4, .padding = 2}}}}, 64},
      {true, {{{"features.3", {.in = 64, .out = 192, .kernel = 5, .padding = 2}}}}, 192},
      {true, {{{"features.6", {.in = 192, .out = 384}}}}, 384},
      {false, {{{"features.8", {.in = 384, .out = 256}}}}, 256},
      {false, {{{"features.10", {.in = 256, .out = 256}}}}, 256},
  };
}

// Iandola et al. 2016 (SqueezeNet), version 1.1, as in torchvision.
std::vector<StagePlan> squeeze_plan() {
  return {
      {false, {{{"features.0", {.in = 3, .out = 64, .kernel = 3, .stride = 2, .padding = 0}}}}, 64},
      {true, {fire(3, 64, 16, 64), fire(4, 128, 16, 64)}, 128},
      {true, {fire(6, 128, 32, 128), fire(7, 256, 32, 128)}, 256},
      {true, {fire(9, 256, 48, 192)}, 384},
      {false, {fire(10, 384, 48, 192)}, 384},
      {false, {fire(11, 384, 64, 256)}, 512},
      {false, {fire(12, 512, 64, 256)}, 512},
  };
}

std::vector<StagePlan> plan_of(LpipsNetwork network) {
  return network == LpipsNetwork::alex ? alex_plan() : squeeze_plan();
}

WeightTensor lin_tensor(std::size_t stage, Index channels) {
  return {"lin" + std::to_string(stage) + ".weight", {1, channels, 1, 1}};
}

const WeightTensor kShift{"scaling.shift", {3}}, kScale{"scaling.scale", {3}};

// ((2 x - 1) - shift) / scale = (2 / scale) x - (1 + shift) / scale.
template <class T>
PretrainedConv<T> scaling_of(const SafetensorsFile& file) {
  const Tensor<float> shift = read_weights(file, kShift), scale = read_weights(file, kScale);
  std::array<double, 3> factor{}, offset{};
  for (std::size_t c = 0; c < 3; ++c) {
    factor[c] = 2 / static_cast<double>(scale.data[c]);
    offset[c] = -(1 + static_cast<double>(shift.data[c])) / static_cast<double>(scale.data[c]);
  }
  return PretrainedConv<T>::per_channel(factor, offset);
}

}  // namespace

std::vector<WeightTensor> lpips_tensors(LpipsNetwork network) {
  std::vector<WeightTensor> all{kShift, kScale};
  const auto plan = plan_of(network);
  for (std::size_t k = 0; k < plan.size(); ++k) {
    for (const BlockPlan& block : plan[k].blocks)
      for (const NamedConv& conv : block)
        for (const WeightTensor& t : pretrained_conv_tensors(conv.name, conv.options)) all.push_back(t);
    all.push_back(lin_tensor(k, plan[k].channels));
  }
  return all;
}

template <class T>
Lpips<T>::Lpips(const SafetensorsFile& file, LpipsNetwork network)
    : smallest_(network == LpipsNetwork::alex ? 31 : 17),
      ceil_mode_(network == LpipsNetwork::squeeze),
      scaling_(scaling_of<T>(file)) {
  for (const StagePlan& plan : plan_of(network)) {
    Stage stage{.pool = plan.pool, .blocks = {}, .lin = Tensor<T>({plan.channels})};
    for (const BlockPlan& block : plan.blocks) {
      Block& convs = stage.blocks.emplace_back();
      for (const NamedConv& conv : block) convs.emplace_back(file, conv.name, conv.options);
    }
    const Tensor<float> lin = read_weights(file, lin_tensor(stages_.size(), plan.channels));
    stage.lin.data.assign(lin.data.begin(), lin.data.end());
    stages_.push_back(std::move(stage));
  }
}

template <class T>
void Lpips<T>::check(const Shape& a, const Shape& b) const {
  check_same("lpips", "a", a, "b", b);
  const int axis = a.rank() - 3;  // the height
  check_extent("lpips", "a", a, axis + 2, 3, "RGB");
  if (std::min(a[axis], a[axis + 1]) < smallest_)
    throw ShapeError("[lpips] a: height and width must be at least " + std::to_string(smallest_) +
                     " (the network's pooling layers), got shape " + a.str());
}

template <class T>
Var<T> Lpips<T>::run(std::size_t stage, Var<T> x) const {
  if (stages_[stage].pool) x = max_pool(x, {.size = 3, .stride = 2, .ceil_mode = ceil_mode_});
  for (const Block& block : stages_[stage].blocks) {
    x = block[0](x);
    if (block.size() > 1) x = concatenate({block[1](x), block[2](x)});
  }
  return x;
}

template <class T>
std::vector<Var<T>> Lpips<T>::features(Var<T> x) const {
  check_rank("lpips", "x", x.shape(), 4, "[N, H, W, 3]");
  check(x.shape(), x.shape());
  std::vector<Var<T>> taps;
  x = scaling_(x);
  for (std::size_t k = 0; k < stages_.size(); ++k) taps.push_back(x = run(k, x));
  return taps;
}

template <class T>
Var<T> Lpips<T>::operator()(Var<T> a, Var<T> b) const {
  check_rank("lpips", "a", a.shape(), 4, "[N, H, W, 3]");
  check(a.shape(), b.shape());
  const auto of_a = features(a), of_b = features(b);
  Var<T> total = feature_distance(of_a[0], of_b[0], std::span<const T>(stages_[0].lin.data));
  for (std::size_t k = 1; k < stages_.size(); ++k)
    total = add(total, feature_distance(of_a[k], of_b[k], std::span<const T>(stages_[k].lin.data)));
  return total;
}

// Both images pass through together, so that the weights are transformed once per stage.
template <class T>
LpipsDistance Lpips<T>::distance(const Tensor<float>& a, const Tensor<float>& b) const {
  check_rank("lpips", "a", a.shape, 3, "[H, W, 3]");
  check(a.shape, b.shape);
  Tensor<T> x({2, a.shape[0], a.shape[1], 3});
  std::copy(a.data.begin(), a.data.end(), x.data.begin());
  std::copy(b.data.begin(), b.data.end(), x.data.begin() + a.size());
  LpipsDistance result;
  Tape<T> tape;
  for (std::size_t k = 0; k < stages_.size(); ++k) {
    const Var<T> in = tape.constant(x), y = run(k, k == 0 ? scaling_(in) : in);
    const Shape half{1, y.shape()[1], y.shape()[2], y.shape()[3]};
    const Var<T> share =
        feature_distance(tape.constant(y.value(), half), tape.constant(y.value() + half.size(), half),
                         std::span<const T>(stages_[k].lin.data));
    result.per_layer.push_back(static_cast<double>(share.value()[0]));
    result.value += result.per_layer.back();
    x = Tensor<T>(y.shape(), std::vector<T>(y.value(), y.value() + y.shape().size()));
    tape.reset();
  }
  return result;
}

template class Lpips<float>;
template class Lpips<double>;

}  // namespace fieldmark
