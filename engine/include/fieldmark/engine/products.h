#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/tensor.h>

#include <functional>
#include <initializer_list>
#include <span>
#include <type_traits>
#include <vector>

namespace fieldmark {

// Products with the Jacobian J = df/dx and the Hessian H of a function f, without forming the matrices. f
// takes a tape and its inputs, as in gradcheck(). One generic lambda serves all products:
//   const auto f = [&](auto& tape, auto x) { return sum(tanh(matmul(x[0], tape.constant(w)))); };
// For jvp() and hvp(), include the Dual ops that f needs from engine/dual/. An input that f does not use
// gives zeros.
//
// Parameters that f reads through Params(store) are constants, but vjp() and hvp() add to the gradients of
// the store, as every backward does. Params(store, nullptr) computes no gradients and leaves the store as it
// was.

/// A function f of Vars.
template <class T>
using VarFunction = std::function<Var<T>(Tape<T>&, std::span<const Var<T>>)>;
/// A function f of Duals.
template <class T>
using DualFunction = std::function<Dual<T>(Tape<T>&, std::span<const Dual<T>>)>;

/// Result of jvp().
template <class T>
struct Jvp {
  Tensor<T> value;    ///< f(x)
  Tensor<T> product;  ///< J v, of the same shape
};
/// Result of vjp() and hvp().
template <class T>
struct InputProducts {
  Tensor<T> value;                  ///< f(x)
  std::vector<Tensor<T>> products;  ///< one per input, of its shape
};

/// @{
/// Computes the Jacobian-vector product J v = d/ds f(x + s v) at s = 0 in forward mode, at about three times
/// the cost of f.
/// @param tangents  v, one per input, of its shape
/// @throws ShapeError if a shape differs   @throws ValueError if the numbers of inputs and tangents differ
template <class T>
Jvp<T> jvp(const std::type_identity_t<DualFunction<T>>& f, std::span<const Tensor<T>> inputs,
           std::span<const Tensor<T>> tangents);
template <class T>
Jvp<T> jvp(const std::type_identity_t<DualFunction<T>>& f, std::initializer_list<Tensor<T>> inputs,
           std::initializer_list<Tensor<T>> tangents) {
  return jvp<T>(f, std::span(inputs.begin(), inputs.size()), std::span(tangents.begin(), tangents.size()));
}
/// @}

/// @{
/// Computes the vector-Jacobian product J^T u for each input, in reverse mode. Adds to the gradients of
/// parameters that f reads through Params(store); Params(store, nullptr) has none.
/// @param cotangent  u, of the shape of f(x)   @throws ShapeError if its shape differs
template <class T>
InputProducts<T> vjp(const std::type_identity_t<VarFunction<T>>& f, std::span<const Tensor<T>> inputs,
                     const Tensor<T>& cotangent);
template <class T>
InputProducts<T> vjp(const std::type_identity_t<VarFunction<T>>& f, std::initializer_list<Tensor<T>> inputs,
                     const Tensor<T>& cotangent) {
  return vjp<T>(f, std::span(inputs.begin(), inputs.size()), cotangent);
}
/// @}

/// @{
/// Computes Hessian-vector products of a scalar f by a backward pass from its tangent:
///   (H v)_i = sum_j d^2 f / dx_i dx_j v_j
/// Adds to the gradients of parameters that f reads through Params(store); Params(store, nullptr) has none.
/// @param directions  v, one per input, of its shape
/// @throws ShapeError if a shape differs or f(x) has more than one element
/// @throws ValueError if the numbers of inputs and directions differ
template <class T>
InputProducts<T> hvp(const std::type_identity_t<DualFunction<T>>& f, std::span<const Tensor<T>> inputs,
                     std::span<const Tensor<T>> directions);
template <class T>
InputProducts<T> hvp(const std::type_identity_t<DualFunction<T>>& f, std::initializer_list<Tensor<T>> inputs,
                     std::initializer_list<Tensor<T>> directions) {
  return hvp<T>(f, std::span(inputs.begin(), inputs.size()),
                std::span(directions.begin(), directions.size()));
}
/// @}

}  // namespace fieldmark
