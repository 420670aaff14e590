#pragma once

namespace fieldmark {

/// Levels of the x86-64 instruction set: v3 has AVX2, v4 AVX-512.
enum class Isa { v2 = 2, v3 = 3, v4 = 4 };

/// Returns the level in use: the best of this CPU, or the value of the environment variable FIELDMARK_ISA
/// (v2, v3, v4).
/// @throws ValueError on the first call if FIELDMARK_ISA is another word or a level that this CPU lacks
Isa isa();
/// Returns the level in use as "v2", "v3" or "v4".
const char* isa_name();
/// Returns the best level of this CPU; ignores FIELDMARK_ISA.
Isa isa_supported();
/// Sets the level for the rest of the process, for tests and benchmarks.
/// @throws ValueError if the CPU lacks it
void force_isa(Isa level);

/// Calls force_isa() and restores the previous level at the end of the scope.
class ScopedIsa {
 public:
  /// @throws ValueError if the CPU lacks it
  explicit ScopedIsa(Isa level);
  ScopedIsa(const ScopedIsa&) = delete;
  ScopedIsa& operator=(const ScopedIsa&) = delete;
  ~ScopedIsa();

 private:
  Isa before_;
};

/// Instructions for bf16 products: AVX-512 dot products (vdpbf16ps) or AMX tiles.
enum class Bf16Units { none, dot, tiles };
/// Returns the best units of this CPU and system; none if isa() is below v4. The first call requests the tile
/// registers.
Bf16Units bf16_units();

}  // namespace fieldmark
