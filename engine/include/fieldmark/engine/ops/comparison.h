#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// Comparisons return 1 where they hold and 0 elsewhere, including for NaN. They broadcast like the ops of
// arithmetic.h and have no gradient.

/// Returns 1 where a > b, else 0.
/// @throws ShapeError if the shapes do not broadcast
template <class T>
Var<T> greater(Var<T> a, Var<T> b);

/// Returns 1 where a < b, else 0.
/// @throws ShapeError if the shapes do not broadcast
template <class T>
Var<T> less(Var<T> a, Var<T> b);

/// Returns 1 where a = b, else 0.
/// @throws ShapeError if the shapes do not broadcast
template <class T>
Var<T> equal(Var<T> a, Var<T> b);

/// Chooses element by element: a where the mask is not 0, b where it is 0. An element that is not chosen may
/// be infinite or NaN: it affects neither value nor gradient.
/// @param mask  such as a comparison; its shape broadcasts to that of a and b
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b.
template <class T>
Var<T> where(Var<T> mask, Var<T> a, Var<T> b);

}  // namespace fieldmark
