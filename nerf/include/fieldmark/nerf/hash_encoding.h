#pragma once
#include <fieldmark/engine/params.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace fieldmark::nerf {

/// Sizes of a HashEncoding.
struct HashEncodingOptions {
  int levels = 8;                  ///< L, 1 to 32
  int features = 2;                ///< F, features per level of each part, 2 or 4
  int log2_table = 18;             ///< at most T = 2^log2_table rows per level, 4 to 24
  int base_resolution = 16;        ///< N_min, cells per axis of the coarsest level, at least 1
  double finest_resolution = 768;  ///< N_max, cells per axis of the finest level, N_min to 2^16
};

/// Returns the row of a cell's corner within its level: eq. 4 of HashEncoding, or the direct index.
/// @param corner  each in [0, resolution]   @param mask  see HashEncoding::mask()
inline Index hash_row(const std::array<Index, 3>& corner, Index resolution, std::uint32_t mask) {
  if (mask == 0) return corner[0] + (resolution + 1) * (corner[1] + (resolution + 1) * corner[2]);
  const auto at = [&](std::size_t a) { return static_cast<std::uint32_t>(corner[a]); };
  return (at(0) ^ at(1) * 2654435761u ^ at(2) * 805459861u) & mask;
}

/// Multiresolution hash encoding whose rows hold F features for the density network and F for the colour
/// network: one look-up serves both, and colours can change while every parameter of the density keeps its
/// bytes.
///   N_l = floor(N_min b^l), b = (N_max / N_min)^(1 / (L - 1))                           eq. 2, 3
///   h(x) = (x_0 XOR x_1 p_1 XOR x_2 p_2) mod T, p_1 = 2654435761, p_2 = 805459861       eq. 4
/// Source: Mueller et al. 2022 (Instant Neural Graphics Primitives), sec. 3. A level whose (N_l + 1)^3
/// corners fit in T is indexed directly. Interpolation is trilinear, so the gradient in x is piecewise
/// constant along an axis and jumps at cell faces, which belong to the upper cell. Outside [0, 1] the
/// outermost cell is extrapolated; NaN falls in cell 0.
template <class T>
class HashEncoding {
 public:
  /// The features of the density network or those of the colour network.
  enum class Part { density, colour };
  /// Registers "<name>/table" [rows, 2 F], uniform in +-1e-4 (the paper's choice); a row holds the density
  /// features, then the colour features. @throws ValueError if an option is out of range
  HashEncoding(ParamStore<T>& store, std::string_view name, const HashEncodingOptions& options,
               std::uint64_t seed);

  /// Computes one part of the features as an op. The encoding must outlive the pass.
  /// @param x  [N, 3], each coordinate in [0, 1]   @return [N, F L]   @throws ShapeError if x is not [N, 3]
  /// Differentiable in: x and the table.
  Var<T> operator()(const Params<T>& params, Var<T> x, Part part) const;

  /// Computes both parts with one look-up, not recorded. @param x [n, 3]  @param density, colour [n, F L],
  /// written
  void encode(std::span<const T> table, const T* x, Index n, T* density, T* colour) const;
  /// Overload for a table rounded to bf16 (PackedWeights::table), half as large. float only.
  void encode(const std::uint16_t* table, const float* x, Index n, float* density,
              float* colour) const requires std::is_same_v<T, float>;
  /// The backward pass of encode(): adds the table's gradient to `grad` [rows, 2 F], given that of the
  /// features at x, ddensity and dcolour [n, F L] (null: zeros).
  /// @param scratch  [n, 2 F L], overwritten
  void backward(const T* x, Index n, const T* ddensity, const T* dcolour, std::span<T> grad,
                T* scratch) const;
  /// @{
  /// The two halves of backward(), for callers with several lists of points: deal_to_levels() sorts gradients
  /// by level into `out` [L, n, 2 F]; backward_level() adds those of one level, d [n, 2 F], to the table's in
  /// the order of the points. Levels own disjoint rows, so they may run on different threads.
  void deal_to_levels(Index n, const T* ddensity, const T* dcolour, T* out) const;
  void backward_level(int level, const T* x, Index n, const T* d, std::span<T> grad) const;
  /// @}

  /// Adds the gradient with respect to the positions to dx [n, 3]. @param ddensity, dcolour  as for
  /// backward()
  void backward_positions(std::span<const T> table, const T* x, Index n, const T* ddensity, const T* dcolour,
                          T* dx) const;

  Index width() const { return Index{features_} * levels(); }      ///< F L, features of a part
  int features() const { return features_; }                       ///< F, features per level of a part
  int levels() const { return static_cast<int>(levels_.size()); }  ///< L
  Index rows() const { return rows_; }                             ///< of the table, all levels
  ParamId table() const { return table_; }                         ///< in the store
  /// The first row of a level; rows() for the level after the last.
  Index first_row(int level) const {
    return level < levels() ? levels_[static_cast<std::size_t>(level)].first : rows_;
  }
  /// Cells per axis of a level.
  Index resolution(int level) const { return levels_[static_cast<std::size_t>(level)].resolution; }
  /// Rows of a hashed level minus one, all ones in binary; 0 for a level that is indexed directly.
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
