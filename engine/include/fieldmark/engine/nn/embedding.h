#pragma once
#include <fieldmark/engine/params.h>

#include <cstdint>
#include <span>
#include <string_view>

namespace fieldmark {

/// Extents of an Embedding.
struct EmbeddingOptions {
  Index count = 0;  ///< number of rows, >= 1
  Index width = 0;  ///< elements per row, >= 1
};

/// A learnt vector for each of `count` items, such as letters, places or categories. The store holds the
/// parameter "<name>/table" [count, width], which starts with independent standard normal numbers.
template <class T>
class Embedding {
 public:
  /// @throws ValueError  if an extent is below 1, or the name is taken in the store
  Embedding(ParamStore<T>& store, std::string_view name, const EmbeddingOptions& options, std::uint64_t seed);

  /// Looks up rows by index, see gather_rows().
  /// @param index  [N] in [0, count)   @return  [N, width]   @throws ValueError  if an index is outside
  /// Differentiable in: the parameters.
  Var<T> operator()(Tape<T>& tape, const Params<T>& params, std::span<const std::int32_t> index) const;

 private:
  ParamId table_;
};

}  // namespace fieldmark
