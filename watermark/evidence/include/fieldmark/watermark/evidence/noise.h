#pragma once
#include <fieldmark/watermark/evidence/evidence.h>

namespace fieldmark::watermark {

/// Bounds the probability that an independent key gives logits of at least this power, for any image: the
/// p-value that what was read is noise, whatever the message.
///   p = (t / n)^(n / 2) exp((n - t) / 2) for t > n, else 1,   t = sum_b L_b^2, n bits
/// Each bit has cells of its own, so its logit is an independent sum of fair signs whose weights have squares
/// that add up to 1, and E exp(x L^2) <= (1 - 2 x)^(-1/2): the bound of chi-squared with n degrees of
/// freedom. Source: Chernoff 1952.   @return at least the smallest normal double, never 0
double noise_p_value(const BitReading& reading);

/// Least noise_p_value() with this many cells that carry a bit, since t <= cells (Cauchy-Schwarz).
/// @throws ValueError unless carriers >= 0 and n_bits >= 1
double least_noise_p(Index carriers, Index n_bits);

}  // namespace fieldmark::watermark
