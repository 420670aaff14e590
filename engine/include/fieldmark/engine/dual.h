#pragma once
#include <fieldmark/engine/tape.h>

#include <algorithm>
#include <optional>
#include <string>
#include <type_traits>

namespace fieldmark {

/// A value and its tangent, for differentiation in forward mode.
///   f(x + e x') = f(x) + e J x',   e^2 = 0
/// The headers in engine/dual/ overload the ops for Duals, so a generic lambda runs on Vars and on Duals; an
/// argument that stays a Var is a constant. A tangent is recorded on the tape by the ops themselves: a
/// backward from it gives second derivatives. products.h does both for whole functions.
///
/// Where an op has a kink, the tangent follows the backward: a mask is a constant. Ops without a tangent do
/// not compile with Duals: max_pool, conv_transpose2d, dropout, symmetric_eigenvalues, and the layers of nn/.
template <class T>
class Dual {
 public:
  /// A constant: its tangent is 0 and costs nothing.
  Dual(Var<T> value) : value_(value) {}
  /// @throws ShapeError if the shapes differ   @throws ValueError if the tapes do
  Dual(Var<T> value, Var<T> tangent) : value_(value), tangent_(tangent) {
    if (tangent.shape() != value.shape())
      throw ShapeError("[dual] tangent must have the shape of its value, " + value.shape().str() +
                       ", got shape " + tangent.shape().str());
    if (&tangent.tape() != &value.tape())
      throw ValueError("[dual] value and tangent must be recorded on one tape, got two");
  }
  /// The value itself.
  Var<T> value() const { return value_; }
  /// Whether there is a tangent; without one it is 0.
  bool has_tangent() const { return tangent_.has_value(); }
  /// The tangent, of the value's shape; zeros if there is none.
  Var<T> tangent() const {
    if (tangent_) return *tangent_;
    const Index n = shape().size();
    T* zeros = tape().scratch(n);
    std::fill_n(zeros, n, T(0));
    return tape().constant(zeros, shape());
  }
  /// Extents of value and tangent.
  const Shape& shape() const { return value_.shape(); }
  /// The tape on which both are recorded.
  Tape<T>& tape() const { return value_.tape(); }

 private:
  Var<T> value_;
  std::optional<Var<T>> tangent_;
};

namespace detail {

/// What the ops of Duals take: Vars and Duals.
template <class A>
struct DualOperand {
  using Scalar = void;                    ///< T of a Var<T> or a Dual<T>
  static constexpr bool operand = false;  ///< whether A is one of them
  static constexpr bool dual = false;     ///< whether A is a Dual
};
/// A Var.
template <class T>
struct DualOperand<Var<T>> {
  using Scalar = T;                      ///< T
  static constexpr bool operand = true;  ///< yes
  static constexpr bool dual = false;    ///< no
};
/// A Dual.
template <class T>
struct DualOperand<Dual<T>> {
  using Scalar = T;                      ///< T
  static constexpr bool operand = true;  ///< yes
  static constexpr bool dual = true;     ///< yes
};

// Vars and Duals of one scalar type, of which one is a Dual.
template <class First, class... Rest>
concept AnyDual =
    DualOperand<First>::operand &&
    (std::is_same_v<typename DualOperand<First>::Scalar, typename DualOperand<Rest>::Scalar>&&...) &&
    (DualOperand<First>::dual || ... || DualOperand<Rest>::dual);

// The same, of which one is a Var.
template <class First, class... Rest>
concept MixedDuals = AnyDual<First, Rest...> && !(DualOperand<First>::dual && ... && DualOperand<Rest>::dual);

template <class A>
Dual<typename DualOperand<A>::Scalar> as_dual(const A& a) {
  return a;
}

template <class T>
Var<T> value_of(Var<T> a) {
  return a;
}
template <class T>
Var<T> value_of(const Dual<T>& a) {
  return a.value();
}

}  // namespace detail
}  // namespace fieldmark
