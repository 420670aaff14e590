#include "fieldmark/extractor/centred_image.h"

#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

namespace fieldmark::extractor {
namespace {

constexpr Index kRows = 64;  // of one image in a chunk

}  // namespace

template <class T>
Var<T> centred_image(Var<T> x, Index multiple) {
  const Shape from = x.shape();
  check_rank("centred_image", "x", from, 4, "[images, height, width, channels]");
  if (multiple < 1)
    throw ValueError("[centred_image] multiple must be at least 1, got " + std::to_string(multiple));
  const Index height = from[1] - from[1] % multiple, width = from[2] - from[2] % multiple;
  const Index rows = from[0] * height, wide = from[2] * from[3], kept = width * from[3];
  // Offset in x of row r of the result.
  const auto start = [=](Index r) { return (r / height * from[1] + r % height) * wide; };
  T* y = nullptr;
  const Var<T> out = x.tape().output({from[0], height, width, from[3]}, &y, {x});
  const T* xv = x.value();
  parallel_for(rows, kRows, [=](Index begin, Index end) {
    for (Index r = begin; r < end; ++r)
      for (Index i = 0; i < kept; ++i) y[r * kept + i] = 2 * xv[start(r) + i] - 1;
  });

  // dy/dx = 2 for kept pixels. Each row of x has one owner.
  x.tape().on_backward(out, [x, rows, kept, start](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(rows, kRows, [=](Index begin, Index end) {
      for (Index r = begin; r < end; ++r)
        for (Index i = 0; i < kept; ++i) dx[start(r) + i] += 2 * dy[r * kept + i];
    });
  });
  return out;
}

template Var<float> centred_image(Var<float>, Index);
template Var<double> centred_image(Var<double>, Index);

}  // namespace fieldmark::extractor
