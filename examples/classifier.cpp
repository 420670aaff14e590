// Separates two spirals: layers, operators, AdamW with schedule and clipping, and training that goes on from
// a saved state. Public headers only.
#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/nn.h>
#include <fieldmark/engine/ops.h>
#include <fieldmark/engine/state_file.h>
#include <fieldmark/engine/values.h>

#include <cmath>
#include <cstdio>

using namespace fieldmark;

namespace {

// A dense layer, a norm and GELU, with a residual connection.
struct Block {
  Dense<float> dense;
  LayerNorm<float> norm;
  Block(ParamStore<float>& store, const std::string& name, Index width, std::uint64_t seed)
      : dense(store, name + "/dense", {.in = width, .out = width}, seed),
        norm(store, name + "/norm", width) {}
  Var<float> operator()(const Params<float>& p, Var<float> x) const { return x + gelu(norm(p, dense(p, x))); }
};

}  // namespace

int main() {
  constexpr Index kPoints = 400;
  Tensor<float> x({kPoints, 2}), truth({kPoints, 1});
  std::vector<std::int32_t> labels;
  for (Index i = 0; i < kPoints; ++i) {
    const float r = 0.1f + 0.0045f * static_cast<float>(i / 2), angle = 9 * r + (i % 2 ? 3.14159f : 0.f);
    x[2 * i] = r * std::cos(angle);
    x[2 * i + 1] = r * std::sin(angle);
    labels.push_back(i % 2);
    truth[i] = static_cast<float>(i % 2);
  }

  ParamStore<float> store;
  const Dense<float> in(store, "in", {.in = 2, .out = 32}, 1), out(store, "out", {.in = 32, .out = 2}, 4);
  const Block first(store, "first", 32, 2), second(store, "second", 32, 3);
  Adam<float> adam(store, {.lr = 0.01, .weight_decay = 0.01});
  const Params<float> params(store);
  Tape<float> tape;
  float right = 0;
  const auto train = [&](int step) {
    tape.reset();
    store.zero_grad();
    const Var<float> logits = out(params, second(params, first(params, in(params, 4 * tape.constant(x)))));
    const Var<float> loss = softmax_cross_entropy(logits, labels);
    tape.backward(loss);
    clip_grad_norm(store, 1);
    adam.step(store.values(), store.grads(), warm_up(step, 20) * cosine_decay(step, 300));
    right = item(mean(equal(greater(slice(logits, 1, 1), slice(logits, 0, 1)), tape.constant(truth))));
    if (step % 100 == 0) std::printf("step %3d  loss %.4f\n", step, static_cast<double>(item(loss)));
    return item(loss);
  };
  for (int step = 0; step < 200; ++step) train(step);
  SafetensorsFile file;
  save_state(file, "classifier/", store, adam);
  file.write("classifier.safetensors");
  float loss = 0, again = 0;
  for (int step = 200; step < 300; ++step) loss = train(step);
  load_state(SafetensorsFile::read("classifier.safetensors"), "classifier/", store, adam);
  for (int step = 200; step < 300; ++step) again = train(step);
  std::printf("%.1f%% right, resumed %s\n", 100 * right, again == loss ? "with the same bits" : "WRONGLY");
  return right > 0.98 && again == loss ? 0 : 1;
}
