#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>

#include "support/each_isa.h"
#include "support/expect_grad.h"

using namespace fieldmark;

namespace {
struct Pass {
  Tensor<float> y, dx, dw;
};

// Convolves, and takes dy backward onto gradients that begin at 0.25.
Pass pass(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act) {
  Tape<float> tape;
  Pass p{.y = {}, .dx = Tensor<float>(x.shape, 0.25f), .dw = Tensor<float>(w.shape, 0.25f)};
  Tensor<float> db(b.shape);
  const auto y = conv2d(tape.leaf(x, p.dx), tape.leaf(w, p.dw), tape.leaf(b, db), act);
  p.y = Tensor<float>(y.shape());
  std::copy_n(y.value(), p.y.size(), p.y.data.begin());
  const auto dy = uniform<float>({y.shape().size() / y.shape()[3]}, -1, 1, 5);
  std::vector<float> seed;
  for (Index i = 0; i < p.y.size(); ++i) seed.push_back(dy[i / y.shape()[3]]);
  tape.backward(y, seed);
  return p;
}

// The first n columns of t.
Tensor<float> columns(const Tensor<float>& t, Index n) {
  Shape shape = t.shape;
  Tensor<float> part(t.shape.rank() == 1 ? Shape{n} : Shape{shape[0], shape[1], shape[2], n});
  for (Index i = 0; i < part.size(); ++i) part[i] = t[i / n * shape[-1] + i % n];
  return part;
}
}  // namespace

TEST_CASE(
    "conv2d: few outputs have the bits that they have among many, forward and in the weights' gradient") {
  each_isa([] {
    for (const auto& [N, H, W, C, K] : {std::array<Index, 5>{2, 9, 70, 5, 3},
                                        {1, 3, 3, 1, 3},
                                        {3, 80, 33, 7, 3},
                                        {1, 20, 64, 4, 5},
                                        {1, 1, 1, 2, 5},
                                        {1, 3, 8, 2, 3},
                                        {1, 2, 4, 2, 3},
                                        {1, 2, 8, 2, 9},
                                        {0, 4, 5, 3, 3}})
      for (const Activation act : {Activation::none, Activation::relu}) {
        const auto x = uniform<float>({N, H, W, C}, -1, 1, 1), w = uniform<float>({K, K, C, 40}, -1, 1, 2),
                   b = uniform<float>({40}, -1, 1, 3);
        const Pass all = pass(x, w, b, act);
        for (Index o = 1; o <= 5; ++o) {
          CAPTURE(N, H, W, C, K, o);
          const Pass few = pass(x, columns(w, o), columns(b, o), act);
          CHECK(few.y.data == columns(all.y, o).data);
          CHECK(few.dw.data == columns(all.dw, o).data);
        }
      }
  });
}

TEST_CASE("conv2d: the gradient of few inputs has the bits that it has among many") {
  each_isa([] {
    const Index many = 40;
    for (const Index o : {1, 5, 7})
      for (const Activation act : {Activation::none, Activation::relu}) {
        const auto x = uniform<float>({2, 13, 37, many}, -1, 1, 1),
                   w = uniform<float>({3, 3, o, many}, -1, 1, 2), b = uniform<float>({o}, -1, 1, 3);
        // Weights that are 0 for all but the first inputs leave y as it is.
        const auto turned = [&](Index inputs, Index used) {
          Tensor<float> t({3, 3, inputs, o});
          for (Index i = 0; i < 9; ++i)
            for (Index c = 0; c < used; ++c)
              for (Index j = 0; j < o; ++j) t[(i * inputs + c) * o + j] = w[(i * o + j) * many + c];
          return t;
        };
        for (Index c = 1; c <= 5; ++c) {
          CAPTURE(o, c);
          const Pass few = pass(columns(x, c), turned(c, c), b, act), all = pass(x, turned(many, c), b, act);
          CHECK(few.dx.data == columns(all.dx, c).data);
        }
      }
  });
}

// In double, x86-64-v4 takes 2 outputs as few, AVX2 takes 1 and x86-64-v2 none.
TEST_CASE("conv2d: gradient with few outputs and few inputs") {
  each_isa([] {
    for (const Index n : {1, 2}) {
      CAPTURE(n);
      const Tensor<double> x = uniform({2, 4, 11, n}, -1, 1, 1), w = uniform({3, 3, n, n}, -1, 1, 2);
      Tensor<double> b = uniform({n}, -1, 1, 3);
      expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2]); }, {x, w, b});
      // A bias that keeps every ReLU of an output well open or shut: differences must not step over its kink.
      for (Index o = 0; o < n; ++o) b[o] += (o + n) % 2 == 0 ? 100 : -100;
      expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], Activation::relu); },
                  {x, w, b});
    }
  });
}

TEST_CASE("conv2d: no outputs and no inputs give a bias or nothing, and touch nothing else") {
  const auto check = []<class T>(T) {
    const Tensor<T> x({1, 4, 9, 3}, T(1)), none({1, 4, 9, 0});
    const Tensor<T> narrow({3, 3, 3, 0}), wide({3, 3, 0, 2}), no_bias({0});
    Tensor<T> dx(x.shape, T(7)), dnone(none.shape), dnarrow(narrow.shape), dwide(wide.shape), dno({0}),
        dbias({2});
    Tape<T> tape;
    const auto nothing = conv2d(tape.leaf(x, dx), tape.leaf(narrow, dnarrow), tape.leaf(no_bias, dno));
    CHECK(nothing.shape() == Shape{1, 4, 9, 0});
    const std::vector<T> no_seed;
    tape.backward(nothing, no_seed);
    CHECK(std::ranges::all_of(dx.data, [](T v) { return v == 7; }));

    const Tensor<T> bias({2}, std::vector<T>{3, 5});
    const auto flat = conv2d(tape.leaf(none, dnone), tape.leaf(wide, dwide), tape.leaf(bias, dbias));
    for (Index i = 0; i < flat.shape().size(); ++i)
      if (flat.value()[i] != bias[i % 2]) FAIL("output " << i << " is " << flat.value()[i]);
    const std::vector<T> ones(static_cast<std::size_t>(flat.shape().size()), T(1));
    tape.backward(flat, ones);
    CHECK(dbias.data == std::vector<T>{36, 36});
  };
  each_isa([&] {
    check(float{});
    check(double{});
  });
}

TEST_CASE("conv2d: few outputs have the same bits for 1 and 2 threads") {
  each_isa([] {
    const auto x = uniform<float>({2, 80, 33, 6}, -1, 1, 1), w = uniform<float>({3, 3, 6, 2}, -1, 1, 2),
               b = uniform<float>({2}, -1, 1, 3);
    const ScopedThreads serial(1);
    const Pass one = pass(x, w, b, Activation::relu);
    const ScopedThreads parallel(2);
    const Pass two = pass(x, w, b, Activation::relu);
    CHECK(one.y.data == two.y.data);
    CHECK(one.dx.data == two.dx.data);
    CHECK(one.dw.data == two.dw.data);
  });
}
