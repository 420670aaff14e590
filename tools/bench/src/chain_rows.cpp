#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/ops/fused.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>

#include "peer_work.h"
#include "rows.h"

namespace fieldmark::bench {
namespace {

constexpr Index kElements = 10'000'000, kErrorElements = 10'000;
constexpr Index kNodes = 1000, kNodeElements = 16;

// The chains, also written in pytorch_peer.py.
const auto swish = [](auto x, auto w, auto b) { return x * sigmoid(x * w + b); };
const auto arithmetic = [](auto x, auto w, auto b) { return 0.5 * relu(x * w + b) + (x - w) * (x - b); };

// numbers() in memory like that of parameters and of a tape.
template <class T>
AlignedVector<T> aligned_numbers(Index n, std::uint64_t seed) {
  const auto plain = numbers<T>(n, seed);
  return {plain.begin(), plain.end()};
}

// y = f(x, w, b) of equal shapes, forward and backward in one pass each; the loss is <u, y> with a fixed u.
template <class T>
struct ChainPass {
  explicit ChainPass(Index n_) : n(n_), w(store.add("w", {n})), b(store.add("b", {n})) {
    x = aligned_numbers<T>(n, 3);
    u = aligned_numbers<T>(n, 4);
    dx.resize(x.size());
    const auto parameters = numbers<T>(store.size(), 5);
    std::copy(parameters.begin(), parameters.end(), store.values().begin());
  }
  template <class F>
  void run(F f) {
    tape.reset();
    const auto parameter = [&](ParamId id) {
      return tape.fresh_leaf(store.values(id).data(), store.grads(id).data(), {n});
    };
    const Var<T> y = fused(f, tape.fresh_leaf(x.data(), dx.data(), {n}), parameter(w), parameter(b));
    values.assign(y.value(), y.value() + (keep ? n : 0));
    tape.backward_in_place(y, u);
  }
  // Traffic: x, w, b, y; then x, w, b, the seed u and the gradients of x, w, b.
  double bytes() const { return (4.0 + 7) * static_cast<double>(n) * sizeof(T); }

  Index n;
  ParamStore<T> store;
  ParamId w, b;
  Tape<T> tape;
  AlignedVector<T> x, u, dx;
  std::vector<T> values;
  bool keep = false;
};

// Measures the seconds that this machine takes to add two arrays into a third, per byte read or written.
class Memory {
 public:
  explicit Memory(Index n)
      : a_(aligned_numbers<float>(n, 7)), b_(aligned_numbers<float>(n, 8)), sum_(a_.size()) {}
  double seconds_per_byte() {
    const double begin = now();
    parallel_for(static_cast<Index>(a_.size()), kGrain, [&](Index from, Index to) {
      for (Index i = from; i < to; ++i) sum_[at(i)] = a_[at(i)] + b_[at(i)];
    });
    return (now() - begin) / (3.0 * sizeof(float) * static_cast<double>(a_.size()));
  }

 private:
  static constexpr Index kGrain = Index{1} << 15;
  AlignedVector<float> a_, b_, sum_;
};

template <class F>
double error_of(F f) {
  ChainPass<float> single(kErrorElements);
  ChainPass<double> exact(kErrorElements);
  single.keep = exact.keep = true;
  single.run(f);
  exact.run(f);
  return std::max({relative_error(single.values, exact.values), relative_error(single.dx, exact.dx),
                   relative_error(single.store.grads(), exact.store.grads())});
}

Index scaled(const RowOptions& o) {
  return std::max<Index>(kErrorElements, static_cast<Index>(kElements * o.scale));
}

// Alternates runs with measurements of memory speed.
template <class F>
EngineRow chain(F f, const RowOptions& o) {
  ChainPass<float> pass(scaled(o));
  Memory memory(pass.n);
  std::vector<double> cost;
  const auto between = [&] {
    cost.push_back(memory.seconds_per_byte());
    if (o.between) o.between();
  };
  memory.seconds_per_byte();
  EngineRow row =
      row_of(time_calls([&] { pass.run(f); }, o.runs, 0, between), 0, static_cast<double>(pass.n));
  row.gigabytes = pass.bytes() / row.seconds * 1e-9;
  row.ratio_to_memory = row.gigabytes * 1e9 * median(cost);
  row.error = error_of(f);
  return row;
}

std::vector<float> plain(const AlignedVector<float>& v) { return {v.begin(), v.end()}; }

template <class F>
SafetensorsFile work(const char* network, F f, const RowOptions& o) {
  ChainPass<float> pass(scaled(o));
  pass.keep = true;
  pass.run(f);
  return peer_work(network, pass.store,
                   {{pass.n}, {pass.n}, plain(pass.x), plain(pass.u), pass.values, plain(pass.dx)});
}

// A row of small ops, forward and backward: the overhead of an op besides its arithmetic.
template <class T>
struct NodePass {
  NodePass() : x(numbers<T>(kNodeElements, 3)), u(numbers<T>(kNodeElements, 4)), dx(x.size()) {}
  void run() {
    tape.reset();
    std::fill(dx.begin(), dx.end(), T(0));
    const Var<T> first = tape.leaf(x.data(), dx.data(), {kNodeElements});
    Var<T> y = first;
    for (Index i = 0; i < kNodes; ++i) y = mul(y, first);
    tape.backward(y, u);
  }
  Tape<T> tape;
  std::vector<T> x, u, dx;
};

EngineRow nodes(const RowOptions& o) {
  NodePass<float> pass;
  // Near 1, so that a product of a thousand factors stays in range.
  for (float& v : pass.x) v = 1 + v / 1024;
  NodePass<double> exact;
  std::copy(pass.x.begin(), pass.x.end(), exact.x.begin());
  EngineRow row = row_of(time_calls([&] { pass.run(); }, o.runs, 0.02, o.between), 0, kNodes);
  exact.run();
  row.error = relative_error(pass.dx, exact.dx);
  return row;
}

}  // namespace

std::vector<RowSpec> chain_rows() {
  return {{"chain_swish_fb_f32", "x sigmoid(w x + b) of 10 million elements, fused",
           [](const RowOptions& o) { return chain(swish, o); },
           [](const RowOptions& o) { return work("swish", swish, o); }},
          {"chain_arithmetic_fb_f32", "relu(w x + b) / 2 + (x - w) (x - b) of 10 million elements, fused",
           [](const RowOptions& o) { return chain(arithmetic, o); },
           [](const RowOptions& o) { return work("arithmetic", arithmetic, o); }},
          {"node_16_fb_f32", "1,000 products of 16 elements, an op each", nodes}};
}

}  // namespace fieldmark::bench
