#pragma once
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/params.h>

#include <array>
#include <cstdint>
#include <vector>

namespace fieldmark {

/// Precision of matrix products. bf16: parameters and inputs are rounded to 8 bits of mantissa and summed in
/// float; the parameters themselves stay float.
enum class Precision { fp32, bf16 };

/// A matrix W [in, out] packed for matrix products: panels of columns of W and of W^T, optionally in bf16
/// too.
template <class T>
struct PackedMatrix {
  const T* forward = nullptr;                      ///< panels of W
  const T* transposed = nullptr;                   ///< panels of W^T
  const std::uint16_t* forward_bf16 = nullptr;     ///< W rounded; or null
  const std::uint16_t* transposed_bf16 = nullptr;  ///< W^T rounded; or null
};

/// Options of PackedWeights.
struct PackOptions {
  Precision precision = Precision::fp32;  ///< precision of the packed matrices
  bool tables = false;                    ///< with bf16: also rounds parameters of ParamRole::table
};

/// Packs the matrices of a store's dense layers for matrix products, plain and transposed, so that a training
/// step packs each once instead of once per chunk. Pass it only to Params that read the values of the last
/// update(). To detect stale values, it keeps eight elements of each matrix: an optimiser step changes some
/// of them, but a manual change of a few elements may go unnoticed.
template <class T>
class PackedWeights {
 public:
  /// Packs parameters of ParamRole::matrix. The store must outlive it and keep its layout.
  /// @throws ValueError for bf16 if bf16_units() is none or T is double
  explicit PackedWeights(const ParamStore<T>& store, const PackOptions& options = {});
  /// Packs the current values for the instruction set in use. Call it after every change of either.
  /// @throws ValueError if parameters were added to the store since construction
  void update();
  /// True if these are the weights of this store.
  bool packs(const ParamStore<T>& store) const { return store_ == &store; }
  /// @{
  /// Returns the packed matrix, or the table rounded to bf16, row-major; null before the first update() or if
  /// the parameter is not one.
  /// @throws ValueError if the store's values or the instruction set changed since the last update(), or the
  /// parameter was added after construction
  const PackedMatrix<T>* find(ParamId id) const;
  const std::uint16_t* table(ParamId id) const;
  /// @}

 private:
  static constexpr std::size_t kWitnesses = 8;
  using Witnesses = std::array<T, kWitnesses>;
  void update_rounded();
  std::size_t place(ParamId id) const;
  Witnesses witnesses(std::size_t i) const;
  void check_current(std::size_t i) const;
  const ParamStore<T>* store_;
  PackOptions options_;
  std::vector<PackedMatrix<T>> matrices_;  // one for each parameter
  std::vector<const std::uint16_t*> tables_;
  std::vector<Witnesses> witnesses_;  // elements of each matrix and table at the last update()
  Isa isa_ = Isa::v2;                 // of the last update()
  AlignedVector<T> panels_;
  AlignedVector<std::uint16_t> rounded_;
};

}  // namespace fieldmark
