#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// How the field in question was made from copies.
enum class CopyMix {
  average,  ///< mean of their colours, as in averaged images
  pasted    ///< each cell from one of them, drawn at random
};

/// The copies of a field in question.
struct TracingCase {
  CopyMix mix = CopyMix::average;
  Index guilty = 1;  ///< recipients whose copies took part, at least 1
  /// Returns the name, such as "average of 2".
  std::string name() const;
};

/// Options of run_tracing_bench().
struct TracingBenchOptions {
  std::vector<TracingCase> cases = {{CopyMix::average, 1}, {CopyMix::average, 2}, {CopyMix::average, 4},
                                    {CopyMix::average, 8}, {CopyMix::pasted, 2},  {CopyMix::pasted, 3}};
  Index recipients = 100000;  ///< on the list, at least the guilty ones and one more
  Index repetitions = 20;     ///< of every case, each with its own key, message, names and views, at least 1
  Index views = 10;           ///< novel views, full size, 8 bits, whose evidence is added, at least 1
  bool informed = true;       ///< false: blind detection alone
  double fpr = 1e-6;          ///< corrected p-value at which a recipient counts as found, in (0, 1]
  std::uint64_t seed = 0;
};

/// What tracing finds in one case.
struct TracingRow {
  TracingCase copies;
  Index repetitions = 0;
  Index all_found = 0;        ///< repetitions in which every guilty recipient was found
  Index found = 0;            ///< guilty recipients found, over all repetitions
  double worst_guilty = 0;    ///< largest corrected p-value of a guilty recipient
  double least_innocent = 1;  ///< smallest corrected p-value of an innocent recipient
  Index innocents_named = 0;  ///< innocent recipients with a corrected p-value of at most fpr
};

/// Traces copies that are marked as trained (not baked) and mixed, among many recipients.
/// @param progress  called with the name of the case and the fraction done, before each view and while
/// tracing; may throw to stop
/// @throws ValueError if an option is out of range or the owner's mark has no cells
std::vector<TracingRow> run_tracing_bench(
    const watermark::Owner& owner, const TracingBenchOptions& options,
    const std::function<void(const std::string& what, double part)>& progress = {});

}  // namespace fieldmark::bench
