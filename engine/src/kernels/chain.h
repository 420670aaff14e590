#pragma once
#include <fieldmark/engine/chain_steps.h>
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

using detail::ChainSteps;

// T is float or double. large: results bypass the caches, for arrays that do not fit there.
// y[i] = the chain of inputs[0][i], inputs[1][i] ...
FIELDMARK_DECLARE_KERNEL(template <class T> void, chain_forward,
                         (const ChainSteps& chain, const T* const* inputs, T* y, Index n, bool large))
// dinputs[k][i] = or (add[k]) += dy[i] times the slope in input k; null: not wanted.
FIELDMARK_DECLARE_KERNEL(template <class T> void, chain_backward,
                         (const ChainSteps& chain, const T* const* inputs, const T* dy, T* const* dinputs,
                          const bool* add, Index n, bool large))

}  // namespace fieldmark::kernels
