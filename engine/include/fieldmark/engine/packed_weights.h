#pragma once
#include <fieldmark/engine/params.h>

namespace fieldmark {

/// The matrices of a store's dense layers in the order in which products read them, as they are and
/// transposed: a training step packs each once, where its chunks would pack them anew in every op. Hand it to
/// Params, and to those only that read the values of the last update().
template <class T>
class PackedWeights {
 public:
  /// Finds the matrices: parameters of rank 2 whose name ends in "/weight". The store must outlive it and get
  /// no more parameters.
  explicit PackedWeights(const ParamStore<T>& store);
  /// Packs the present values for the instruction set in use. To be called after every change of either.
  void update();
  /// Null for what is no such matrix.
  const PackedMatrix<T>* find(ParamId id) const {
    const PackedMatrix<T>& m = matrices_[static_cast<std::size_t>(id.index)];
    return m.forward ? &m : nullptr;
  }

 private:
  const ParamStore<T>* store_;
  std::vector<PackedMatrix<T>> matrices_;  // one a parameter
  AlignedVector<T> panels_;
};

}  // namespace fieldmark
