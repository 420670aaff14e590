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
/// argument that stays a Var is a constant. The ops record the tangent on the tape, so a backward pass from
/// the tangent gives second derivatives. products.h does both for whole functions.
///
/// At a kink the tangent follows the backward: masks are constants. Ops without a tangent do not compile
/// with Duals: max_pool, conv_transpose2d, dropout, symmetric_eigenvalues, and the layers of nn/.
template <class T>
class Dual {
 public:
  /// Makes a constant, whose tangent is 0 and costs nothing.
  Dual(Var<T> value) : value_(value) {}
  /// Pairs a value with its tangent.
  /// @throws ShapeError if the shapes differ   @throws ValueError if the tapes differ
  Dual(Var<T> value, Var<T> tangent) : value_(value), tangent_(tangent) {
    if (tangent.shape() != value.shape())
      throw ShapeError("[dual] tangent must have the shape of its value, " + value.shape().str() +
                       ", got shape " + tangent.shape().str());
    if (&tangent.tape() != &value.tape())
      throw ValueError("[dual] value and tangent must be recorded on one tape, got two");
  }
  /// Returns the value.
  Var<T> value() const { return value_; }
  /// True if there is a tangent; without one it is 0.
  bool has_tangent() const { return tangent_.has_value(); }
  /// Returns the tangent, of the value's shape; zeros if there is none.
  Var<T> tangent() const {
    if (tangent_) return *tangent_;
    const Index n = shape().size();
    T* zeros = tape().scratch(n);
    std::fill_n(zeros, n, T(0));
    return tape().constant(zeros, shape());
  }
  /// Returns the extents of value and tangent.
  const Shape& shape() const { return value_.shape(); }
  /// Returns the tape that records both.
  Tape<T>& tape() const { return value_.tape(); }

 private:
  Var<T> value_;
  std::optional<Var<T>> tangent_;
};

namespace detail {

/// Traits of the operands of Dual ops: Vars and Duals.
template <class A>
struct DualOperand {
  using Scalar = void;                    ///< T of a Var<T> or a Dual<T>
  static constexpr bool operand = false;  ///< true if A is a Var or a Dual
  static constexpr bool dual = false;     ///< true if A is a Dual
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

// Vars and Duals of one scalar type, at least one of them a Dual.
template <class First, class... Rest>
concept AnyDual =
    DualOperand<First>::operand &&
    (std::is_same_v<typename DualOperand<First>::Scalar, typename DualOperand<Rest>::Scalar>&&...) &&
    (DualOperand<First>::dual || ... || DualOperand<Rest>::dual);

// As AnyDual, but with at least one Var.
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
