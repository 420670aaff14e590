#pragma once
// The training step on the networks of preset paper that model_rows.cpp times: E, D and G paint a message
// into every image, and H reads it. Private.
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <cmath>
#include <optional>
#include <vector>

#include "rows.h"

namespace fieldmark::bench {

struct PaperLoopSize {
  Index images, side, bits;
};

inline PaperLoopSize scaled(PaperLoopSize s, double scale) {
  s.side = std::max<Index>(16, static_cast<Index>(static_cast<double>(s.side) * std::sqrt(scale)));
  return s;
}

// Images of a disc that fills half of them, one sample per pixel of the disc, and a message each; the loss is
// that of PooledMark, at constant weights.
template <class T>
struct PaperLoop {
  static constexpr double kContent = 60, kMessage = 5;  // weights of the loss

  explicit PaperLoop(const PaperLoopSize& s) : size(s) {
    const Index pixels = s.side * s.side, middle = s.side / 2, square = pixels * 10 / 63;
    for (Index p = 0; p < pixels; ++p) {
      begin.push_back(static_cast<std::int32_t>(pixel.size()));
      const Index right = p % s.side - middle, down = p / s.side - middle;
      if (right * right + down * down < square) pixel.push_back(static_cast<float>(p));
    }
    begin.push_back(static_cast<std::int32_t>(pixel.size()));
    const Index n = samples();
    const auto within = [](Index count, std::uint64_t seed, T least, T most) {
      auto values = numbers<T>(count, seed);
      for (T& v : values) v = least + (most - least) * (v + 1) / 2;
      return values;
    };
    x = within(3 * n * s.images, 21, 0, T(0.02));  // the finest band multiplies rounding errors by 1600
    d = within(3 * n * s.images, 22, -1, 1);
    c = within(3 * n * s.images, 23, T(0.2), T(0.8));
    weight = within(n, 24, T(0.5), 1);
    for (const T v : numbers<T>(s.images * s.bits, 25)) message.push_back(v > 0 ? T(1) : T(-1));
    for (const T v : message) bit.push_back(v > 0 ? T(1) : T(0));
    behind.assign(static_cast<std::size_t>(3 * pixels), T(1));
    for (Index k = 0; k < n; ++k)
      for (Index a = 0; a < 3; ++a)
        behind[static_cast<std::size_t>(3 * static_cast<Index>(pixel[at(k)]) + a)] = 1 - weight[at(k)];
  }
  Index samples() const { return std::ssize(pixel); }

  Var<T> loss(Tape<T>& tape, const Params<T>& p) const {
    const Index n = samples(), pixels = size.side * size.side;
    const Var<T> back = tape.constant(behind.data(), {pixels, 3});
    std::vector<Var<T>> seen;
    std::optional<Var<T>> content;
    for (Index i = 0; i < size.images; ++i) {
      const auto of = [&](const std::vector<T>& v) { return tape.constant(&v[at(3 * n * i)], {n, 3}); };
      const auto composed = [&](Var<T> colour) {
        return add(watermark::weighted_segments<T>(colour, begin, weight), back);
      };
      const Var<T> marked =
          composed(mark(p, of(x), of(d), of(c), tape.constant(&message[at(size.bits * i)], {1, size.bits})));
      const Var<T> change = mse_loss<T>(marked, composed(of(c)));
      content = content ? add(*content, change) : change;
      seen.push_back(tape.reshape(marked, {1, size.side, size.side, 3}));
    }
    return add(scale(*content, kContent / static_cast<double>(size.images)),
               scale(bce_with_logits<T>(reader(p, concatenate<T>(seen, 0)), bit), kMessage));
  }
  double items() const { return static_cast<double>(size.images); }
  // Counts the multiplications and additions of the products, forward and backward, except those computed
  // once per image.
  double operations() const {
    double of_pixel = 0,
           of_sample = -static_cast<double>(mark.options().message_features * mark.options().width);
    for (const auto& e : store.entries()) {
      if (e.shape.rank() == 4) of_pixel += static_cast<double>(e.shape.size());
      if (e.shape.rank() == 2 && (e.name.starts_with("mark/encode") || e.name.starts_with("mark/fuse")))
        of_sample += static_cast<double>(e.shape.size());
    }
    return 3 * 2 * items() *
           (of_pixel * static_cast<double>(size.side * size.side) +
            of_sample * static_cast<double>(samples()));
  }
  void add_data(SafetensorsFile& file) const {
    const Index n = samples(), pixels = size.side * size.side;
    for (const auto& [name, values] : {std::pair{"x", &x}, {"d", &d}, {"c", &c}})
      file.add(name, {size.images, n, 3}, *values);
    file.add("pixel", {n}, pixel);
    file.add("weight", {n}, weight);
    file.add("behind", {pixels, 3}, behind);
    file.add("message", {size.images, size.bits}, message);
    file.metadata["side"] = std::to_string(size.side);
    file.metadata["kinks"] = "1";
  }

  PaperLoopSize size;
  std::vector<std::int32_t> begin;
  std::vector<float> pixel;  // of each sample
  std::vector<T> x, d, c, weight, message, bit, behind;
  watermark::FusionMarkOptions options = watermark::paper_options();
  ParamStore<T> store;
  watermark::GlobalMark<T> mark{store, "mark", watermark::network_options(options, size.bits), 1};
  extractor::PooledExtractor<T> reader{
      store, "reader", {.n_bits = size.bits, .channels = options.channels}, 2};
};

}  // namespace fieldmark::bench
