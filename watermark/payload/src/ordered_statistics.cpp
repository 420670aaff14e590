#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/ordered_statistics.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace fieldmark::watermark {
namespace {

using Word = std::array<std::uint64_t, 4>;
constexpr std::size_t kMostBits = 256;

bool bit(const Word& word, std::size_t i) { return (word[i / 64] >> (i % 64)) & 1; }
void flip(Word& word, std::size_t i) { word[i / 64] ^= std::uint64_t{1} << (i % 64); }
void add(Word& word, const Word& other) {
  for (std::size_t i = 0; i < word.size(); ++i) word[i] ^= other[i];
}

// Sums |logit| over the set bits of a word, eight positions per look-up.
class Disagreement {
 public:
  explicit Disagreement(std::span<const double> logits) : bytes_((logits.size() + 7) / 8) {
    for (std::size_t b = 0; b < bytes_; ++b)
      for (std::size_t pattern = 1; pattern < 256; ++pattern) {
        const std::size_t lowest = static_cast<std::size_t>(__builtin_ctzll(pattern)), i = 8 * b + lowest;
        sums_[b][pattern] =
            sums_[b][pattern & (pattern - 1)] + (i < logits.size() ? std::abs(logits[i]) : 0.0);
      }
  }
  double operator()(const Word& word) const {
    double sum = 0;
    for (std::size_t b = 0; b < bytes_; ++b) sum += sums_[b][(word[b / 8] >> (8 * (b % 8))) & 255];
    return sum;
  }

 private:
  std::size_t bytes_;
  std::array<std::array<double, 256>, kMostBits / 8> sums_{};
};

// Finds the least disagreement over all sums of a word and up to `order` rows.
struct Search {
  const std::vector<Word>& rows;
  const Disagreement& disagreement;
  Word best;
  double least;

  void run(const Word& word, std::size_t first, int order) {
    for (std::size_t i = first; i < rows.size(); ++i) {
      Word next = word;
      add(next, rows[i]);
      if (const double d = disagreement(next); d < least) {
        least = d;
        best = next;
      }
      if (order > 1) run(next, i + 1, order - 1);
    }
  }
};

}  // namespace

OrderedStatistics::OrderedStatistics(const std::vector<std::vector<std::uint8_t>>& generator)
    : length_(generator.empty() ? 0 : generator.front().size()) {
  if (length_ == 0 || length_ > kMostBits)
    throw ValueError("[OrderedStatistics] generator: words must have 1 to 256 bits, got " +
                     std::to_string(length_));
  for (const auto& bits : generator) {
    if (bits.size() != length_)
      throw ValueError("[OrderedStatistics] generator: words must have one length, got " +
                       std::to_string(length_) + " and " + std::to_string(bits.size()));
    Word word{};
    for (std::size_t i = 0; i < length_; ++i)
      if (bits[i] != 0) flip(word, i);
    generator_.push_back(word);
  }
  std::vector<std::size_t> pivots;
  reduced(std::vector<double>(length_, 0.0), pivots);
  if (pivots.size() != generator_.size())
    throw ValueError("[OrderedStatistics] generator: the " + std::to_string(generator_.size()) +
                     " words must be linearly independent, got " + std::to_string(pivots.size()) +
                     " that are");
}

// Returns rows that span the same code, each with the only bit at its pivot; the pivots are the most reliable
// independent positions.
std::vector<Word> OrderedStatistics::reduced(std::span<const double> logits,
                                             std::vector<std::size_t>& pivots) const {
  std::vector<std::size_t> order(length_);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return std::abs(logits[a]) > std::abs(logits[b]); });
  std::vector<Word> rows = generator_;
  for (std::size_t column : order) {
    const std::size_t rank = pivots.size();
    if (rank == rows.size()) break;
    const auto row = std::find_if(rows.begin() + static_cast<std::ptrdiff_t>(rank), rows.end(),
                                  [&](const Word& w) { return bit(w, column); });
    if (row == rows.end()) continue;
    std::swap(*row, rows[rank]);
    for (std::size_t r = 0; r < rows.size(); ++r)
      if (r != rank && bit(rows[r], column)) add(rows[r], rows[rank]);
    pivots.push_back(column);
  }
  return rows;
}

std::vector<std::uint8_t> OrderedStatistics::nearest(std::span<const double> logits, int order) const {
  if (logits.size() != length_)
    throw ValueError("[OrderedStatistics::nearest] logits: must be " + std::to_string(length_) + ", got " +
                     std::to_string(logits.size()));
  if (!std::all_of(logits.begin(), logits.end(), [](double x) { return std::isfinite(x); }))
    throw ValueError("[OrderedStatistics::nearest] logits must be finite");
  if (order < 0 || order > 3)
    throw ValueError("[OrderedStatistics::nearest] order must be 0 to 3, got " + std::to_string(order));
  std::vector<std::size_t> pivots;
  const std::vector<Word> rows = reduced(logits, pivots);
  // From here on, words are differences from the hard decisions.
  Word seen{};
  for (std::size_t i = 0; i < length_; ++i)
    if (logits[i] > 0) flip(seen, i);
  Word difference = seen;
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (bit(seen, pivots[r])) add(difference, rows[r]);
  const Disagreement disagreement(logits);
  Search search{rows, disagreement, difference, disagreement(difference)};
  if (order > 0) search.run(difference, 0, order);
  std::vector<std::uint8_t> word(length_);
  for (std::size_t i = 0; i < length_; ++i) word[i] = bit(search.best, i) != bit(seen, i);
  return word;
}

}  // namespace fieldmark::watermark
