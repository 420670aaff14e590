#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/colour_affine.h>

namespace fieldmark::nerf {

template <class T>
Var<T> colour_affine(Var<T> rays, Var<T> affine, std::span<const Index> image) {
  check_rank("colour_affine", "rays", rays.shape(), 2, "[R, 4]");
  check_extent("colour_affine", "rays", rays.shape(), 1, 4, "red, green, blue, opacity");
  check_rank("colour_affine", "affine", affine.shape(), 2, "[V, 12]");
  check_extent("colour_affine", "affine", affine.shape(), 1, 12, "a 3 x 4 matrix");
  const Index n = rays.shape()[0], images = affine.shape()[0];
  if (std::ssize(image) != n)
    throw ShapeError("[colour_affine] image must have one element a ray (" + std::to_string(n) + "), got " +
                     std::to_string(image.size()));
  for (const Index v : image)
    if (v < 0 || v >= images)
      throw ValueError("[colour_affine] image must be in [0, " + std::to_string(images) + "), got " +
                       std::to_string(v));

  Tape<T>& tape = rays.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({n, 4}, &y, {rays, affine});
  const Index* of = image.data();
  for (Index r = 0; r < n; ++r) {
    const T *c = rays.value() + 4 * r, *d = affine.value() + 12 * of[r];
    for (Index k = 0; k < 3; ++k) {
      T sum = c[k];
      for (Index j = 0; j < 4; ++j) sum += d[4 * k + j] * c[j];
      y[4 * r + k] = sum;
    }
    y[4 * r + 3] = c[3];
  }

  // With c = (C, A): dL/dc = dy + D^T dy[:3] and dL/dD = dy[:3] c^T. Rays share the rows of D, so they are
  // added sequentially.
  tape.on_backward(out, [=](const T* dy) {
    T *dc = rays.grad_acc(), *dd = affine.grad_acc();
    for (Index r = 0; r < n; ++r) {
      const T *g = dy + 4 * r, *c = rays.value() + 4 * r, *d = affine.value() + 12 * of[r];
      for (Index j = 0; j < 4 && dc; ++j) {
        T sum = g[j];
        for (Index k = 0; k < 3; ++k) sum += d[4 * k + j] * g[k];
        dc[4 * r + j] += sum;
      }
      for (Index k = 0; k < 3 && dd; ++k)
        for (Index j = 0; j < 4; ++j) dd[12 * of[r] + 4 * k + j] += g[k] * c[j];
    }
  });
  return out;
}

template Var<float> colour_affine(Var<float>, Var<float>, std::span<const Index>);
template Var<double> colour_affine(Var<double>, Var<double>, std::span<const Index>);

}  // namespace fieldmark::nerf
