#pragma once
// Opt-in: the one public header that needs Eigen 3.4 (link Eigen3::Eigen too).
#include <fieldmark/engine/tape.h>

#include <Eigen/Core>
#include <array>

namespace fieldmark {

/// A row-major Eigen matrix, laid out like a tensor.
template <class T>
using EigenMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// An Eigen column array.
template <class T>
using EigenArray = Eigen::Array<T, Eigen::Dynamic, 1>;

namespace detail {
// Rows and columns of a shape of rank 1 (a column) or 2.
inline std::array<Index, 2> matrix_extents(const Shape& s) {
  if (s.rank() != 1 && s.rank() != 2)
    throw ShapeError("[as_matrix] t must have rank 1 [rows] or 2 [rows, columns], got shape " + s.str());
  return {s[0], s.rank() == 2 ? s[1] : 1};
}
}  // namespace detail

// A map shares the memory of its source and must not outlive it; a map of a Var is valid until Tape::reset().

/// @{
/// Maps a tensor or the values of a Var: rank 2 to a matrix, rank 1 to a column.
/// @throws ShapeError for any other rank
template <class T>
Eigen::Map<EigenMatrix<T>> as_matrix(Tensor<T>& t) {
  const auto [rows, columns] = detail::matrix_extents(t.shape);
  return {t.data.data(), rows, columns};
}
template <class T>
Eigen::Map<const EigenMatrix<T>> as_matrix(const Tensor<T>& t) {
  const auto [rows, columns] = detail::matrix_extents(t.shape);
  return {t.data.data(), rows, columns};
}
template <class T>
void as_matrix(Tensor<T>&& t) = delete;
template <class T>
Eigen::Map<const EigenMatrix<T>> as_matrix(Var<T> v) {
  const auto [rows, columns] = detail::matrix_extents(v.shape());
  return {v.value(), rows, columns};
}
/// @}

/// @{
/// Maps all elements in row-major order, whatever the rank.
template <class T>
Eigen::Map<EigenArray<T>> as_array(Tensor<T>& t) {
  return {t.data.data(), t.size()};
}
template <class T>
Eigen::Map<const EigenArray<T>> as_array(const Tensor<T>& t) {
  return {t.data.data(), t.size()};
}
template <class T>
void as_array(Tensor<T>&& t) = delete;
template <class T>
Eigen::Map<const EigenArray<T>> as_array(Var<T> v) {
  return {v.value(), v.shape().size()};
}
/// @}

/// Copies an Eigen matrix to a tensor [rows, columns], or a column to [rows].
template <class D>
Tensor<typename D::Scalar> from_eigen(const Eigen::DenseBase<D>& m) {
  using T = typename D::Scalar;
  Tensor<T> t(D::ColsAtCompileTime == 1 ? Shape{m.rows()} : Shape{m.rows(), m.cols()});
  Eigen::Map<EigenMatrix<T>>(t.data.data(), m.rows(), m.cols()) = m.derived().matrix();
  return t;
}

}  // namespace fieldmark
