#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/hash_encoding.h>

#include <cmath>
#include <random>

#include "checks.h"
#include "kernels/hash_grid.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kPointGrain = 1024;  // points per chunk

void check(const HashEncodingOptions& o) {
  check_range("hash_encoding", "levels", o.levels, 1, 32);
  if (o.features != 2 && o.features != 4)
    throw ValueError("[hash_encoding] features must be 2 or 4, got " + std::to_string(o.features));
  check_range("hash_encoding", "log2_table", o.log2_table, 4, 24);
  if (o.base_resolution < 1 || !(o.finest_resolution >= o.base_resolution) || o.finest_resolution > 65536)
    throw ValueError("[hash_encoding] resolutions must satisfy 1 <= base <= finest <= 65536, got base " +
                     std::to_string(o.base_resolution) + " and finest " +
                     std::to_string(o.finest_resolution));
}

template <class Level>
const kernels::HashLevel* raw(const std::vector<Level>& levels) {
  static_assert(sizeof(Level) == sizeof(kernels::HashLevel));
  return reinterpret_cast<const kernels::HashLevel*>(levels.data());
}

}  // namespace

template <class T>
HashEncoding<T>::HashEncoding(ParamStore<T>& store, std::string_view name, const HashEncodingOptions& o,
                              std::uint64_t seed)
    : features_(o.features) {
  check(o);
  const double growth =
      o.levels > 1 ? std::pow(o.finest_resolution / o.base_resolution, 1.0 / (o.levels - 1)) : 1.0;
  for (int l = 0; l < o.levels; ++l) {
    // The small excess keeps the finest level at N_max if rounding falls just below it.
    const auto n = static_cast<Index>(std::floor(o.base_resolution * std::pow(growth, l) + 1e-6));
    const Index corners = (n + 1) * (n + 1) * (n + 1), cap = Index{1} << o.log2_table;
    const bool hashed = corners > cap;
    levels_.push_back(
        {static_cast<std::uint32_t>(n), hashed ? static_cast<std::uint32_t>(cap - 1) : 0u, rows_});
    rows_ += hashed ? cap : corners;
  }
  table_ = store.add(std::string(name) + "/table", {rows_, Index{2} * features_}, ParamRole::table);
  std::mt19937_64 rng(seed);  // not CounterRng: recorded results depend on these bits, see nn/initial.h
  for (T& v : store.values(table_))
    v = static_cast<T>(1e-4 * (2 * static_cast<double>(rng() >> 11) * 0x1.0p-53 - 1));
}

template <class T>
void HashEncoding<T>::encode(std::span<const T> table, const T* x, Index n, T* density, T* colour) const {
  using namespace kernels;
  const auto forward = FIELDMARK_KERNEL(hash_forward<T>);
  parallel_for(n, kPointGrain, [&](Index begin, Index end) {
    forward(raw(levels_), levels(), features_, x + 3 * begin, end - begin, table.data(),
            density + begin * width(), colour + begin * width());
  });
}

template <class T>
void HashEncoding<T>::encode(const std::uint16_t* table, const float* x, Index n, float* density,
                             float* colour) const requires std::is_same_v<T, float> {
  using namespace kernels;
  const auto forward = FIELDMARK_KERNEL(hash_forward_bf16);
  parallel_for(n, kPointGrain, [&](Index begin, Index end) {
    forward(raw(levels_), levels(), features_, x + 3 * begin, end - begin, table, density + begin * width(),
            colour + begin * width());
  });
}

template <class T>
void HashEncoding<T>::deal_to_levels(Index n, const T* ddensity, const T* dcolour, T* out) const {
  using namespace kernels;
  const auto deal = FIELDMARK_KERNEL(hash_by_level<T>);
  parallel_for(n, kPointGrain,
               [&](Index b, Index e) { deal(levels(), features_, ddensity, dcolour, b, e, n, out); });
}

template <class T>
void HashEncoding<T>::backward_level(int level, const T* x, Index n, const T* d, std::span<T> grad) const {
  using namespace kernels;
  FIELDMARK_KERNEL(hash_backward_level<T>)(raw(levels_)[level], features_, x, n, d, grad.data());
}

template <class T>
void HashEncoding<T>::backward(const T* x, Index n, const T* ddensity, const T* dcolour, std::span<T> grad,
                               T* scratch) const {
  deal_to_levels(n, ddensity, dcolour, scratch);
  parallel_for(levels(), 1, [&](Index i, Index) {
    const Index l = levels() - 1 - i;  // the finest, slowest level first
    backward_level(static_cast<int>(l), x, n, scratch + l * n * 2 * features_, grad);
  });
}

template <class T>
void HashEncoding<T>::backward_positions(std::span<const T> table, const T* x, Index n, const T* ddensity,
                                         const T* dcolour, T* dx) const {
  using namespace kernels;
  const auto kernel = FIELDMARK_KERNEL(hash_backward_x<T>);
  parallel_for(n, kPointGrain, [&](Index b, Index e) {
    kernel(raw(levels_), levels(), features_, x + 3 * b, e - b, table.data(),
           ddensity ? ddensity + b * width() : nullptr, dcolour ? dcolour + b * width() : nullptr,
           dx + 3 * b);
  });
}

template <class T>
Var<T> HashEncoding<T>::operator()(const Params<T>& params, Var<T> x, Part part) const {
  check_rank("hash_encoding", "x", x.shape(), 2, "[N, 3]");
  check_extent("hash_encoding", "x", x.shape(), 1, 3, "x, y, z");
  Tape<T>& tape = x.tape();
  const Index n = x.shape()[0];
  const Var<T> table = params.leaf(tape, table_);
  T* y = nullptr;
  const Var<T> out = tape.output({n, width()}, &y, {x, table});
  T* unused = tape.scratch(n * width());
  const bool density = part == Part::density;
  encode({table.value(), static_cast<std::size_t>(table.shape().size())}, x.value(), n, density ? y : unused,
         density ? unused : y);

  // Each position owns its row of dx, so chunks of positions run in parallel. Positions share rows of the
  // table, but each level owns its rows, so there levels run in parallel.
  tape.on_backward(out, [this, x, table, n, density](const T* dy) {
    const T *dd = density ? dy : nullptr, *dc = density ? nullptr : dy;
    const auto size = static_cast<std::size_t>(table.shape().size());
    if (T* dx = x.grad_acc()) backward_positions({table.value(), size}, x.value(), n, dd, dc, dx);
    if (T* dt = table.grad_acc())
      backward(x.value(), n, dd, dc, {dt, size}, x.tape().scratch(2 * n * width()));
  });
  return out;
}

template class HashEncoding<float>;
template class HashEncoding<double>;

}  // namespace fieldmark::nerf
