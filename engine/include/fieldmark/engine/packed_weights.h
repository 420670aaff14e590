#pragma once
#include <fieldmark/engine/params.h>

namespace fieldmark {

/// In what a pass reads parameters. bf16: rounded to 8 bits of mantissa, multiplied with inputs rounded as
/// well, and summed in float; the parameters themselves stay float.
enum class Precision { fp32, bf16 };

/// What PackedWeights packs, and how.
struct PackOptions {
  Precision precision = Precision::fp32;  ///< of the packed matrices
  bool tables = false;  ///< with bf16: also parameters of rank 2 whose name ends in "/table"
};

/// The matrices of a store's dense layers in the order in which products read them, as they are and
/// transposed: a training step packs each once, where its chunks would pack them anew in every op. Hand it to
/// Params, and to those only that read the values of the last update().
template <class T>
class PackedWeights {
 public:
  /// Finds the matrices: parameters of rank 2 whose name ends in "/weight". The store must outlive it and get
  /// no more parameters.
  /// @throws ValueError for bf16 where bf16_units() has none, or T is double
  explicit PackedWeights(const ParamStore<T>& store, const PackOptions& options = {});
  /// Packs the present values for the instruction set in use. To be called after every change of either.
  void update();
  /// Null for what is no such matrix.
  const PackedMatrix<T>* find(ParamId id) const {
    const PackedMatrix<T>& m = matrices_[static_cast<std::size_t>(id.index)];
    return m.forward ? &m : nullptr;
  }
  /// A table rounded to bf16, row-major; null for what is none, or where none was asked for.
  const std::uint16_t* table(ParamId id) const { return tables_[static_cast<std::size_t>(id.index)]; }

 private:
  void update_rounded();
  const ParamStore<T>* store_;
  PackOptions options_;
  std::vector<PackedMatrix<T>> matrices_;  // one a parameter
  std::vector<const std::uint16_t*> tables_;
  AlignedVector<T> panels_;
  AlignedVector<std::uint16_t> rounded_;
};

}  // namespace fieldmark
