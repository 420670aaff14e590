#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/sharded_loop.h>

#include <algorithm>
#include <memory>

#include "peer_work.h"
#include "rows.h"

namespace fieldmark::bench {
namespace {

constexpr Index kChunk =
    256;  // rows: 9 x 64 KiB of activations and gradients at width 64, within a core's L2
constexpr int kShards = 16;

// L dense layers of one width with bias and ReLU; the loss is <u, y> with a fixed u, so that backward starts
// from u.
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

  // Rows [begin, begin + n) through a tape; parameters' gradients go to `grads`.
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
  std::unique_ptr<PackedWeights<T>> packed;  // renewed in every pass, as after a step of the optimiser
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

// Values, dX and weight gradients of float against double on a part of the samples.
double error_of(Index depth, Index width, Precision precision = Precision::fp32) {
  Mlp<float> f(depth, width, 4 * kChunk, precision);
  Mlp<double> d(depth, width, 4 * kChunk);
  f.keep = d.keep = true;
  std::copy(f.store.values().begin(), f.store.values().end(), d.store.values().begin());
  std::copy(f.x.begin(), f.x.end(), d.x.begin());
  std::copy(f.u.begin(), f.u.end(), d.u.begin());
  ShardedLoop<float> loop_f(kShards, f.store.size());
  ShardedLoop<double> loop_d(kShards, d.store.size());
  in_chunks(f, loop_f);
  in_chunks(d, loop_d);
  return std::max({relative_error(f.y, d.y), relative_error(f.dx, d.dx),
                   relative_error(f.store.grads(), d.store.grads())});
}

Index scaled(Index samples, double scale) {
  return std::max(kChunk, static_cast<Index>(static_cast<double>(samples) * scale));
}

EngineRow chunked(Index depth, Index width, Index samples, const RowOptions& o,
                  Precision precision = Precision::fp32) {
  Mlp<float> mlp(depth, width, scaled(samples, o.scale), precision);
  ShardedLoop<float> loop(kShards, mlp.store.size());
  EngineRow row = row_of(time_calls([&] { in_chunks(mlp, loop); }, o.runs, 0.1, o.between), mlp.operations(),
                         static_cast<double>(mlp.samples));
  row.error = error_of(depth, width, precision);
  return row;
}

// One pass of chunked(), for a peer to do the same.
SafetensorsFile work(Index depth, Index width, Index samples, const RowOptions& o) {
  Mlp<float> mlp(depth, width, scaled(samples, o.scale));
  const Shape shape{mlp.samples, width};
  leave_out_kinks(mlp.store, shape, mlp.x, mlp.u);
  mlp.keep = true;
  ShardedLoop<float> loop(kShards, mlp.store.size());
  in_chunks(mlp, loop);
  return peer_work("dense", mlp.store, {shape, shape, mlp.x, mlp.u, mlp.y, mlp.dx});
}

EngineRow whole_batch(Index depth, Index width, Index samples, const RowOptions& o) {
  Mlp<float> mlp(depth, width, scaled(samples, o.scale));
  Tape<float> tape;
  const auto step = [&] {
    tape.reset();
    mlp.packed->update();
    std::fill(mlp.store.grads().begin(), mlp.store.grads().end(), 0.f);
    mlp.pass(tape, mlp.store.grads().data(), 0, mlp.samples);
  };
  EngineRow row = row_of(time_calls(step, o.runs), mlp.operations(), static_cast<double>(mlp.samples));
  row.error = error_of(depth, width);
  return row;
}

// The same with AVX2, against AVX2's peak.
EngineRow with_avx2(const std::function<EngineRow()>& row) {
  const Isa before = isa();
  force_isa(Isa::v3);
  const EngineRow result = row();
  force_isa(before);
  return result;
}

}  // namespace

std::vector<RowSpec> mlp_rows() {
  const auto narrow = [](const RowOptions& o) { return chunked(4, 64, 262144, o); };
  const auto wide = [](const RowOptions& o) { return chunked(8, 256, 32768, o); };
  std::vector<RowSpec> rows{{"mlp_4x64_fb_f32", "4 dense layers of 64, 262,144 samples, in chunks", narrow,
                             [](const RowOptions& o) { return work(4, 64, 262144, o); }},
                            {"mlp_4x64_tape_fb_f32", "the same through one tape over the whole batch",
                             [](const RowOptions& o) { return whole_batch(4, 64, 262144, o); }},
                            {"mlp_8x256_fb_f32", "8 dense layers of 256, 32,768 samples, in chunks", wide,
                             [](const RowOptions& o) { return work(8, 256, 32768, o); }}};
  if (bf16_units() != Bf16Units::none)
    rows.push_back({"mlp_4x64_fb_bf16", "forward and dX in bf16, dW in float",
                    [](const RowOptions& o) { return chunked(4, 64, 262144, o, Precision::bf16); }});
  if (isa() > Isa::v3)
    for (const auto& [name, row] : {std::pair{"mlp_4x64_fb_f32_avx2", RowRun(narrow)},
                                    std::pair{"mlp_8x256_fb_f32_avx2", RowRun(wide)}})
      rows.push_back({name, "with AVX2, against AVX2's peak",
                      [row = row](const RowOptions& o) { return with_avx2([&] { return row(o); }); }});
  return rows;
}

}  // namespace fieldmark::bench
