#pragma once
// Batches of small matrices in double, computed by Eigen. Private.
#include <fieldmark/engine/shape_checks.h>

#include <Eigen/Dense>
#include <algorithm>
#include <string>
#include <utility>

#include "ops/axes.h"

// Some decompositions call functions of Eigen::internal, which other versions may change.
static_assert(EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4, "fieldmark's matrix ops need Eigen 3.4");

namespace fieldmark::detail {

// Matrices and columns in memory of a Workspace: Eigen's own would be allocated for each matrix of a batch.
// Eigen still allocates the blocks of its products beyond 128 kB, for matrices of more than 128 rows.
using Matrix = Eigen::Map<Eigen::MatrixXd, Eigen::AlignedMax>;
using Column = Eigen::Map<Eigen::VectorXd, Eigen::AlignedMax>;
template <class T>
using RowMajor = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Gives out memory for the matrices that an op computes with. A copy gives out the same memory again.
class Workspace {
 public:
  explicit Workspace(double* memory) : next_(memory) {}
  // Returns the elements that a matrix takes: whole cache lines, so that each is aligned.
  static constexpr Index size(Index rows, Index columns = 1) { return (rows * columns + 7) / 8 * 8; }

  Matrix matrix(Index rows, Index columns) { return {take(size(rows, columns)), rows, columns}; }
  Column column(Index n) { return {take(size(n)), n}; }
  int* integers(Index n) { return new (take(size(n))) int[at(n)]; }
  template <class T>
  Matrix read(const T* p, Index rows, Index columns) {
    Matrix m = matrix(rows, columns);
    m = Eigen::Map<const RowMajor<T>>(p, rows, columns).template cast<double>();
    return m;
  }
  template <class T>
  Matrix read_transposed(const T* p, Index rows, Index columns) {
    Matrix m = matrix(columns, rows);
    m = Eigen::Map<const RowMajor<T>>(p, rows, columns).transpose().template cast<double>();
    return m;
  }

 private:
  double* take(Index elements) { return std::exchange(next_, next_ + elements); }
  double* next_;
};

// to = or += m, for m without a product: Eigen would allocate its result.
template <class T, class M>
void put_matrix(T* to, const M& m, bool assign) {
  Eigen::Map<RowMajor<T>> out(to, m.rows(), m.cols());
  if (assign)
    out = m.template cast<T>();
  else
    out += m.template cast<T>();
}

// Sets the elements below or above the diagonal to 0.
inline void keep_triangle(Matrix& m, bool upper) {
  if (upper)
    m.triangularView<Eigen::StrictlyLower>().setZero();
  else
    m.triangularView<Eigen::StrictlyUpper>().setZero();
}

// Extents of [.., n, n].
struct Batch {
  Index count, n;
  Index size() const { return n * n; }
};

inline Batch square_batch(const char* op, const Shape& s) {
  if (s.rank() < 2 || s[-1] != s[-2])
    throw ShapeError(std::string("[") + op + "] a must be square matrices [.., n, n], got shape " + s.str());
  Batch batch{1, s[-1]};
  for (int k = 0; k + 2 < s.rank(); ++k) batch.count *= s[k];
  return batch;
}

// Returns the shape without its last `axes` axes.
inline Shape without_last(const Shape& s, int axes) {
  std::array<Index, Shape::kMaxRank> extents{};
  for (int k = 0; k + axes < s.rank(); ++k) extents[at(k)] = s[k];
  return Shape(std::span(extents).first(at(s.rank() - axes)));
}

// Calls f(which, workspace) for the matrices of a batch, in parallel; each call owns the data of its matrix
// and `need` elements of workspace, which the matrices of a chunk use in turn. There are at most 64 chunks.
template <class T, class F>
void for_matrices(Tape<T>& tape, Batch b, Index need, F f) {
  constexpr Index kChunks = 64;
  const Index grain =
      std::max({Index{1}, kGrain / std::max<Index>(1, b.n * b.n * b.n), (b.count + kChunks - 1) / kChunks});
  auto* memory = tape.template scratch<double>((b.count + grain - 1) / grain * need);
  parallel_for(b.count, grain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) f(i, Workspace(memory + begin / grain * need));
  });
}

[[noreturn]] inline void refuse_matrix(const char* op, Index which, const std::string& why) {
  throw ValueError(std::string("[") + op + "] a: matrix " + std::to_string(which) + " " + why);
}

inline void check_finite(const char* op, Index which, const Matrix& m) {
  if (!m.allFinite()) refuse_matrix(op, which, "must be finite, got a NaN or an infinity");
}

}  // namespace fieldmark::detail
