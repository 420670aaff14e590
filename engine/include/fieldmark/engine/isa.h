#pragma once

/// Kernels are compiled once for each of three x86-64 levels from one source, in namespaces isa_v2, isa_v3
/// (AVX2) and isa_v4 (AVX-512). FIELDMARK_DECLARE_KERNEL declares the three, FIELDMARK_KERNEL picks the one
/// for this CPU.
#define FIELDMARK_DECLARE_KERNEL(ret, name, args) \
  namespace isa_v2 {                              \
  ret name args;                                  \
  }                                               \
  namespace isa_v3 {                              \
  ret name args;                                  \
  }                                               \
  namespace isa_v4 {                              \
  ret name args;                                  \
  }
#define FIELDMARK_KERNEL(name)                                  \
  (::fieldmark::isa() == ::fieldmark::Isa::v4   ? &isa_v4::name \
   : ::fieldmark::isa() == ::fieldmark::Isa::v3 ? &isa_v3::name \
                                                : &isa_v2::name)

namespace fieldmark {

/// Levels of the x86-64 instruction set: v3 has AVX2, v4 AVX-512.
enum class Isa { v2 = 2, v3 = 3, v4 = 4 };

/// The level in use: the best this CPU has, or what the environment variable FIELDMARK_ISA (v2, v3 or v4)
/// names.
/// @throws ValueError (on the first call) if FIELDMARK_ISA is another word or a level this CPU does not have
Isa isa();
/// "v2", "v3" or "v4".
const char* isa_name();
/// The best level of this CPU, whatever FIELDMARK_ISA says.
Isa isa_supported();
/// Replaces the level for the rest of the process: for tests and benchmarks. @throws ValueError if the CPU
/// lacks it
void force_isa(Isa level);

/// What can multiply bf16 numbers: AVX-512's dot products (vdpbf16ps), or AMX's tiles.
enum class Bf16Units { none, dot, tiles };
/// The best that this CPU and its system offer; none where isa() is below v4. The first call asks the system
/// for the tiles' registers.
Bf16Units bf16_units();

}  // namespace fieldmark
