#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::watermark {

/// Scales a residual to a given RMS, so that invisibility is a budget instead of a loss weight.
///   y = x * target / rms,   rms^2 = sum_p m_p |x_p|^2 / (C sum_p m_p) + 1e-12
/// @param x  [P, C] residual of the pixels   @param mask  [P] weights m, >= 0 (1 on the object); must outlive
/// the pass
/// @param target  desired RMS, > 0: 10^(-dB / 20) for a mark PSNR in dB
/// @return [P, C], 0 where the mask is empty   @throws ShapeError if mask has another size
/// @throws ValueError if target is not positive
/// Differentiable in: x.
template <class T>
Var<T> power_budget(Var<T> x, std::span<const std::type_identity_t<T>> mask, double target);

}  // namespace fieldmark::watermark
