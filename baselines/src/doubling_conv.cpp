#include "doubling_conv.h"
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {

template <class T>
Var<T> depth_to_space(Var<T> x) {
  check_rank("depth_to_space", "x", x.shape(), 4, "[images, height, width, 4 channels]");
  const Shape s = x.shape();
  if (s[3] % 4 != 0)
    throw ShapeError("[depth_to_space] x must have a number of channels that is a multiple of 4, got shape " +
                     s.str());
  const Index width = s[2], pair = s[3] / 2;  // two neighbours of a row are adjacent in both layouts
  T* y = nullptr;
  const Var<T> out = x.tape().output({s[0], 2 * s[1], 2 * width, s[3] / 4}, &y, {x});
  // Row r of the result holds one half, a = r % 2, of the channels of row r / 2.
  parallel_for(2 * s[0] * s[1], 8, [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r)
      for (Index j = 0; j < width; ++j)
        std::copy_n(x.value() + ((r / 2 * width + j) * 2 + r % 2) * pair, pair, y + (r * width + j) * pair);
  });

  // A permutation: dx takes the same elements of dy. A chunk owns its elements of dx.
  x.tape().on_backward(out, [=](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(2 * s[0] * s[1], 8, [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        for (Index j = 0; j < width; ++j)
          for (Index k = 0; k < pair; ++k)
            dx[((r / 2 * width + j) * 2 + r % 2) * pair + k] += dy[(r * width + j) * pair + k];
    });
  });
  return out;
}

template <class T>
DoublingConv<T>::DoublingConv(ParamStore<T>& store, std::string_view name, Index channels, std::uint64_t seed)
    : channels_(channels),
      spread_(store, std::string(name) + "/spread", DenseOptions{.in = channels, .out = 4 * channels}, seed),
      norm_(store, std::string(name) + "/norm", channels, BatchNormOptions{.relu = true}) {}

template <class T>
Var<T> DoublingConv<T>::operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const {
  const Shape s = x.shape();
  Tape<T>& tape = x.tape();
  const Var<T> rows = spread_(params, tape.reshape(x, {s[0] * s[1] * s[2], channels_}));
  const Var<T> doubled = depth_to_space(tape.reshape(rows, {s[0], s[1], s[2], 4 * channels_}));
  if (pass.running) return norm_.evaluate(params, doubled);
  pass.seen.emplace_back(&norm_, BatchStatistics{});
  return norm_(params, doubled, &pass.seen.back().second);
}

template Var<float> depth_to_space(Var<float>);
template Var<double> depth_to_space(Var<double>);
template class DoublingConv<float>;
template class DoublingConv<double>;

}  // namespace fieldmark::baselines
