#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/mark/cell_code.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "balanced_classes.h"

namespace fieldmark::watermark {
namespace {

// Sums the strengths of each cell over the views.
std::vector<std::int64_t> total_strength(const CellWeights& weights) {
  const std::size_t cells = weights.area.size();
  if (weights.strength.size() % cells != 0)
    throw ShapeError("[deal_cells] strength must have numbers for all of " + std::to_string(cells) +
                     " cells in each view, got " + std::to_string(weights.strength.size()));
  std::vector<std::int64_t> total(cells);
  for (std::size_t i = 0; i < weights.strength.size(); ++i) {
    check_number("deal_cells", "strength", weights.strength[i], weights.strength[i] >= 0, "at least 0");
    total[i % cells] += weights.strength[i];
  }
  return total;
}

}  // namespace

Index CellCode::carriers() const {
  return std::count_if(bit.begin(), bit.end(), [](std::int32_t b) { return b >= 0; });
}

CellDealer::CellDealer(const CellWeights& weights, Index n_bits)
    : cells_(weights.area.size()), n_bits_(static_cast<std::size_t>(n_bits)) {
  check_number("deal_cells", "n_bits", n_bits, n_bits >= 1, "at least 1");
  for (std::size_t c = 0; c < cells_; ++c) {
    if (!std::isfinite(weights.area[c]) || weights.area[c] < 0)
      throw ValueError("[deal_cells] area: cell " + std::to_string(c) + " must be finite and >= 0, got " +
                       number_text(weights.area[c]));
    if (weights.area[c] > 0) ranked_.push_back(c);
  }
  if (ranked_.size() < n_bits_)
    throw ValueError("[deal_cells] area: must have at least " + std::to_string(n_bits) +
                     " cells of positive area (one for each bit), got " + std::to_string(ranked_.size()));
  const auto rank = [&](const auto& worth) {
    std::stable_sort(ranked_.begin(), ranked_.end(),
                     [&](std::size_t a, std::size_t b) { return worth[a] > worth[b]; });
  };
  if (weights.strength.empty()) {
    rank(weights.area);
    for (std::size_t i = 0; i < ranked_.size(); ++i)
      classes_.push_back(static_cast<std::int32_t>(i % n_bits_));
    group_ = n_bits_;
  } else {
    rank(total_strength(weights));
    classes_ = balanced_classes(weights, ranked_, n_bits);
    group_ = ranked_.size();
  }
}

void CellDealer::deal(const Key& key, CellCode& code) const {
  // One word per bit of each group: in a short last group, the key also decides which bits get a cell.
  const std::size_t groups = (ranked_.size() + group_ - 1) / group_;
  std::vector<std::uint64_t> words(groups * n_bits_);
  keyed_words(key, "fieldmark cell order", words);
  code.bit.assign(cells_, -1);
  code.sign.resize(cells_);
  keyed_signs(key, "fieldmark cell sign", code.sign);

  std::vector<std::pair<std::uint64_t, std::int32_t>> bits(n_bits_);  // of the classes
  for (std::size_t i = 0; i < ranked_.size(); ++i) {
    if (i % group_ == 0) {
      for (std::size_t k = 0; k < n_bits_; ++k)
        bits[k] = {words[i / group_ * n_bits_ + k], static_cast<std::int32_t>(k)};
      std::sort(bits.begin(), bits.end());
    }
    code.bit[ranked_[i]] = bits[static_cast<std::size_t>(classes_[i])].second;
  }
  for (std::size_t c = 0; c < cells_; ++c) {
    if (code.bit[c] < 0) code.sign[c] = 0;
  }
}

CellCode deal_cells(const Key& key, const CellWeights& weights, Index n_bits) {
  CellCode code;
  CellDealer(weights, n_bits).deal(key, code);
  return code;
}

std::vector<std::int8_t> cell_signs(const CellCode& code, const Message& message) {
  std::vector<std::int8_t> signs(code.bit.size(), 0);
  for (std::size_t c = 0; c < signs.size(); ++c) {
    if (code.bit[c] < 0) continue;
    if (code.bit[c] >= message.size()) {
      throw ValueError("[cell_signs] code: the bit of cell " + std::to_string(c) + " must be below " +
                       std::to_string(message.size()) + " (the message's length), got " +
                       std::to_string(code.bit[c]));
    }
    const int bipolar = 2 * message.bits[static_cast<std::size_t>(code.bit[c])] - 1;
    signs[c] = static_cast<std::int8_t>(bipolar * code.sign[c]);
  }
  return signs;
}

}  // namespace fieldmark::watermark
