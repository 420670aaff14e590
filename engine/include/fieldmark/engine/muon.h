#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/params.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// Settings of Muon.
struct MuonOptions {
  double lr = 1e-3;         ///< > 0; step size before a schedule's factor, of the same scale as Adam's
  double momentum = 0.95;   ///< in [0, 1), decay of the velocity
  bool zero_grads = false;  ///< also sets the gradients of the matrices to 0
};

/// Muon on the weight matrices of a store: steps whose singular values are all about 1, so that directions
/// with small gradients learn as fast as the others.
///   u = momentum u + g,   d = g + momentum u,   x -= 0.2 lr sqrt(max(m, n)) orthogonalised(d)
/// A tensor [..., n] counts as a matrix [m, n]. The factor 0.2 sqrt(max(m, n)) makes the root mean square of
/// a step about 0.2 lr, like one of Adam. A non-finite gradient spoils its whole matrix.
/// Source: Jordan et al. 2024 (Muon); the factor: Liu et al. 2025 (arXiv 2502.16982), section 2.2.
/// Deviation: nothing is added to |d|, so a step is as long for tiny gradients. While a gradient is 0, the
/// velocity goes on at full length.
template <class T>
class Muon {
 public:
  /// A matrix within the flat arrays.
  struct Matrix {
    Index begin = 0;    ///< its first element
    Index rows = 0;     ///< m
    Index columns = 0;  ///< n
    /// One past its last element.
    Index end() const { return begin + rows * columns; }
  };

  /// Optimises the trained parameters of a store whose names match one of the patterns, see name_matches().
  /// No parameters may be added to the store afterwards.
  /// @throws ValueError if an option is out of range or a pattern matches no trained parameter
  /// @throws ShapeError if a matching parameter has fewer than two axes
  Muon(const ParamStore<T>& store, const std::vector<std::string>& names, MuonOptions options = {});

  /// Takes one step over all matrices. Other entries and their gradients are unchanged.
  /// @param values, grads  [n], laid out like the store's   @param lr_factor  multiplies the options' lr
  /// @throws ShapeError unless both have n elements
  void step(std::span<T> values, std::span<T> grads, double lr_factor = 1);

  /// @{
  /// Returns u [n], for checkpoints; 0 outside the matrices.
  std::span<T> velocity() { return velocity_; }
  std::span<const T> velocity() const { return velocity_; }
  /// @}
  /// Returns the matrices, largest first.
  std::span<const Matrix> matrices() const { return matrices_; }
  /// Returns the options given to the constructor.
  const MuonOptions& options() const { return options_; }

 private:
  void update(const Matrix& matrix, Tape<T>& tape, T* values, T* grads, double lr_factor);
  MuonOptions options_;
  std::vector<Matrix> matrices_;
  std::vector<std::unique_ptr<Tape<T>>> tapes_;  // one per matrix; they keep their memory
  AlignedVector<T> velocity_, direction_;
};

/// Replaces a matrix d = U S V^T by an approximation of U V^T, by five steps of the odd polynomial
///   x <- a x + b (x x^T) x + c (x x^T)^2 x,   x = d / |d| at first,   (a, b, c) = (3.4445, -4.775, 2.0315),
/// where |d| is the root of the sum of squares. Singular values above 0.0015 |d| end in [0.67, 1.21], smaller
/// ones below.
/// The steps are taken on x^T x or x x^T, the smaller, as polynomials of it commute: in float, a result is
/// within 2e-5 of the exact steps'.
/// @param d  [rows, columns], overwritten; 0 if |d| is below the smallest normal number of T
/// @param tape  for intermediate values; reset
/// Source: Jordan et al. 2024 (Muon), a variant of the iteration of Newton and Schulz.
template <class T>
void orthogonalise(T* d, Index rows, Index columns, Tape<T>& tape);

}  // namespace fieldmark
