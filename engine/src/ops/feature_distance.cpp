#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/shape_checks.h>

#include "kernels/feature_distance.h"
#include "ops/chunks.h"

namespace fieldmark {

template <class T>
Var<T> feature_distance(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights) {
  using namespace kernels;
  const Shape s = a.shape();
  check_rank("feature_distance", "a", s, 4, "[images, height, width, channels]");
  check_same("feature_distance", "a", s, "b", b.shape());
  if (s[1] < 1 || s[2] < 1)
    throw ShapeError("[feature_distance] a must have at least one pixel, got shape " + s.str());
  check_extent("feature_distance", "weights", {static_cast<Index>(weights.size())}, 0, s[3],
               "the channels of a", s);
  const Index pixels = s[1] * s[2], block = detail::row_grain(s[3]), blocks = (pixels + block - 1) / block;
  T* y = nullptr;
  Tape<T>& tape = a.tape();
  const Var<T> out = tape.output({s[0]}, &y, {a, b});
  auto* sums = tape.template scratch<double>(s[0] * blocks);
  const auto forward = FIELDMARK_KERNEL(feature_distance<T>);
  const T* w = detail::kept(tape, weights);
  detail::for_image_chunks(s[0], pixels, block, [&](Index n, Index first, Index count) {
    const Index at = (n * pixels + first) * s[3];
    sums[n * blocks + first / block] = forward({a.value() + at, b.value() + at, w, count, s[3]});
  });
  for (Index n = 0; n < s[0]; ++n)
    y[n] =
        static_cast<T>(detail::channel_total(sums + n * blocks, blocks, 1, 0) / static_cast<double>(pixels));

  // With r = |a| and s = 1 / (r + e), d = a s - b s_b and g_c = 2 w_c d_c dy / pixels:
  //   da_c = g_c s - a_c (g . a) s^2 / r,   and db with a and b swapped, which only flips the sign of d.
  // A chunk owns its pixels.
  tape.on_backward(out, [=](const T* dy) {
    const auto backward = FIELDMARK_KERNEL(feature_distance_backward<T>);
    const auto run = [&](Var<T> of, Var<T> other) {
      bool fresh = false;
      T* d = of.grad_acc(&fresh);
      if (!d) return;
      detail::for_image_chunks(s[0], pixels, block, [&](Index n, Index first, Index count) {
        const Index at = (n * pixels + first) * s[3];
        backward({of.value() + at, other.value() + at, w, count, s[3]}, dy[n] / static_cast<T>(pixels),
                 !fresh, d + at);
      });
    };
    run(a, b);
    run(b, a);
  });
  return out;
}

template Var<float> feature_distance(Var<float>, Var<float>, std::span<const float>);
template Var<double> feature_distance(Var<double>, Var<double>, std::span<const double>);

}  // namespace fieldmark
