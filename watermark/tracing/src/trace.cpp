#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <algorithm>

namespace fieldmark::watermark {
namespace {

constexpr Index kNamesPerChunk = 32, kNamesPerRound = 64 * kNamesPerChunk;

// Applies Holm's step-down correction to copies sorted by p-value.
void correct(std::vector<TracedCopy>& sorted) {
  double least = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    least = std::max(least, std::min(1.0, static_cast<double>(sorted.size() - i) * sorted[i].p_value));
    sorted[i].p_corrected = least;
  }
}

}  // namespace

std::vector<TracedCopy> trace_copies(std::span<const double> evidence, std::span<const double> area,
                                     const Key& key, const Message& message,
                                     std::span<const std::string> names,
                                     const std::function<bool(Index done, Index total)>& progress) {
  const CellDealer dealer(area, message.size());
  std::vector<TracedCopy> copies(names.size());
  const Index all = std::ssize(copies);
  for (Index first = 0; first < all; first += kNamesPerRound) {
    const Index round = std::min(all - first, kNamesPerRound);
    parallel_for(round, kNamesPerChunk, [&](Index begin, Index end) {
      CellCode code;
      for (Index i = first + begin; i < first + end; ++i) {
        dealer.deal(copy_key(key, names[at(i)]), code);
        const double t = keyed_statistic(evidence, code, message);
        copies[at(i)] = {.name = names[at(i)], .statistic = t, .p_value = keyed_p_value(t)};
      }
    });
    if (progress && !progress(first + round, all)) throw Error("[trace_copies] stopped");
  }
  // Sorts by T, which distinguishes copies whose p-values are both the smallest number.
  std::stable_sort(copies.begin(), copies.end(),
                   [](const TracedCopy& a, const TracedCopy& b) { return a.statistic > b.statistic; });
  correct(copies);
  return copies;
}

}  // namespace fieldmark::watermark
