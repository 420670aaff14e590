#pragma once
#include <fieldmark/engine/params.h>

#include <span>

namespace fieldmark {

/// Returns the Euclidean norm of all gradients, summed in double with the same bits for any thread count.
template <class T>
double grad_norm(std::span<const T> grads);

/// @{
/// Scales the gradients down to a norm of `limit` if theirs is larger: g *= limit / max(norm, limit).
/// @param limit  > 0   @return the norm before scaling
/// @throws ValueError if the limit is not positive, or a gradient is NaN or infinite, which scaling cannot
/// repair; the gradients are then unchanged, and the text names the first parameter that has one
template <class T>
double clip_grad_norm(std::span<T> grads, double limit);
template <class T>
double clip_grad_norm(ParamStore<T>& store, double limit);
/// @}

}  // namespace fieldmark
