#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fieldmark::watermark {
namespace {

constexpr Index kNamesPerChunk = 32, kNamesPerBatch = 64 * kNamesPerChunk;
constexpr double kExplained = 1e-12;  // share of the power below which a remainder is rounding error

std::vector<double> square_roots(std::span<const double> evidence) {
  std::vector<double> roots;
  for (const double s : evidence) roots.push_back(std::copysign(std::sqrt(std::abs(s)), s));
  return roots;
}

double dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// Subtracts the projections onto the vectors of an orthonormal basis. Leaves 0 where only rounding errors
// remain.
void subtract_projections(const std::vector<std::vector<double>>& basis, std::vector<double>& v) {
  const double before = dot(v, v);
  for (const std::vector<double>& unit : basis) {
    const double share = dot(unit, v);
    for (std::size_t c = 0; c < v.size(); ++c) v[c] -= share * unit[c];
  }
  if (dot(v, v) <= kExplained * before) v.assign(v.size(), 0);
}

// Adds the part of the signs that the basis does not span.
void extend(std::vector<std::vector<double>>& basis, std::span<const std::int8_t> signs) {
  std::vector<double> v(signs.begin(), signs.end());
  subtract_projections(basis, v);
  const double length = std::sqrt(dot(v, v));
  if (length == 0) return;
  for (double& x : v) x /= length;
  basis.push_back(std::move(v));
}

// Applies Holm's step-down correction times a factor to copies sorted by p-value.
void correct(std::span<TracedCopy> sorted, double factor) {
  double least = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    least =
        std::max(least, std::min(1.0, factor * static_cast<double>(sorted.size() - i) * sorted[i].p_value));
    sorted[i].p_corrected = least;
  }
}

class Tracer {
 public:
  Tracer(const CellWeights& weights, const Key& key, const Message& message,
         const std::function<bool(Index, Index)>& progress)
      : dealer_(weights, message.size()), key_(key), message_(message), progress_(progress) {}

  // Tests the recipients on the evidence, sorts them by p-value and corrects it.
  void test(std::span<const double> evidence, int round, std::span<TracedCopy> copies) const {
    const Index all = std::ssize(copies);
    for (Index first = 0; first < all; first += kNamesPerBatch) {
      const Index batch = std::min(all - first, kNamesPerBatch);
      parallel_for(batch, kNamesPerChunk, [&](Index begin, Index end) {
        CellCode code;
        for (Index i = first + begin; i < first + end; ++i) {
          TracedCopy& copy = copies[at(i)];
          dealer_.deal(copy_key(key_, copy.name), code);
          copy.statistic = keyed_statistic(evidence, code, message_);
          copy.p_value = sharp_p_value(copy.statistic);
          copy.round = round;
        }
      });
      if (progress_ && !progress_(first + batch, all)) throw Error("[trace_copies] stopped");
    }
    // Sorts by T, which distinguishes copies whose p-values are both the smallest number.
    std::stable_sort(copies.begin(), copies.end(),
                     [](const TracedCopy& a, const TracedCopy& b) { return a.statistic > b.statistic; });
    correct(copies, std::ldexp(1, round));
  }

  std::vector<std::int8_t> signs(const std::string& name) const {
    CellCode code;
    dealer_.deal(copy_key(key_, name), code);
    return cell_signs(code, message_);
  }

 private:
  CellDealer dealer_;
  const Key& key_;
  const Message& message_;
  const std::function<bool(Index, Index)>& progress_;
};

}  // namespace

std::vector<TracedCopy> trace_copies(std::span<const double> evidence, const CellWeights& weights,
                                     const Key& key, const Message& message,
                                     std::span<const std::string> names, double fpr,
                                     const std::function<bool(Index done, Index total)>& progress) {
  if (!(fpr > 0 && fpr <= 1))
    throw ValueError("[trace_copies] fpr must be in (0, 1], got " + number_text(fpr));
  const Tracer tracer(weights, key, message, progress);
  std::vector<TracedCopy> copies(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) copies[i].name = names[i];
  std::vector<std::vector<double>> explained;
  std::vector<double> left = square_roots(evidence);
  std::span<TracedCopy> untold = copies;
  for (int round = 1; !untold.empty(); ++round) {
    tracer.test(left, round, untold);
    const auto found = std::find_if(untold.begin(), untold.end(),
                                    [&](const TracedCopy& copy) { return copy.p_corrected > fpr; }) -
                       untold.begin();
    if (found == 0) break;
    for (const TracedCopy& copy : untold.first(static_cast<std::size_t>(found)))
      extend(explained, tracer.signs(copy.name));
    subtract_projections(explained, left);
    untold = untold.subspan(static_cast<std::size_t>(found));
  }
  // A later round may find a copy more surely than an earlier one.
  std::stable_sort(copies.begin(), copies.end(),
                   [](const TracedCopy& a, const TracedCopy& b) { return a.p_corrected < b.p_corrected; });
  return copies;
}

}  // namespace fieldmark::watermark
