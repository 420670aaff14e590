#pragma once
// The models whose training steps model_rows.cpp times: those of examples/transformer.cpp and
// examples/autoencoder.cpp, with configurable sizes. Private.
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/softmax.h>

#include <cmath>

#include "rows.h"

namespace fieldmark::bench {

struct TransformerSize {
  Index texts, letters, width, heads;  // letters: per text
  Index kinds = 32;                    // number of different letters
};

// One block with a causal mask on random letters; the loss is the cross-entropy of the next letter.
template <class T>
struct Transformer {
  explicit Transformer(const TransformerSize& s) : size(s), mask({s.letters, s.letters}) {
    for (Index i = 0; i < mask.size(); ++i) mask[i] = i % s.letters > i / s.letters ? T(-1e9) : T(0);
    for (const ParamId id : {letter, place}) {
      const auto start = numbers<T>(store.entry(id).shape.size(), static_cast<std::uint64_t>(10 + id.index));
      std::ranges::transform(start, store.values(id).begin(), [](T v) { return v / 2; });
    }
    std::ranges::fill(store.values(gamma), T(1));
    for (const float v : numbers<float>(s.texts * s.letters + 1, 12))
      text.push_back(static_cast<std::int32_t>((v + 1) / 2 * static_cast<float>(s.kinds)));
  }
  Var<T> loss(Tape<T>& tape, const Params<T>& p) const {
    const Index rows = size.texts * size.letters, w = size.width;
    const auto seen = std::span(text).first(static_cast<std::size_t>(rows)),
               next = std::span(text).subspan(1);
    const Var<T> embedded = reshape(
        reshape(gather(p.leaf(tape, letter), 0, seen), {size.texts, size.letters, w}) + p.leaf(tape, place),
        {rows, w});
    const Var<T> x = embedded + mix(p, attend(p, embedded));
    const Var<T> h = layer_norm(x, p.leaf(tape, gamma), p.leaf(tape, beta));
    return softmax_cross_entropy(out(p, x + narrow(p, gelu(wide(p, h)))), next);
  }
  Var<T> attend(const Params<T>& p, Var<T> x) const {
    const Index n = size.letters, w = size.width / size.heads;
    const Var<T> all = permute(reshape(qkv(p, x), {size.texts, n, 3, size.heads, w}), {2, 0, 3, 1, 4});
    const Shape part{size.texts, size.heads, n, w};
    const auto head = [&](Index k) { return x.tape().part(all, k * part.size(), part); };
    const Var<T> scores =
        batched_matmul(head(0), transpose(head(1))) / std::sqrt(static_cast<T>(w)) + x.tape().constant(mask);
    return reshape(permute(batched_matmul(softmax(scores), head(2)), {0, 2, 1, 3}), x.shape());
  }
  double items() const { return static_cast<double>(size.texts * size.letters); }
  // Returns the multiplications and additions of the products, forward and backward.
  double operations() const {
    const auto w = static_cast<double>(size.width);
    return 3 * 2 * items() *
           (12 * w * w + w * static_cast<double>(size.kinds) + 2 * w * static_cast<double>(size.letters));
  }
  void add_data(SafetensorsFile& file) const {
    const std::vector<float> letters(text.begin(), text.end());
    file.add("text", {static_cast<Index>(letters.size())}, letters);
    file.metadata["heads"] = std::to_string(size.heads);
  }

  TransformerSize size;
  ParamStore<T> store;
  ParamId letter = store.add("letter", {size.kinds, size.width}),
          place = store.add("place", {size.letters, size.width}), gamma = store.add("gamma", {size.width}),
          beta = store.add("beta", {size.width});
  Dense<T> qkv{store, "qkv", {.in = size.width, .out = 3 * size.width}, 1},
      mix{store, "mix", {.in = size.width, .out = size.width}, 2},
      wide{store, "wide", {.in = size.width, .out = 4 * size.width}, 3},
      narrow{store, "narrow", {.in = 4 * size.width, .out = size.width}, 4},
      out{store, "out", {.in = size.width, .out = size.kinds}, 5};
  Tensor<T> mask;
  std::vector<std::int32_t> text;
};

inline TransformerSize scaled(TransformerSize s, double scale) {
  s.texts = std::max<Index>(1, static_cast<Index>(static_cast<double>(s.texts) * scale));
  return s;
}

struct AutoencoderSize {
  Index images, side, channels;  // channels: of the outer layers; the inner ones have twice as many
};

inline AutoencoderSize scaled(AutoencoderSize s, double scale) {
  s.images = std::max<Index>(1, static_cast<Index>(static_cast<double>(s.images) * scale));
  return s;
}

// Convolutions and pooling down to a code of two channels at a quarter of the side, and back.
template <class T>
struct Autoencoder {
  explicit Autoencoder(const AutoencoderSize& s) : size(s), images({s.images, s.side, s.side, 1}) {
    const auto values = numbers<T>(images.size(), 12);
    std::ranges::transform(values, images.data.begin(), [](T v) { return (v + 1) / 2; });
  }
  Var<T> loss(Tape<T>& tape, const Params<T>& p) const {
    const Var<T> x = tape.constant(images);
    const Var<T> z = code(p, avg_pool(e2(p, avg_pool(e1(p, x), 2)), 2));
    return mse_loss(image(p, d2(p, upsample_nearest(d1(p, upsample_nearest(z, 2)), 2))), x);
  }
  double items() const { return static_cast<double>(size.images); }
  double operations() const {
    const auto c = static_cast<double>(size.channels), pixels = static_cast<double>(size.side * size.side);
    const double at_full = 2 * c + 2 * c * c, at_half = 2 * c * c + 4 * c, at_quarter = 4 * c;
    return 3 * 2 * 9 * items() * pixels * (at_full + at_half / 4 + at_quarter / 16);
  }
  void add_data(SafetensorsFile& file) const { file.add("images", images.shape, images.data); }

  AutoencoderSize size;
  ParamStore<T> store;
  Conv2d<T> e1{store, "e1", {.in = 1, .out = size.channels, .activation = Activation::relu}, 1},
      e2{store, "e2", {.in = size.channels, .out = 2 * size.channels, .activation = Activation::relu}, 2},
      code{store, "code", {.in = 2 * size.channels, .out = 2}, 3},
      d1{store, "d1", {.in = 2, .out = 2 * size.channels, .activation = Activation::relu}, 4},
      d2{store, "d2", {.in = 2 * size.channels, .out = size.channels, .activation = Activation::relu}, 5},
      image{store, "image", {.in = size.channels, .out = 1}, 6};
  Tensor<T> images;
};

}  // namespace fieldmark::bench
