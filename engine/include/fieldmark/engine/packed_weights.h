#pragma once
#include <fieldmark/engine/params.h>

namespace fieldmark {

/// Precision of matrix products. bf16: parameters and inputs are rounded to 8 bits of mantissa and summed in
/// float; the parameters themselves stay float.
enum class Precision { fp32, bf16 };

/// Options of PackedWeights.
struct PackOptions {
  Precision precision = Precision::fp32;  ///< of the packed matrices
  bool tables = false;  ///< with bf16: also parameters of rank 2 whose name ends in "/table"
};

/// The matrices of a store's dense layers in the layout of matrix products, plain and transposed: a training
/// step packs each once instead of once a chunk. Pass it to Params that read the values of the last update()
/// only.
template <class T>
class PackedWeights {
 public:
  /// Packs parameters of rank 2 whose name ends in "/weight". The store must outlive it and stay of one
  /// layout.
  /// @throws ValueError for bf16 where bf16_units() has none, or T is double
  explicit PackedWeights(const ParamStore<T>& store, const PackOptions& options = {});
  /// Packs the current values for the instruction set in use. Call it after every change of either.
  void update();
  /// The packed matrix, or null.
  const PackedMatrix<T>* find(ParamId id) const {
    const PackedMatrix<T>& m = matrices_[static_cast<std::size_t>(id.index)];
    return m.forward ? &m : nullptr;
  }
  /// A table rounded to bf16, row-major, or null.
  const std::uint16_t* table(ParamId id) const { return tables_[static_cast<std::size_t>(id.index)]; }

 private:
  void update_rounded();
  const ParamStore<T>* store_;
  PackOptions options_;
  std::vector<PackedMatrix<T>> matrices_;  // one for each parameter
  std::vector<const std::uint16_t*> tables_;
  AlignedVector<T> panels_;
  AlignedVector<std::uint16_t> rounded_;
};

}  // namespace fieldmark
