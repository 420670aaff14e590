#pragma once
#include <fieldmark/engine/isa.h>

#include <cstdint>

/// Kernels are compiled once for each of three x86-64 levels from one source, in namespaces isa_v2, isa_v3
/// (AVX2) and isa_v4 (AVX-512). FIELDMARK_DECLARE_KERNEL declares the three; FIELDMARK_KERNEL picks the one
/// for isa().
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

/// As in shape.h. Kernels do not include that header: two levels must never share an inline function.
using Index = std::int64_t;

}  // namespace fieldmark
