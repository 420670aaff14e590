#pragma once

namespace fieldmark {

/// Levels of the x86-64 instruction set: v3 has AVX2, v4 AVX-512.
enum class Isa { v2 = 2, v3 = 3, v4 = 4 };

/// The level in use: the best of this CPU, or the value of the environment variable FIELDMARK_ISA (v2, v3,
/// v4).
/// @throws ValueError on the first call if FIELDMARK_ISA is another word or a level that this CPU lacks
Isa isa();
/// "v2", "v3" or "v4".
const char* isa_name();
/// The best level of this CPU; ignores FIELDMARK_ISA.
Isa isa_supported();
/// Sets the level for the rest of the process: for tests and benchmarks. @throws ValueError if the CPU lacks
/// it
void force_isa(Isa level);

/// force_isa() until the end of the scope, also if an exception ends it.
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

/// Instructions that multiply bf16: AVX-512's dot products (vdpbf16ps), or AMX's tiles.
enum class Bf16Units { none, dot, tiles };
/// The best of this CPU and system; none where isa() is below v4. The first call requests the tile registers.
Bf16Units bf16_units();

}  // namespace fieldmark
