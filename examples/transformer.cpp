// A transformer with one block learns to continue a rhyme, letter by letter. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/nn.h>
#include <fieldmark/engine/ops.h>
#include <fieldmark/engine/values.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

using namespace fieldmark;

const std::string kText = "one for the rook, one for the crow, one to rot and one to grow. one for the rook";
constexpr Index kSeen = 24, kWidth = 32, kHeads = 4, kHead = kWidth / kHeads, kSteps = 1000, kLetters = 128;

struct Transformer {
  ParamStore<float> store;
  Embedding<float> letter{store, "letter", {kLetters, kWidth}, 1};
  ParamId place = store.add("place", {kSeen, kWidth});
  Dense<float> qkv{store, "qkv", {kWidth, 3 * kWidth}, 3}, wide{store, "wide", {kWidth, 4 * kWidth}, 4},
      narrow{store, "narrow", {4 * kWidth, kWidth}, 5}, out{store, "out", {kWidth, kLetters}, 6};
  LayerNorm<float> norm{store, "norm", kWidth};
  Params<float> p{store};              // must follow the last layer
  Tensor<float> mask{{kSeen, kSeen}};  // constants must live as long as a pass

  Transformer() {
    for (Index i = 0; i < mask.size(); ++i) mask[i] = i % kSeen > i / kSeen ? -1e9f : 0;
  }

  // Attention of every position to itself and earlier ones: softmax(Q K^T / sqrt(w) + mask) V in each head.
  Var<float> attend(Var<float> x) const {
    const auto heads = [rows = qkv(p, x)](Index part) {
      return permute(reshape(slice(rows, part * kWidth, kWidth), {kSeen, kHeads, kHead}), {1, 0, 2});
    };
    const auto scores =
        batched_matmul(heads(0), transpose(heads(1))) / std::sqrt(float{kHead}) + x.tape().constant(mask);
    return reshape(permute(batched_matmul(softmax(scores), heads(2)), {1, 0, 2}), {kSeen, kWidth});
  }
  // Returns the logits [24, 128] of the letter after each of 24.
  Var<float> operator()(Tape<float>& tape, const std::vector<std::int32_t>& seen) const {
    const auto x = letter(tape, p, seen) + p.leaf(tape, place);
    const auto y = x + attend(x);
    return out(p, y + narrow(p, gelu(wide(p, norm(p, y)))));
  }
};

int main() {
  Transformer model;
  Adam<float> adam(model.store, {.lr = 1e-2, .beta2 = 0.99, .zero_grads = true});
  Tape<float> tape;
  for (Index step = 0; step < kSteps; ++step, tape.reset()) {
    const auto from = kText.begin() + CounterRng(2, 0).below(std::ssize(kText) - kSeen, at(step));
    const std::vector<std::int32_t> next(from + 1, from + kSeen + 1);
    const auto loss = softmax_cross_entropy(model(tape, {from, from + kSeen}), next);
    tape.backward(loss);
    adam.step(model.store.values(), model.store.grads(), cosine_decay(step, kSteps));
    if (step % 200 == 0) std::printf("step %3d  loss %.3f\n", static_cast<int>(step), item(loss));
  }
  std::string said = kText.substr(0, kSeen);
  for (; said.size() < 64; tape.reset()) {
    const auto next = to_tensor(slice(model(tape, {said.end() - kSeen, said.end()}), 0, kSeen - 1, 1)).data;
    said += static_cast<char>(std::max_element(next.begin(), next.end()) - next.begin());
  }
  std::printf("it says: %s\n", said.c_str());
  return said == kText.substr(0, 64) ? 0 : 1;
}
