#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/payload/message.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Evidence for the copy of one recipient.
struct TracedCopy {
  std::string name;        ///< of the recipient
  double statistic = 0;    ///< T of the recipient's code, see keyed_statistic()
  double p_value = 1;      ///< of this recipient alone, see keyed_p_value()
  double p_corrected = 1;  ///< corrected for all recipients tested
};

/// Tests the evidence for the copy of each recipient.
///   p_r = exp(-T_r^2 / 2) under the code of copy_key(key, r);   with p_(1) <= ... <= p_(R):
///   corrected p_(i) = max_{j <= i} min(1, (R - j + 1) p_(j))
/// The probability of naming any innocent recipient at a corrected p of a is at most a, whatever the image
/// and however many recipients are guilty. If k copies were averaged and N cells are in view, each of the k
/// recipients has T = sqrt(N / k) before noise, and each is named. Source: Holm 1979; Hoeffding 1963,
/// theorem 2.
/// @param evidence  [cells] sign evidence, summed over all images   @param area  [cells] as for deal_cells()
/// @param key       the owner's, from which the keys of the copies derive
/// @param names     of the recipients, each once
/// @param progress  called from time to time with (done, total); returns false to stop, which throws Error
/// @return all recipients, smallest p first; equal ones in the order of `names`
/// @throws ValueError as deal_cells() and keyed_statistic(), or if a name is empty
std::vector<TracedCopy> trace_copies(std::span<const double> evidence, std::span<const double> area,
                                     const Key& key, const Message& message,
                                     std::span<const std::string> names,
                                     const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::watermark
