#pragma once
#include <fieldmark/watermark/evidence/evidence.h>

namespace fieldmark::watermark {

/// Bounds the probability that an independent key gives logits of at least this power, for any image: the
/// p-value of the reading being noise, whatever the message.
///   p = (t / n)^(n / 2) exp((n - t) / 2) for t > n, else 1,   t = sum_b L_b^2, n bits
/// Each bit has cells of its own, so its logit is an independent weighted sum of fair signs whose squared
/// weights add up to 1, and E exp(x L^2) <= (1 - 2 x)^(-1/2): the bound for chi-squared with n degrees of
/// freedom. Source: Chernoff 1952.   @return at least the smallest normal double, never 0
double noise_p_value(const BitReading& reading);

/// Returns the least noise_p_value() within reach of this many bit-carrying cells, since t <= cells
/// (Cauchy-Schwarz).
/// @throws ValueError unless carriers >= 0 and n_bits >= 1
double least_noise_p(Index carriers, Index n_bits);

}  // namespace fieldmark::watermark
