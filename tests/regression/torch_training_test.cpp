#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/sgd.h>
#include <fieldmark/engine/values.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>

#include "support/catch.h"
#include "support/random.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "support/torch.h"

// Another engine takes the same steps: optimisers on a network of dense layers, and Adam on a convolutional
// network and a transformer.
using namespace fieldmark;

namespace {

using Json = nlohmann::json;
using Labels = std::vector<std::int32_t>;
// Takes a step for the gradients in a store.
using Optimiser = std::function<void(ParamStore<double>&)>;

// The data that torch_training.py needs to take the same steps: arrays in the file, the rest in `runs`.
struct Record {
  SafetensorsFile file;
  Json runs;
  void add(const std::string& name, const Tensor<double>& t) {
    file.add(name, t.shape, std::span<const double>(t.data));
  }
};

// Records ten losses of a model. @param run  the model and the optimiser for PyTorch
void train(Record& record, const std::string& name, Json run, ParamStore<double>& store,
           const Optimiser& optimise, const std::function<Var<double>(Tape<double>&)>& loss_of) {
  run["name"] = name;
  for (const auto& e : store.entries()) {
    if (!is_trained(e.role)) continue;
    record.file.add(name + "/" + e.name, e.shape, std::span<const double>(store.values(store.find(e.name))));
    run["parameters"].push_back(e.name);
  }
  Tape<double> tape;
  for (int i = 0; i < 10; ++i) {
    tape.reset();
    store.zero_grad();
    const Var<double> loss = loss_of(tape);
    tape.backward(loss);
    run["losses"].push_back(item(loss));
    optimise(store);
  }
  record.runs.push_back(run);
}

// Returns Adam for the first store that it is called with.
Optimiser adam(const AdamOptions& o) {
  return [o, adam = std::shared_ptr<Adam<double>>()](ParamStore<double>& store) mutable {
    if (!adam) adam = std::make_shared<Adam<double>>(store, o);
    adam->step(store.values(), store.grads());
  };
}

Optimiser sgd(const SgdOptions& o, double clip) {
  return [o, clip, sgd = std::shared_ptr<Sgd<double>>()](ParamStore<double>& store) mutable {
    if (!sgd) sgd = std::make_shared<Sgd<double>>(store, o);
    if (clip > 0) clip_grad_norm(store, clip);
    sgd->step(store.values(), store.grads());
  };
}

// Layers [3, 16, 16, 2] on fixed data.
void train_dense(Record& record, const std::string& name, Json run, const Optimiser& optimise) {
  const auto x = uniform({64, 3}, -1, 1, 5), target = uniform({64, 2}, -1, 1, 6);
  record.add(name + "/x", x);
  record.add(name + "/target", target);
  ParamStore<double> store;
  const Dense<double> a(store, "a", {.in = 3, .out = 16, .activation = Activation::relu}, 1);
  const Dense<double> b(store, "b", {.in = 16, .out = 16, .activation = Activation::relu}, 2);
  const Dense<double> c(store, "c", {.in = 16, .out = 2}, 3);
  const Params<double> p(store);
  run["model"] = "dense";
  train(record, name, run, store, optimise, [&](Tape<double>& tape) {
    return mse_loss(c(p, b(p, a(p, tape.constant(x)))), tape.constant(target));
  });
}

// Two convolutions, each with a norm, ReLU and pooling, and a dense layer, on 6 images of 5 classes.
void train_convolutional(Record& record) {
  const std::string name = "convolutional";
  const auto x = uniform({6, 8, 8, 3}, -1, 1, 7);
  const Labels labels{0, 3, 1, 4, 2, 3};
  record.add(name + "/x", x);
  ParamStore<double> store;
  const Conv2d<double> first(store, "first", {.in = 3, .out = 8}, 1);
  const BatchNorm<double> batch(store, "batch", 8, {.relu = true});
  const Conv2d<double> second(store, "second", {.in = 8, .out = 12, .kernel = 3}, 2);
  const GroupNorm<double> group(store, "group", 12, {.groups = 4, .relu = true});
  const Dense<double> out(store, "out", {.in = 2 * 2 * 12, .out = 5}, 3);
  const Params<double> p(store);
  train(record, name,
        {{"model", name}, {"labels", labels}, {"optimiser", "Adam"}, {"options", {{"lr", 0.01}}}}, store,
        adam({.lr = 0.01}), [&](Tape<double>& tape) {
          const auto h = max_pool(batch(p, first(p, tape.constant(x))), {.size = 2, .stride = 2});
          const auto g = avg_pool(group(p, second(p, h)), 2);
          return softmax_cross_entropy(out(p, reshape(g, {6, 2 * 2 * 12})), labels);
        });
}

// A block of attention with two heads, a norm and a network with GELU, on a text of 10 letters of 7 kinds.
void train_transformer(Record& record) {
  const std::string name = "transformer";
  constexpr Index n = 10, width = 12, heads = 2, w = width / heads, kinds = 7;
  const Labels seen{0, 3, 1, 6, 3, 1, 2, 5, 4, 3}, next{3, 1, 6, 3, 1, 2, 5, 4, 3, 0};
  Tensor<double> mask({n, n});
  for (Index i = 0; i < mask.size(); ++i) mask[i] = i % n > i / n ? -1e9 : 0;
  ParamStore<double> store;
  const ParamId letter = store.add("letter", {kinds, width}), place = store.add("place", {n, width}),
                gamma = store.add("gamma", {width}), beta = store.add("beta", {width});
  for (const ParamId id : {letter, place, gamma}) {
    const auto start = uniform(store.entry(id).shape, -0.5, 0.5, static_cast<unsigned>(10 + id.index));
    std::ranges::copy(start.data, store.values(id).begin());
  }
  const Dense<double> qkv(store, "qkv", {.in = width, .out = 3 * width}, 1),
      mix(store, "mix", {.in = width, .out = width}, 2),
      wide(store, "wide", {.in = width, .out = 4 * width}, 3),
      narrow(store, "narrow", {.in = 4 * width, .out = width}, 4),
      out(store, "out", {.in = width, .out = kinds}, 5);
  const Params<double> p(store);
  const auto attend = [&](Var<double> x, Var<double> hidden) {
    const auto all = permute(reshape(qkv(p, x), {n, 3, heads, w}), {1, 2, 0, 3});  // [3, heads, n, w]
    const auto head = [&](Index part) { return x.tape().part(all, part * heads * n * w, {heads, n, w}); };
    const auto scores = batched_matmul(head(0), transpose(head(1))) / std::sqrt(static_cast<double>(w));
    return reshape(permute(batched_matmul(softmax(scores + hidden), head(2)), {1, 0, 2}), {n, width});
  };
  train(record, name,
        {{"model", name},
         {"heads", heads},
         {"seen", seen},
         {"next", next},
         {"optimiser", "Adam"},
         {"options", {{"lr", 0.01}, {"betas", {0.9, 0.99}}}}},
        store, adam({.lr = 0.01, .beta2 = 0.99}), [&](Tape<double>& tape) {
          const auto embedded = gather(p.leaf(tape, letter), 0, seen) + p.leaf(tape, place);
          const auto x = embedded + mix(p, attend(embedded, tape.constant(mask)));
          const auto h = layer_norm(x, p.leaf(tape, gamma), p.leaf(tape, beta));
          return softmax_cross_entropy(out(p, x + narrow(p, gelu(wide(p, h)))), next);
        });
}

}  // namespace

TEST_CASE(
    "regression: PyTorch takes the same ten steps of each optimiser and of each kind of model to 1e-9") {
  if (!torch_or_skip("the comparison of training with PyTorch")) return;
  const TemporaryFolder folder;
  Record record;
  train_dense(record, "adam", {{"optimiser", "Adam"}, {"options", Json::object()}}, adam({}));
  train_dense(record, "adamw", {{"optimiser", "AdamW"}, {"options", {{"lr", 0.01}, {"weight_decay", 0.1}}}},
              adam({.lr = 0.01, .weight_decay = 0.1}));
  train_dense(record, "momentum",
              {{"optimiser", "SGD"}, {"options", {{"lr", 0.05}, {"momentum", 0.9}, {"weight_decay", 0.1}}}},
              sgd({.lr = 0.05, .momentum = 0.9, .weight_decay = 0.1}, 0));
  train_dense(record, "nesterov",
              {{"optimiser", "SGD"},
               {"options", {{"lr", 0.05}, {"momentum", 0.9}, {"nesterov", true}}},
               {"clip", 0.1}},
              sgd({.lr = 0.05, .momentum = 0.9, .nesterov = true}, 0.1));
  train_convolutional(record);
  train_transformer(record);
  record.file.metadata["runs"] = record.runs.dump();
  record.file.write(folder / "runs");
  const std::string command = "OMP_NUM_THREADS=1 /usr/bin/python3 " + source_dir() +
                              "/tests/regression/torch_training.py '" + (folder / "runs").string() + "' > '" +
                              (folder / "answer").string() + "'";
  REQUIRE(std::system(command.c_str()) == 0);
  std::ifstream answer(folder / "answer");
  std::string name;
  double error = 1;
  std::size_t compared = 0;
  for (; answer >> name >> error; ++compared) {
    INFO(name << ": " << error);
    CHECK(error <= 1e-9);
  }
  CHECK(compared == record.runs.size());
}
