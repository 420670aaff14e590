#include <cpuid.h>
#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>

namespace fieldmark {
namespace {

const char* name_of(Isa level) { return level == Isa::v4 ? "v4" : level == Isa::v3 ? "v3" : "v2"; }

Isa chosen_at_start() {
  const char* wish = std::getenv("FIELDMARK_ISA");
  if (!wish || !*wish) return isa_supported();
  for (Isa level : {Isa::v2, Isa::v3, Isa::v4})
    if (std::string(wish) == name_of(level)) {
      if (level > isa_supported())
        throw ValueError(std::string("[isa] FIELDMARK_ISA asks for ") + wish + ", this CPU has at most " +
                         name_of(isa_supported()));
      return level;
    }
  throw ValueError(std::string("[isa] FIELDMARK_ISA must be v2, v3 or v4, got '") + wish + "'");
}

std::atomic<int> current{0};  // 0: not chosen yet

}  // namespace

Isa isa_supported() {
  // The features that x86-64-v3 and -v4 add (x86-64 psABI, table 3.1) and that compilers use.
  static const Isa best = [] {
    __builtin_cpu_init();
    const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vl");
    return v4 ? Isa::v4 : v3 ? Isa::v3 : Isa::v2;
  }();
  return best;
}

Isa isa() {
  int level = current.load(std::memory_order_relaxed);
  if (level == 0) current = level = static_cast<int>(chosen_at_start());
  return static_cast<Isa>(level);
}

const char* isa_name() { return name_of(isa()); }

void force_isa(Isa level) {
  if (level > isa_supported())
    throw ValueError(std::string("[isa] this CPU has at most ") + name_of(isa_supported()) + ", asked for " +
                     name_of(level));
  current = static_cast<int>(level);
}

ScopedIsa::ScopedIsa(Isa level) : before_(isa()) { force_isa(level); }
ScopedIsa::~ScopedIsa() { current = static_cast<int>(before_); }

Bf16Units bf16_units() {
  static const Bf16Units best = [] {
    unsigned a = 0, b = 0, c = 0, d = 0;
    // Intel's manual, volume 2A, CPUID: leaf 7.1 EAX bit 5 is AVX512_BF16, leaf 7.0 EDX bits 22 and 24 AMX's.
    const bool dot = isa_supported() == Isa::v4 && __get_cpuid_count(7, 1, &a, &b, &c, &d) && (a >> 5 & 1);
    const bool tiles = dot && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (d >> 22 & 1) && (d >> 24 & 1);
    // Linux saves the tile registers only on request (5.16: ARCH_REQ_XCOMP_PERM, 18).
    if (tiles && syscall(SYS_arch_prctl, 0x1023, 18) == 0) return Bf16Units::tiles;
    return dot ? Bf16Units::dot : Bf16Units::none;
  }();
  return isa() == Isa::v4 ? best : Bf16Units::none;
}

}  // namespace fieldmark
