#pragma once
// The network of dense layers that several rows time. Private.
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/sharded_loop.h>

#include <algorithm>
#include <memory>

#include "rows.h"

namespace fieldmark::bench {

constexpr Index kChunk =
    256;  // rows: 9 x 64 KiB of activations and gradients at width 64, within a core's L2
constexpr int kShards = 16;

// L dense layers of one width with bias and ReLU. The loss is <u, y> with a fixed u, so backward starts from
// u.
template <class T>
struct Mlp {
  Mlp(Index depth, Index units, Index rows, Precision precision = Precision::fp32)
      : width(units), samples(rows) {
    for (Index l = 0; l < depth; ++l)
      layers.emplace_back(store, std::to_string(l),
                          DenseOptions{.in = width, .out = width, .activation = Activation::relu},
                          static_cast<std::uint64_t>(l) + 1);
    x = numbers<T>(samples * width, 1);
    u = numbers<T>(samples * width, 2);
    dx.assign(x.size(), T(0));
    y.resize(x.size());
    packed = std::make_unique<PackedWeights<T>>(store, PackOptions{.precision = precision});
  }

  // Runs rows [begin, begin + n) through a tape; parameter gradients go to `grads`.
  void pass(Tape<T>& tape, T* grads, Index begin, Index n) {
    const Params<T> params(store, grads, *packed);
    const Index at = begin * width;
    Var<T> h = tape.fresh_leaf(x.data() + at, dx.data() + at, {n, width});
    for (const Dense<T>& layer : layers) h = layer(params, h);
    if (keep) std::copy_n(h.value(), n * width, y.data() + at);
    tape.backward(
        h, std::span<const T>(u).subspan(static_cast<std::size_t>(at), static_cast<std::size_t>(n * width)));
  }
  double operations() const {
    return 3.0 * 2.0 * static_cast<double>(samples) * static_cast<double>(layers.size()) *
           static_cast<double>(width * width);
  }

  Index width, samples;
  ParamStore<T> store;
  std::vector<Dense<T>> layers;
  std::unique_ptr<PackedWeights<T>> packed;  // repacked in every pass, as after an optimiser step
  std::vector<T> x, u, dx, y;
  bool keep = false;
};

template <class T>
void in_chunks(Mlp<T>& mlp, ShardedLoop<T>& loop) {
  mlp.packed->update();
  std::fill(mlp.store.grads().begin(), mlp.store.grads().end(), T(0));
  loop.run((mlp.samples + kChunk - 1) / kChunk,
           [&](Index c, Index, Tape<T>& tape, T* grads) {
             const Index begin = c * kChunk, n = std::min(kChunk, mlp.samples - begin);
             mlp.pass(tape, grads, begin, n);
             return 0.0;
           },
           mlp.store.grads());
}

}  // namespace fieldmark::bench
