// A transformer with one block learns to continue a rhyme, letter by letter. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/values.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

using namespace fieldmark;

namespace {

const std::string kText =
    "one for the rook, one for the crow, one to rot and one to grow. "
    "red sky at night, shepherds delight. red sky in the morning, shepherds warning. ";
constexpr Index kContext = 24, kWidth = 32, kHeads = 4, kSteps = 800;

// Attention of every place to those before it: softmax(Q K^T / sqrt(w) + mask) V in each head.
Var<float> attend(const Params<float>& p, const Dense<float>& qkv, Var<float> x, Var<float> mask) {
  const Index n = x.shape()[0], w = kWidth / kHeads;
  const Var<float> rows = qkv(p, x);  // [n, 3 width]
  const auto head = [&](Index part) {
    const Var<float> all = permute(reshape(rows, {n, 3, kHeads, w}), {1, 2, 0, 3});  // [3, heads, n, w]
    return rows.tape().part(all, part * kHeads * n * w, {kHeads, n, w});
  };
  const Var<float> scores =
      batched_matmul(head(0), transpose(head(1))) / std::sqrt(static_cast<float>(w)) + mask;
  return reshape(permute(batched_matmul(softmax(scores), head(2)), {1, 0, 2}), {n, kWidth});
}

}  // namespace

int main() {
  std::string letters = kText;
  std::ranges::sort(letters);
  letters.erase(std::unique(letters.begin(), letters.end()), letters.end());
  const auto number = [&](char c) { return static_cast<std::int32_t>(letters.find(c)); };
  const Index count = std::ssize(letters);
  Tensor<float> mask({kContext, kContext});
  for (Index i = 0; i < mask.size(); ++i) mask[i] = i % kContext > i / kContext ? -1e9f : 0;

  ParamStore<float> store;
  const ParamId letter = store.add("letter", {count, kWidth}), place = store.add("place", {kContext, kWidth}),
                gamma = store.add("gamma", {kWidth}), beta = store.add("beta", {kWidth});
  const CounterRng rng(2, 0);
  for (const ParamId id : {letter, place})
    for (std::size_t i = 0; i < store.values(id).size(); ++i)
      store.values(id)[i] = 0.2f * (rng.uniform(i, static_cast<std::uint64_t>(id.index)) - 0.5f);
  std::ranges::fill(store.values(gamma), 1.f);
  const Dense<float> qkv(store, "qkv", {.in = kWidth, .out = 3 * kWidth}, 1),
      mix(store, "mix", {.in = kWidth, .out = kWidth}, 2),
      wide(store, "wide", {.in = kWidth, .out = 4 * kWidth}, 3),
      narrow(store, "narrow", {.in = 4 * kWidth, .out = kWidth}, 4),
      out(store, "out", {.in = kWidth, .out = count}, 5);
  const Params<float> p(store);
  const auto logits = [&](Tape<float>& tape, std::span<const std::int32_t> seen) {
    const Var<float> embedded = gather(p.leaf(tape, letter), 0, seen) + p.leaf(tape, place);
    const Var<float> x = embedded + mix(p, attend(p, qkv, embedded, tape.constant(mask)));
    const Var<float> h = layer_norm(x, p.leaf(tape, gamma), p.leaf(tape, beta));
    return out(p, x + narrow(p, gelu(wide(p, h))));
  };

  Adam<float> adam(store, {.lr = 1e-2, .beta2 = 0.99});
  Tape<float> tape;
  double loss = 0;
  for (Index step = 0; step < kSteps; ++step) {
    tape.reset();
    store.zero_grad();
    const auto begin = at(rng.below(std::ssize(kText) - kContext - 1, static_cast<std::uint64_t>(step)));
    std::vector<std::int32_t> seen, next;
    for (std::size_t i = begin; i < begin + at(kContext); ++i) {
      seen.push_back(number(kText[i]));
      next.push_back(number(kText[i + 1]));
    }
    const Var<float> error = softmax_cross_entropy(logits(tape, seen), next);
    tape.backward(error);
    adam.step(store.values(), store.grads(), warm_up(step, 20) * cosine_decay(step, kSteps, 0.05));
    loss =
        step == 0 ? static_cast<double>(item(error)) : 0.95 * loss + 0.05 * static_cast<double>(item(error));
    if (step % 200 == 0) std::printf("step %3d  loss %.3f\n", static_cast<int>(step), loss);
  }

  std::string said = kText.substr(0, at(kContext));
  while (said.size() < 64) {
    tape.reset();
    std::vector<std::int32_t> seen;
    for (const char c : said.substr(said.size() - at(kContext))) seen.push_back(number(c));
    const Tensor<float> says = to_tensor(logits(tape, seen));
    const auto last = says.data.end() - count;
    said += letters[static_cast<std::size_t>(std::max_element(last, says.data.end()) - last)];
  }
  std::printf("it says: %s\n", said.c_str());
  return loss < 0.6 ? 0 : 1;
}
