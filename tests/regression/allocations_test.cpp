#include <fieldmark/distort/gradcheck_cases.h>
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/fused.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/extractor/gradcheck_cases.h>
#include <fieldmark/imaging/gradcheck_cases.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <utility>

#include "nerf/small_field.h"
#include "pass_visitor.h"
#include "support/catch.h"
#include "support/random.h"

// A training step allocates nothing once its buffers have grown. The test counts every call of malloc,
// calloc, realloc, memalign, aligned_alloc and posix_memalign by any thread of this program, which includes
// operator new, arenas and OpenMP. It replaces the C library's functions by ones that count and then call the
// originals.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define FIELDMARK_COUNTS_ALLOCATIONS 1
#else
#define FIELDMARK_COUNTS_ALLOCATIONS 0  // a sanitizer replaces the functions itself
#endif

namespace {
std::atomic<long> allocations{0};
}

#if FIELDMARK_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t n) noexcept {
  ++allocations;
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t size) noexcept {
  ++allocations;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t n) noexcept {
  ++allocations;
  return __libc_realloc(p, n);
}
void* memalign(std::size_t align, std::size_t n) noexcept {
  ++allocations;
  return __libc_memalign(align, n);
}
void* aligned_alloc(std::size_t align, std::size_t n) noexcept { return memalign(align, n); }
int posix_memalign(void** p, std::size_t align, std::size_t n) noexcept {
  *p = memalign(align, n);
  return *p || n == 0 ? 0 : ENOMEM;
}
}
#endif

using namespace fieldmark;

namespace {

bool counts() {
  if (!FIELDMARK_COUNTS_ALLOCATIONS) std::cout << "SKIPPED: counting allocations needs glibc, no sanitizer\n";
  return FIELDMARK_COUNTS_ALLOCATIONS;
}

// Returns the number of allocations during the given number of calls of `step`.
template <class F>
long allocations_in(int steps, F step) {
  const long before = allocations;
  for (int i = 0; i < steps; ++i) step();
  return allocations - before;
}

template <class F>
void for_threads(F check) {
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    INFO(n << " threads");
    check();
  }
}

}  // namespace

TEST_CASE("allocations: what allocates is counted") {
  if (!counts()) return;
  static void* volatile seen;  // keeps the allocation from being optimised away
  (void)seen;
  CHECK(allocations_in(3, [] {
          const auto number = std::make_unique<int>(1);
          seen = number.get();
        }) == 3);
  CHECK(allocations_in(1, [] {
          Arena arena;
          seen = arena.allocate(1 << 20);
        }) == 2);  // the list of blocks, and the block
  CHECK(allocations_in(2, [] {
          AlignedVector<float> numbers(100);
          seen = numbers.data();
        }) == 2);
  CHECK(allocations_in(1, [] {
          void* room = calloc(3, 5);
          seen = room;
          free(room);
        }) == 1);
}

TEST_CASE("allocations: chains, reductions and convolutions allocate nothing after the first pass") {
  if (!counts()) return;
  for_threads([] {
    const auto x = uniform<float>({2, 8, 8, 4}, -1, 1, 1), row = uniform<float>({4}, -1, 1, 2),
               w = uniform<float>({3, 3, 4, 4}, -1, 1, 3);
    Tensor<float> dx(x.shape), drow(row.shape), dw(w.shape);
    Tape<float> tape;
    const auto pass = [&] {
      tape.reset();
      const auto bias = tape.leaf(row, drow);
      const auto y = conv2d(tape.leaf(x, dx), tape.leaf(w, dw), bias);
      const auto z = fused([](auto v, auto b) { return v * sigmoid(v + b); }, y, bias) + tanh(y) * bias;
      tape.backward(sum(square(mean(z, {0, 1, 2}))));
    };
    pass();
    CHECK(allocations_in(5, pass) == 0);
    CHECK(std::isfinite(dw[0]));
  });
}

namespace {

// Cases whose passes allocate, with the reason.
constexpr const char* kReturnsVector = "features() of a whole network returns its taps in a vector";
const std::vector<std::pair<std::string, std::string>> kAllocate{{"lpips: alex", kReturnsVector},
                                                                 {"lpips: squeeze", kReturnsVector},
                                                                 {"vgg16_features: loss", kReturnsVector}};

// Adds a line for each case of a room whose passes allocate after the first two, unless it has a reason to,
// and for each that has a reason and does not. Cases of second order run the same ops through their tangents.
void count_passes(const std::string& room, const std::vector<GradcheckCase>& cases, std::string& wrong) {
  for (const GradcheckCase& c : cases) {
    if (c.name.ends_with(", second order")) continue;
    long counted = -1;
    const detail::ScopedPassVisitor::Visit visit = [&](const std::function<void()>& pass) {
      allocations_in(2, pass);
      counted = std::max(counted, 0L) + allocations_in(3, pass);  // a case may check several functions
    };
    const detail::ScopedPassVisitor scope(visit);
    c.run();
    const bool may = std::ranges::any_of(kAllocate, [&](const auto& a) { return a.first == c.name; });
    if (counted < 0 || (counted > 0) != may)
      wrong += room + ": " + c.name + ": " + std::to_string(counted) + "\n";
  }
}

}  // namespace

TEST_CASE("allocations: every op allocates nothing after its first pass, forward and backward") {
  if (!counts()) return;
  for_threads([] {
    std::string wrong;  // allocations of three passes; -1 for a case without a pass
    count_passes("engine", gradcheck_cases(), wrong);
    count_passes("nerf", nerf::gradcheck_cases(), wrong);
    count_passes("distort", distort::gradcheck_cases(), wrong);
    count_passes("extractor", extractor::gradcheck_cases(), wrong);
    count_passes("imaging", imaging::gradcheck_cases(), wrong);
    CHECK(wrong == "");
  });
}

TEST_CASE("allocations: solves and decompositions of 100 rows allocate nothing after the first pass") {
  if (!counts()) return;
  for_threads([] {
    constexpr Index n = 100;
    auto a = uniform<float>({3, n, n}, -1, 1, 1);
    for (Index i = 0; i < 3 * n; ++i) a[i * n + i % n] += 2 * n;  // positive definite
    const auto b = uniform<float>({3, n, 2}, -1, 1, 2);
    Tensor<float> da(a.shape), db(b.shape);
    Tape<float> tape;
    const auto pass = [&] {
      tape.reset();
      const Var<float> m = tape.leaf(a, da), right = tape.leaf(b, db);
      const Var<float> of_matrices = sum(inverse(m)) + sum(cholesky(m)) + sum(symmetric_eigenvalues(m)) +
                                     sum(log_determinant(m)) + sum(determinant(m / 200));
      tape.backward(of_matrices + sum(solve(m, right)) + sum(triangular_solve(m, right)));
    };
    pass();
    CHECK(allocations_in(2, pass) == 0);
    CHECK(std::isfinite(da[0]));
  });
}

TEST_CASE("allocations: a step of a network, its loop, Muon and Adam allocates nothing after the first") {
  if (!counts()) return;
  for_threads([] {
    ParamStore<float> store;
    const Dense<float> first(store, "first", {.in = 5, .out = 64, .activation = Activation::relu}, 1),
        second(store, "second", {.in = 64, .out = 3}, 2);
    PackedWeights<float> packed(store);
    ShardedLoop<float> loop(16, store.size());
    Adam<float> adam(store.size(), {.zero_grads = true});
    Muon<float> muon(store, {"first/weight"}, {.zero_grads = true});
    const auto x = uniform<float>({40 * 128, 5}, -1, 1, 1), y = uniform<float>({40 * 128, 3}, -1, 1, 2);
    double loss = 0;
    const auto step = [&] {
      packed.update();
      loss = loop.run(
          40,
          [&](Index c, Index, Tape<float>& tape, float* grads) {
            const Params<float> params(store, grads, packed);
            const Var<float> in = tape.constant(x.data.data() + c * 128 * 5, {128, 5});
            const Var<float> want = tape.constant(y.data.data() + c * 128 * 3, {128, 3});
            const Var<float> error = mse_loss(second(params, first(params, in)), want);
            tape.backward(error);
            return static_cast<double>(error.value()[0]);
          },
          store.grads());
      muon.step(store.values(), store.grads());
      adam.step(store.values(), store.grads());
    };
    step();
    const double before = loss;
    CHECK(allocations_in(20, step) == 0);
    CHECK(loss < before);
  });
}

TEST_CASE(
    "allocations: a step of a radiance field allocates nothing once rays are many, occupancy included") {
  if (!counts()) return;
  using namespace nerf;
  const Dataset data = make_scene({.size = 48, .views = 12});
  for_threads([&] {
    RadianceField field(trainable_field_options());
    Trainer trainer(
        field, data,
        {.schedule = {.steps = 260}, .samples_per_step = 8192, .first_samples = 8192, .warm_up = 16});
    // Cells become empty at steps 16, 32 and 48: rays then have fewer samples, so a step takes more rays and
    // uses the last shards for the first time. Hard pixels shift the samples until about step 150.
    for (int i = 0; i < 200; ++i) trainer.step(0);
    CHECK(allocations_in(60, [&] { trainer.step(0); }) == 0);
    CHECK(trainer.done());
    CHECK(trainer.train_psnr() > 15);
  });
}

TEST_CASE("allocations: a step of an mlp field allocates nothing once its rays have filled the buffers") {
  if (!counts()) return;
  using namespace nerf;
  const Dataset data = make_scene({.size = 48, .views = 12});
  for_threads([&] {
    RadianceField field(small_mlp_options());
    TrainOptions options = train_options(FieldKind::mlp);
    options.schedule.steps = 140;
    options.samples_per_step = 4096;
    Trainer trainer(field, data, options);
    for (int i = 0; i < 60; ++i) trainer.step(0);
    CHECK(allocations_in(40, [&] { trainer.step(0); }) == 0);
  });
}
