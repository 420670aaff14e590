#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/payload/message.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Evidence for the copy of one recipient, given the recipients found in earlier rounds.
struct TracedCopy {
  std::string name;        ///< of the recipient
  double statistic = 0;    ///< T_r of the recipient's code, see trace_copies()
  double p_value = 1;      ///< of this recipient alone, see sharp_p_value()
  double p_corrected = 1;  ///< corrected for all recipients tested and all rounds
  int round = 1;           ///< in which the recipient was found, or was tested last
};

/// Finds the recipients whose copies an image shows, in rounds: each round tests all who were not found yet
/// on what the found ones leave unexplained.
///   e_c = sign(S_c) sqrt|S_c|;   r = e - projection of e onto the signs s^(f) of the found recipients f
///   T_r = sum_c r_c s_c^(r) / sqrt(sum_c r_c^2),   p_r = sharp_p_value(T_r)
///   with p_(1) <= ... <= p_(R) in round k:   corrected p_(i) = max_{j <= i} min(1, 2^k (R - j + 1) p_(j))
/// A recipient is found at a corrected p of at most fpr; a round that finds nobody is the last. For every
/// a >= fpr, the probability that any innocent recipient has a corrected p of at most a is at most a,
/// whatever the image and however many recipients are guilty: until an innocent one is found, evidence and r
/// do not depend on the innocent codes, and round k spends a / 2^k. The square root weighs cells well where
/// copies were averaged and where they were pasted together. Source of the correction: Holm 1979.
/// @param evidence  [cells] S_c, sign evidence, summed over all images   @param weights  as for deal_cells()
/// @param key       the owner's, from which the keys of the copies derive
/// @param names     of the recipients, each once   @param fpr  in (0, 1]
/// @param progress  called from time to time with (done, total) of the round; returns false to stop, which
///                  throws Error
/// @return all recipients, smallest corrected p first; equal ones by round and T, then in the order of
/// `names`
/// @throws ValueError as deal_cells() and keyed_statistic(), or if a name is empty or fpr outside its range
std::vector<TracedCopy> trace_copies(std::span<const double> evidence, const CellWeights& weights,
                                     const Key& key, const Message& message,
                                     std::span<const std::string> names, double fpr,
                                     const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::watermark
