#include <fieldmark/engine/error.h>
#include <fieldmark/engine/isa.h>

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

}  // namespace fieldmark
