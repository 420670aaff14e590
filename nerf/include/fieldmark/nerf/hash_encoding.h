#pragma once
#include <fieldmark/engine/params.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace fieldmark::nerf {

/// Sizes of a HashEncoding.
struct HashEncodingOptions {
  int levels = 8;            ///< L, 1 to 32
  int features = 2;          ///< F of each part at a level, 2 or 4
  int log2_table = 18;       ///< at most T = 2^log2_table entries a level, 4 to 24
  int base_resolution = 16;  ///< N_min, cells per axis of the coarsest level, at least 1
  double finest_resolution =
      768;  ///< N_max, cells per axis of the finest level, at least N_min, at most 2^16
};

/// Row of a corner of a level's cells within the level: eq. 4 of HashEncoding, or directly.
/// @param corner  each in [0, resolution]   @param mask  see HashEncoding::mask()
inline Index hash_row(const std::array<Index, 3>& corner, Index resolution, std::uint32_t mask) {
  if (mask == 0) return corner[0] + (resolution + 1) * (corner[1] + (resolution + 1) * corner[2]);
  const auto at = [&](std::size_t a) { return static_cast<std::uint32_t>(corner[a]); };
  return (at(0) ^ at(1) * 2654435761u ^ at(2) * 805459861u) & mask;
}

/// Multiresolution hash encoding (Mueller et al. 2022, Instant Neural Graphics Primitives, sec. 3) whose
/// entries hold F features for the density network and F for the colour network: one look-up serves both, and
/// the colours of a trained field can be changed while every number that density depends on keeps its bytes.
///
///   N_l = floor(N_min b^l), b = (N_max / N_min)^(1 / (L - 1))          eq. 2, 3
///   h(x) = (x_0 XOR x_1 p_1 XOR x_2 p_2) mod T                         eq. 4, p_1 = 2654435761, p_2 =
///   805459861
///
/// The defaults suit what a minute of training on two cores can fill: more features or rows are slower to
/// look up and learn less in that time. A level whose (N_l + 1)^3 corners fit in T is indexed directly,
/// without hashing. Trilinear, so the gradient in x is piecewise constant along an axis and jumps on cell
/// faces, where the cell above is taken. Outside [0, 1] the outermost cell's form is continued; NaN is
/// treated as cell 0.
template <class T>
class HashEncoding {
 public:
  /// Whose features: those of the density network or of the colour network.
  enum class Part { density, colour };
  /// Registers "<name>/table" [rows, 2 F], uniform in +-1e-4 (the paper's choice); an entry holds density's
  /// features, then colour's. @throws ValueError if an option is out of range
  HashEncoding(ParamStore<T>& store, std::string_view name, const HashEncodingOptions& options,
               std::uint64_t seed);

  /// One part of the features as an op.
  /// @param x  [N, 3], each coordinate in [0, 1]   @return [N, F L]   @throws ShapeError if x is not [N, 3]
  /// Differentiable in: x and the table. The encoding must outlive the pass.
  Var<T> operator()(const Params<T>& params, Var<T> x, Part part) const;

  /// Both parts at the price of one look-up, not recorded. @param x [n, 3]  @param density, colour [n, F L]
  /// are written
  void encode(std::span<const T> table, const T* x, Index n, T* density, T* colour) const;
  /// The same from a table rounded to bf16 (PackedWeights::table), half as large. float only.
  void encode(const std::uint16_t* table, const float* x, Index n, float* density,
              float* colour) const requires std::is_same_v<T, float>;
  /// Adds to `grad` [rows, 2 F] what `encode` of x would pass back from ddensity, dcolour [n, F L] (null:
  /// zeros).
  /// @param scratch  [n, 2 F L], overwritten
  void backward(const T* x, Index n, const T* ddensity, const T* dcolour, std::span<T> grad,
                T* scratch) const;
  /// @{
  /// The two halves of backward(), for callers that keep several lists of points: gradients dealt to `out`
  /// [L, n, 2 F], and those of one level, out's [n, 2 F], added to the table's. Levels own disjoint rows, so
  /// they may run on different threads; points are added in order.
  void deal_to_levels(Index n, const T* ddensity, const T* dcolour, T* out) const;
  void backward_level(int level, const T* x, Index n, const T* d, std::span<T> grad) const;
  /// @}

  Index width() const { return Index{features_} * levels(); }  ///< F L, features of a part
  /// F, features of a part at a level.
  int features() const { return features_; }
  /// L, the number of levels.
  int levels() const { return static_cast<int>(levels_.size()); }
  /// Entries of all levels, the rows of the table.
  Index rows() const { return rows_; }
  /// First of the rows that a level owns; a level's end where the next begins, the last one's at rows().
  Index first_row(int level) const {
    return level < levels() ? levels_[static_cast<std::size_t>(level)].first : rows_;
  }
  /// The table in the store.
  ParamId table() const { return table_; }
  /// Cells per axis of a level.
  Index resolution(int level) const { return levels_[static_cast<std::size_t>(level)].resolution; }
  /// Rows of a hashed level less one, all ones in binary; 0 for a level that is indexed directly.
  std::uint32_t mask(int level) const { return levels_[static_cast<std::size_t>(level)].mask; }

 private:
  struct Level {
    std::uint32_t resolution, mask;  // layout of kernels::HashLevel
    std::int64_t first;
  };
  int features_;
  std::vector<Level> levels_;
  Index rows_ = 0;
  ParamId table_;
};

}  // namespace fieldmark::nerf
