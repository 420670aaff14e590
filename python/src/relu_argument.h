#pragma once
#include <fieldmark/engine/ops/dense.h>

namespace fieldmark::python {

/// Returns the activation after an affine map or a convolution with the argument `relu`.
constexpr Activation activation(bool relu) { return relu ? Activation::relu : Activation::none; }

}  // namespace fieldmark::python
