#pragma once
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/math.h>

#include <type_traits>

namespace fieldmark {

// Arithmetic operators, as in a * b + 1.0f. Operands broadcast like those of arithmetic.h; one of the two may
// be a number.

/// @{
/// Applies the corresponding op of arithmetic.h. @throws ShapeError if the shapes do not broadcast
template <class T>
Var<T> operator+(Var<T> a, Var<T> b) {
  return add(a, b);
}
template <class T>
Var<T> operator-(Var<T> a, Var<T> b) {
  return sub(a, b);
}
template <class T>
Var<T> operator*(Var<T> a, Var<T> b) {
  return mul(a, b);
}
template <class T>
Var<T> operator/(Var<T> a, Var<T> b) {
  return div(a, b);
}
template <class T>
Var<T> operator-(Var<T> a) {
  return negate(a);
}
/// @}

/// @{
/// Combines every element with a number.
template <class T>
Var<T> operator+(Var<T> a, std::type_identity_t<T> number) {
  return affine(a, 1, static_cast<double>(number));
}
template <class T>
Var<T> operator+(std::type_identity_t<T> number, Var<T> a) {
  return affine(a, 1, static_cast<double>(number));
}
template <class T>
Var<T> operator-(Var<T> a, std::type_identity_t<T> number) {
  return affine(a, 1, -static_cast<double>(number));
}
template <class T>
Var<T> operator-(std::type_identity_t<T> number, Var<T> a) {
  return affine(a, -1, static_cast<double>(number));
}
template <class T>
Var<T> operator*(Var<T> a, std::type_identity_t<T> number) {
  return scale(a, static_cast<double>(number));
}
template <class T>
Var<T> operator*(std::type_identity_t<T> number, Var<T> a) {
  return scale(a, static_cast<double>(number));
}
template <class T>
Var<T> operator/(Var<T> a, std::type_identity_t<T> number) {
  return div(a, static_cast<double>(number));
}
template <class T>
Var<T> operator/(std::type_identity_t<T> number, Var<T> a) {
  return scale(reciprocal(a), static_cast<double>(number));
}
/// @}

}  // namespace fieldmark
