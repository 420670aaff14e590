#pragma once
// Short embeddings of tiny owners, and what they leave behind.
#include <fieldmark/watermark/embedding/embedder.h>

#include <vector>

namespace fieldmark::watermark {

inline EmbedOptions few_steps(Index steps) {
  return {.schedule = {.steps = steps, .lr = 4e-3}, .batch = 3, .seed = 4};
}

// Everything that some steps leave behind.
struct Outcome {
  std::vector<float> values;
  std::vector<double> figures;
  friend bool operator==(const Outcome&, const Outcome&) = default;
};
inline Outcome outcome(const Owner& owner, const Embedder& e) {
  const auto& f = e.figures();
  return {{owner.params.values().begin(), owner.params.values().end()}, {f.sign, f.index, f.bits, f.loss}};
}

}  // namespace fieldmark::watermark
