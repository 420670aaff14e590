#include <fieldmark/engine/isa.h>

#include "mlp.h"
#include "peer_work.h"

namespace fieldmark::bench {
namespace {

// Compares values, dX and weight gradients in float with double on a part of the samples.
double error_of(Index depth, Index width) {
  Mlp<float> f(depth, width, 4 * kChunk);
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

EngineRow chunked(Index depth, Index width, Index samples, const RowOptions& o) {
  Mlp<float> mlp(depth, width, scaled(samples, o.scale));
  ShardedLoop<float> loop(kShards, mlp.store.size());
  EngineRow row = row_of(time_calls([&] { in_chunks(mlp, loop); }, o.runs, 0.1, o.between), mlp.operations(),
                         static_cast<double>(mlp.samples));
  row.error = error_of(depth, width);
  return row;
}

// One pass of chunked() for a peer to repeat.
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

// The same row with AVX2, relative to AVX2's peak.
EngineRow with_avx2(const std::function<EngineRow()>& row) {
  const ScopedIsa scope(Isa::v3);
  return row();
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
  if (isa() > Isa::v3)
    for (const auto& [name, row] : {std::pair{"mlp_4x64_fb_f32_avx2", RowRun(narrow)},
                                    std::pair{"mlp_8x256_fb_f32_avx2", RowRun(wide)}})
      rows.push_back({name, "with AVX2, against AVX2's peak",
                      [row = row](const RowOptions& o) { return with_avx2([&] { return row(o); }); }});
  return rows;
}

}  // namespace fieldmark::bench
